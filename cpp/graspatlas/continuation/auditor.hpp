#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <vector>

#include "graspatlas/continuation/charts.hpp"
#include "graspatlas/continuation/expander.hpp"
#include "graspatlas/continuation/neighbour_test.hpp"
#include "graspatlas/continuation/newton.hpp"
#include "graspatlas/continuation/system.hpp"

namespace graspatlas {

/// A point of the manifold that no chart covers, and its tangent basis.
struct Hole {
  std::vector<double> x, Phi;
};

/// Random numbers that are the same on every machine.
class Dice {
 public:
  explicit Dice(std::uint64_t seed) : state_(seed) {}
  std::uint64_t bits();                                                     ///< splitmix64
  double uniform() { return static_cast<double>(bits() >> 11) * 0x1p-53; }  ///< in [0, 1)
  double normal();

 private:
  std::uint64_t state_;
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
  ~Auditor();

  /// Walks at random from a chart. Returns how many points were looked up.
  int walk(int slot, std::uint64_t seed, std::vector<Hole>& holes);

  /// Walks at random along a bound that cuts a chart, on the (k - 1)-dimensional manifold that it bounds.
  int walk_along_bound(int slot, std::uint64_t seed, std::vector<Hole>& holes);

  /// Bounds cut polytopes as if they were flat. Where one is not, and there are points beyond its facet within bounds,
  /// goes on from there.
  int look_behind_bounds(int slot, std::vector<Hole>& holes);

  /// Goes on by small steps where a vertex was closed. Returns the reason to close it: `covered` when all that was come
  /// to is, `bounds` when there is nothing more, the old one when it cannot be followed either, or leads to a hole.
  Closed look_beyond(int slot, int vertex, std::vector<Hole>& holes);

  /// True when the Jacobian, to a tenth of what it is at the centre of the chart, loses rank within it.
  bool loses_rank(int slot);

  /// True when a chart covers a point of the manifold with this tangent basis.
  bool covers(const double* x, const double* Phi);

 private:
  /// A place on a manifold, and the system and work space that moves it.
  class Walker;

  bool covers(int slot, const double* x, const double* Phi);
  bool look_up(const double* x, const double* Phi, std::vector<Hole>& holes);
  bool march(Walker& walker, const double* direction, double reach, std::vector<Hole>& holes);
  int random_steps(Walker& walker, Dice& dice, bool on_bound, std::vector<Hole>& holes);
  void tangent_vectors_across(const double* normal, const double* basis);
  void facet_samples(const Polytope& polytope, int facet);
  Walker& bound_walker(int bound);
  double regularity_at(const double* x, const double* Phi);

  System& system_;
  AtlasOptions options_;
  const Charts& charts_;
  int x_size_, n_, k_;
  std::unique_ptr<Walker> walker_;
  std::map<int, std::unique_ptr<Walker>> bound_walkers_;
  std::vector<std::unique_ptr<System>> bound_systems_;
  bool march_ended_by_bounds_ = false;
  std::vector<double> displacement_, u_, embedding_, samples_, corners_, x_, Phi_, slack_, step_, direction_;
  Neighbours::Scratch near_scratch_;
  std::vector<int> near_;
};

}  // namespace graspatlas
