#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "graspatlas/audit/audit_round.hpp"
#include "graspatlas/audit/auditor.hpp"
#include "graspatlas/continuation/charts.hpp"
#include "graspatlas/continuation/checkpoint.hpp"
#include "graspatlas/continuation/expander.hpp"
#include "graspatlas/continuation/front.hpp"
#include "graspatlas/continuation/options.hpp"
#include "graspatlas/continuation/task_window.hpp"
#include "graspatlas/manifold/system.hpp"

namespace graspatlas {

/// An atlas of the connected part of R(x) = 0 that contains a first point: Algorithm 1, lines 4 to 13.
///
/// Invariants, for charts i and j that are neighbours: the displacement between their centres is at most 2 r long; it
/// is at most epsilon off either tangent space, and its cosine with either is at least 1 - epsilon; the tangent spaces
/// agree to 1 - epsilon; and each polytope lies in the half-space nearer to its own centre than to the other's, both
/// seen in its own tangent space.
///
/// Its charts lie in `Charts`, `Front` says which are to be expanded next, and `TaskWindow` hands them out to threads,
/// each of which has an Expander, such that the atlas is the one that a single thread would make, to the bit.
class Atlas {
 public:
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
  std::int64_t open_count() const { return front_.open_count(); }
  std::int64_t count() const { return front_.count(); }
  /// Charts, the first ones, whose numbers stay: of those after them some may get others when expansions go on.
  std::int64_t settled_count() const { return front_.settled_count(); }
  int threads() const { return static_cast<int>(workers_.size()); }

  /// Look, for so many seconds, for points of the manifold that a complete atlas does not cover: by at least so many
  /// points of random walks, along bounds, behind bounds that are not flat, and where vertices were closed. Where there
  /// is one, a chart begins there and the atlas is open again: expand it, and audit it again. The same for any number
  /// of threads.
  void audit(std::int64_t points, double seconds);
  /// True when the last round of the audit of a complete atlas found it covered, or it was given up.
  bool audited() const { return complete() && audit_.done; }
  const AuditState& audit_state() const { return audit_; }

  const double* center(std::int64_t i) const { return charts_.center(front_.slot(i)); }
  const double* basis(std::int64_t i) const { return charts_.basis(front_.slot(i)); }
  /// Its facets and neighbours name slots; `number` tells which charts these are.
  const Chart& chart(std::int64_t i) const { return charts_[front_.slot(i)]; }
  int number(int slot) const { return charts_[slot].number; }

  /// Newton projections made so far, those of failed attempts included.
  std::int64_t projections() const;
  /// Memory that the atlas holds.
  std::int64_t bytes() const;

  const System& system() const { return system_; }

  /// Charts by their slots, while what is copied of them is given back; the atlas cannot be used then.
  Charts& charts_to_give_back() { return charts_; }

 private:
  /// What belongs to one thread.
  struct Worker {
    std::unique_ptr<System> system;  // its own, if the system has a clone
    std::unique_ptr<Expander> expander;
    std::unique_ptr<Auditor> auditor;  // made for the first audit
  };

  /// With work space for its threads, and no chart.
  Atlas(System& system, const AtlasOptions& options, int threads);
  void work(int worker);
  std::vector<Auditor*> auditors();
  void end_round();
  bool begin_charts_at_holes();
  void put_back_charts(const Checkpoint& saved);
  void put_back_closed_vertices(const Checkpoint& saved);

  System& system_;
  AtlasOptions options_;
  Charts charts_;
  std::vector<Worker> workers_;
  Front front_;
  TaskWindow window_;
  AuditState audit_;
  std::unique_ptr<AuditRound> round_;  // of the audit, if one is going on
};

}  // namespace graspatlas
