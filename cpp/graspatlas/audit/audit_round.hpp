#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "graspatlas/audit/auditor.hpp"
#include "graspatlas/continuation/charts.hpp"
#include "graspatlas/continuation/checkpoint.hpp"
#include "graspatlas/continuation/front.hpp"

namespace graspatlas {

/// One round of an audit: places of a complete atlas to look at, all of which several threads can at the same time, and
/// what they find there.
///
/// It looks at every vertex that was closed for want of something better; behind the bounds of all charts that are new
/// since the last round; at charts that may lose rank; and at random walks, of which every second begins at a chart
/// that is new.
class AuditRound {
 public:
  /// Of charts in the order of the front, none of which is open; with walks over at least so many points, unless the
  /// rounds before have found those of all walks covered.
  AuditRound(const Charts& charts, const Front& front, const AuditState& state, std::int64_t points);

  /// Looks at the places, each thread with one of the auditors, until that is done or so many seconds have passed.
  /// True when it is done.
  bool run(const std::vector<Auditor*>& auditors, double seconds);

  /// Notes what was found out about charts and their closed vertices.
  void apply(Charts& charts) const;
  /// Points that no chart covers, in the order of the places.
  std::vector<const Hole*> holes() const;
  /// Points of walks that were looked up, and whether one of them was a hole.
  std::int64_t points() const;
  bool walks_found_holes() const;

 private:
  /// A place to look at, and what is found there.
  struct Place {
    enum class Kind { rank, closed_vertex, behind_bounds, walk, along_bound } kind;
    int slot, vertex;
    std::uint64_t seed;
    int points = 0;
    bool loses_rank = false;
    Closed reason = Closed::open;
    std::vector<Hole> holes = {};
  };

  void add_places_of(int slot, const Chart& chart);
  void add_walks(const Front& front, const AuditState& state, std::int64_t points, const std::vector<int>& at_bounds);
  static void look(Auditor& auditor, Place& at);

  std::vector<Place> places_;
  std::size_t next_ = 0;
};

}  // namespace graspatlas
