#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "graspatlas/continuation/charts.hpp"

namespace graspatlas {

struct Checkpoint;

/// The expansion of one chart of a generation, as far as it has come.
struct Expansion {
  std::int64_t number;  ///< in the order of the algorithm, from one on; 0 for none
  std::int32_t index;   ///< the chart's place in the generation
  std::int32_t made;    ///< charts that it has made
};

/// The charts of an atlas in the order of the algorithm, and which of them are to be expanded next.
///
/// The charts that are open at one time are a generation; the charts made from them are the next, behind those that
/// were deferred. A small generation is expanded in its own order, which packs charts best. Charts that follow each
/// other in a generation are mostly near each other, its parts are not: in a large one charts are taken from the
/// beginning of each of several parts in turn. So the order depends on the charts alone, not on threads.
///
/// Of charts it reads the keys, and writes the numbers. One thread at a time may use it.
class Front {
 public:
  /// Charts that one expansion may make: a chart with more to make is deferred to the next generation.
  static constexpr int kMostCharts = 64;
  /// Key of the first chart that an expansion makes.
  static ChartKey first_key(std::int64_t number) { return static_cast<ChartKey>(number) * kMostCharts; }

  explicit Front(Charts& charts) : charts_(charts) {}

  std::int64_t count() const { return static_cast<std::int64_t>(order_.size()); }
  /// Slot of chart i in the order of the algorithm.
  int slot(std::int64_t i) const { return order_[static_cast<std::size_t>(i)]; }
  /// Charts, the first ones, whose numbers stay: of those after them some may get others when expansions go on.
  std::int64_t settled_count() const { return settled_; }
  /// Charts that are still to be expanded.
  std::int64_t open_count() const;
  std::int64_t bytes() const { return static_cast<std::int64_t>(order_.capacity() * sizeof(int)); }

  /// Numbers the charts that have come; nothing may be expanding. While expansions are paused, charts that come after
  /// theirs may get other numbers later.
  void settle();

  /// Begins the next generation: the charts that were deferred, and all that are new. False when there is none.
  bool begin_generation();
  /// Slots of the charts of the generation.
  const std::vector<int>& generation() const { return generation_; }
  int slot_of(const Expansion& expansion) const { return generation_[static_cast<std::size_t>(expansion.index)]; }
  const double* center(int slot) const { return charts_.center(slot); }

  /// True while the generation has an expansion that is paused or was not begun.
  bool has_next() const { return !paused_.empty() || position_ < sequence_.size(); }
  /// The next of these, which then is going on.
  Expansion next();
  /// An expansion that goes on later, before all that come after it.
  void pause(const Expansion& expansion);
  /// Charts that are expanded, or go on to be, in the next generation.
  void defer(int slot) { deferred_.push_back(slot); }
  void defer(const std::vector<int>& slots) { deferred_.insert(deferred_.end(), slots.begin(), slots.end()); }
  /// Number of an expansion beside those of the generation, for a chart that comes from elsewhere.
  std::int64_t new_number() { return ++expansion_count_; }

  /// Into its part of a checkpoint, and from there, where all its charts must be settled; those that are open again are
  /// marked as not done.
  void save(Checkpoint& out) const;
  void restore(const Checkpoint& saved);

 private:
  /// A generation of fewer charts keeps its own order.
  static constexpr int kLeastForParts = 48;
  /// A larger one is taken in at most so many parts, of at least so many charts.
  static constexpr int kMostParts = 16, kSmallestPart = 8;

  void choose_sequence();

  Charts& charts_;
  std::vector<int> order_;      // slots in the order of the algorithm
  std::ptrdiff_t settled_ = 0;  // charts of it whose numbers stay
  std::vector<int> generation_;
  std::vector<int> sequence_;      // places in the generation, in the order in which its charts are expanded
  std::size_t position_ = 0;       // in the sequence: of the next that was not begun
  std::size_t next_first_ = 0;     // in the order: where the next generation begins
  std::vector<int> deferred_;      // slots
  std::vector<Expansion> paused_;  // by their numbers; they go on first
  std::int64_t expansion_count_ = 0;
};

}  // namespace graspatlas
