#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <vector>

#include "graspatlas/audit/facet_samples.hpp"
#include "graspatlas/audit/rank_search.hpp"
#include "graspatlas/audit/walker.hpp"
#include "graspatlas/continuation/charts.hpp"
#include "graspatlas/continuation/options.hpp"
#include "graspatlas/manifold/bound_check.hpp"
#include "graspatlas/manifold/bound_manifold.hpp"
#include "graspatlas/manifold/system.hpp"
#include "graspatlas/random.hpp"

namespace graspatlas {

/// A point of the manifold that no chart covers, and its tangent basis.
struct Hole {
  std::vector<double> x, Phi;
};

/// Looks for points of the manifold that the charts of an atlas do not cover, with the work space of one thread. Charts
/// are only read.
///
/// It moves over the manifold by small steps of its own, whatever the charts say, so that where it comes to is on the
/// sheet and within the bounds where it began; every point that it comes to should lie in a chart's polytope, give or
/// take a sliver.
class Auditor {
 public:
  /// The system is used by this auditor only.
  Auditor(System& system, const AtlasOptions& options, const Charts& charts);
  Auditor(const Auditor&) = delete;
  Auditor& operator=(const Auditor&) = delete;

  /// Walks at random from a chart. Returns how many points were looked up.
  int walk(int slot, std::uint64_t seed, std::vector<Hole>& holes);

  /// Walks at random along a bound that cuts a chart, on the (k - 1)-dimensional manifold that it bounds.
  int walk_along_bound(int slot, std::uint64_t seed, std::vector<Hole>& holes);

  /// Bounds cut polytopes as if they were flat. Where one is not, and there are points beyond its facet within bounds,
  /// goes on from there, to the first hole.
  void look_behind_bounds(int slot, std::vector<Hole>& holes);

  /// Goes on by small steps where a vertex was closed. Returns the reason to close it: `covered` when all that was come
  /// to is, `bounds` when there is nothing more, the old one when it cannot be followed either, or leads to a hole.
  Closed look_beyond(int slot, int vertex, std::vector<Hole>& holes);

  /// True when the Jacobian, to a tenth of what it is at the centre of the chart, loses rank within it.
  bool loses_rank(int slot) { return rank_search_.loses_rank(charts_.center(slot), charts_.basis(slot)); }

  /// True when a chart covers a point of the manifold with this tangent basis.
  bool covers(const double* x, const double* Phi);

 private:
  /// A bound as a manifold, and what walks along it.
  struct BoundWalker {
    BoundWalker(System& system, int bound, const AtlasOptions& options)
        : manifold(system, bound), walker(manifold, system, options, bound) {}
    BoundManifold manifold;
    Walker walker;
  };
  /// How a march ended: as far as it should, at a hole, outside the bounds, or where no step could be taken.
  enum class March { arrived, hole, bounds, failed };

  bool covers(int slot, const double* x, const double* Phi);
  bool look_up(const double* x, const double* Phi, std::vector<Hole>& holes);
  March march(const double* direction, double reach, std::vector<Hole>& holes);
  int random_steps(Walker& walker, SplitMix64& random, std::vector<Hole>& holes);
  void random_direction(Walker& walker, SplitMix64& random);
  int random_bound_facet(const Polytope& polytope, SplitMix64& random) const;
  void tangent_vectors_across(const double* normal, const double* basis);
  Walker& bound_walker(int bound);
  bool is_hidden(int slot, int bound, const double* sample, double slope);
  bool finds_hole_beyond(int slot, int facet, const double* sample, std::vector<Hole>& holes);

  System& system_;
  AtlasOptions options_;
  const Charts& charts_;
  int n_, k_;
  Walker walker_;
  RankSearch rank_search_;
  std::map<int, std::unique_ptr<BoundWalker>> bound_walkers_;
  BoundCheck bounds_;
  FacetSamples samples_;
  std::vector<double> displacement_, u_, embedding_, x_, Phi_across_, step_, direction_;  // scratch
  Neighbours::Scratch near_scratch_;
  std::vector<int> nearest_, near_;
};

}  // namespace graspatlas
