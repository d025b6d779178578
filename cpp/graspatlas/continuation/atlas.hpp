#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

#include "graspatlas/continuation/auditor.hpp"
#include "graspatlas/continuation/charts.hpp"
#include "graspatlas/continuation/checkpoint.hpp"
#include "graspatlas/continuation/expander.hpp"
#include "graspatlas/continuation/system.hpp"

namespace graspatlas {

/// An atlas of the connected part of R(x) = 0 that contains a first point: Algorithm 1, lines 4 to 13.
///
/// Invariants, for charts i and j that are neighbours: the displacement between their centres is at most 2 r long; it
/// is at most epsilon off either tangent space, and its cosine with either is at least 1 - epsilon; the tangent spaces
/// agree to 1 - epsilon; and each polytope lies in the half-space nearer to its own centre than to the other's, both
/// seen in its own tangent space.
///
/// The charts that are open at one time are a generation; the charts made from them are the next. A small generation is
/// expanded in its own order; in a large one charts are taken from several parts of the front in turn. Threads look at
/// a window of this order, and take the first chart that is far enough (kIndependent) from all before it that are not
/// done: then the two leave each other's charts alone. So the atlas is the one that a single thread would make, to the
/// bit.
class Atlas {
 public:
  /// Charts that one task may make: a chart with more to make comes again in the next generation.
  static constexpr int kMostCharts = 64;

  /// Starts with one chart at the point of the manifold nearest x0.
  /// Throws when x0 cannot be projected, breaks a bound, or the Jacobian there is rank deficient.
  /// A system that cannot be cloned is left to one thread.
  Atlas(System& system, const double* x0, const AtlasOptions& options, int threads = 1);

  /// Goes on from a checkpoint, to the same atlas, to the bit. Throws when the checkpoint does not fit.
  Atlas(System& system, const Checkpoint& saved, const AtlasOptions& options, int threads = 1);
  /// All that is needed to go on from here later, with the charts from `first` on.
  Checkpoint save(std::int64_t first) const;

  /// Expand until the atlas is complete, has `chart_limit` charts, or `seconds` have passed.
  void expand(std::int64_t chart_limit, double seconds);

  bool complete() const { return open_count() == 0; }
  /// Charts that were not expanded yet.
  std::int64_t open_count() const;
  std::int64_t count() const { return static_cast<std::int64_t>(order_.size()); }
  /// Charts, the first ones, whose numbers stay: of those after them some may get others when tasks go on.
  std::int64_t settled_count() const { return settled_; }
  int threads() const { return static_cast<int>(workers_.size()); }

  /// Look, for so many seconds, for points of the manifold that a complete atlas does not cover: by at least so many
  /// points of random walks, along bounds, behind bounds that are not flat, and where vertices were closed. Where there
  /// is one, a chart begins there and the atlas is open again: expand it, and audit it again. The same for any number
  /// of threads.
  void audit(std::int64_t points, double seconds);
  /// True when the last round of the audit of a complete atlas found it covered, or it was given up.
  bool audited() const { return complete() && audit_.done; }
  const AuditState& audit_state() const { return audit_; }

  const double* center(std::int64_t i) const { return charts_.center(order_[i]); }
  const double* basis(std::int64_t i) const { return charts_.basis(order_[i]); }
  /// Its facets and neighbours name slots; `number` tells which charts these are.
  const Chart& chart(std::int64_t i) const { return charts_[order_[i]]; }
  int number(int slot) const { return charts_[slot].number; }

  /// Newton projections made so far, those of failed attempts included.
  std::int64_t projections() const;
  /// Memory that the atlas holds.
  std::int64_t bytes() const;
  /// Memory that the numbers of all its charts take at most when they are copied.
  std::int64_t array_bytes() const;

  const System& system() const { return system_; }

 private:
  static constexpr int kWindow = 32;

  struct Worker {
    std::unique_ptr<System> system;  // its own, if the system has a clone
    std::unique_ptr<Expander> expander;
    std::unique_ptr<Auditor> auditor;
  };
  /// A place that an audit looks at, and what it finds there.
  struct Look {
    enum class Kind { rank, closed_vertex, behind_bounds, walk, along_bound } kind;
    int slot, vertex;
    std::uint64_t seed;
    int points = 0;
    bool loses_rank = false;
    Closed reason = Closed::open;
    std::vector<Hole> holes = {};
  };
  /// A chart to expand.
  struct Task {
    std::int64_t number;   // in the order of the algorithm; 0: this place in the window is free
    int turn;              // the chart's place in the generation
    int made, most;        // charts that it has made, and how many it may make in all
    std::uint32_t before;  // places in the window of those that must be done first
    bool running;
  };
  using Lock = std::unique_lock<std::mutex>;

  /// With work space for its threads, and no chart.
  Atlas(System& system, const AtlasOptions& options, int threads);
  void restore(const Checkpoint& saved);
  void work(Worker& worker);
  Task* take_task(Worker& worker);
  Task* first_free_task();
  void admit_task(std::int64_t most);
  bool has_next() const { return !paused_.empty() || position_ < turns_.size(); }
  bool may_admit() const;
  const double* embedding(int turn) const;
  void finish_task(Worker& worker, Task& task, int made, bool done);
  void pause(const Task& task, int made);
  void free_place(Task& task);
  void stop_after_error();
  void stop();
  bool next_generation(Worker& worker);
  void choose_order(Worker& worker);
  void settle_order();
  void begin_round(std::int64_t points);
  void add_walks(std::int64_t points, const std::vector<int>& at_bounds);
  void look(Auditor& auditor, Look& at) const;
  void end_round();
  bool add_holes();
  void wait(Lock& lock);
  bool tiny() const;

  System& system_;
  AtlasOptions options_;
  Charts charts_;
  std::vector<std::unique_ptr<Worker>> workers_;
  std::vector<int> order_;      // slots in the order of the algorithm
  std::ptrdiff_t settled_ = 0;  // charts of it whose numbers stay

  std::vector<int> generation_, turns_;  // slots of the charts to expand, and the order to take them in
  std::vector<double> embeddings_;       // of the charts of the generation
  std::size_t position_ = 0;             // in turns_
  std::size_t next_first_ = 0;           // in order_: where the next generation begins
  std::vector<int> again_;               // charts that made as many as one task may, or were opened again
  std::vector<PausedTask> paused_;       // tasks that time or the limit of charts cut short; they go on first
  std::int64_t task_count_ = 0;

  AuditState audit_;
  std::vector<Look> looks_;  // of the round of the audit that is going on
  std::size_t next_look_ = 0;

  // State of one call of expand, guarded by mutex_.
  std::mutex mutex_;
  std::condition_variable changed_, helpers_wanted_;
  std::int64_t chart_limit_ = 0, made_ = 0, promised_ = 0;  // charts that tasks have made, and may still make
  std::array<Task, kWindow> window_;                        // tasks that are running, or may be next
  int admitted_ = 0;                                        // tasks in the window
  bool stop_ = false;                                       // no more are admitted
  std::atomic<std::int64_t> events_{0};                     // changes that a thread may wait for
  Clock::time_point deadline_;
};

}  // namespace graspatlas
