#pragma once

#include <vector>

#include "graspatlas/continuation/neighbour_test.hpp"
#include "graspatlas/continuation/options.hpp"
#include "graspatlas/manifold/bound_check.hpp"
#include "graspatlas/manifold/newton.hpp"
#include "graspatlas/manifold/system.hpp"
#include "graspatlas/manifold/tangent.hpp"

namespace graspatlas {

/// A point that moves over a manifold by steps of its own, whatever charts say, with the work space of one thread.
class Walker {
 public:
  /// Moves on the manifold of a system whose bounds are those of `bounded`; one bound may be left out. The system is
  /// used by this walker only.
  Walker(System& system, const System& bounded, const AtlasOptions& options, int left_out = -1);
  Walker(const Walker&) = delete;
  Walker& operator=(const Walker&) = delete;

  /// Where it is, and the tangent basis there.
  const double* x() const { return x_.data(); }
  const double* Phi() const { return Phi_.data(); }
  /// The last step, as a tangent vector [tangent_size], which may be set.
  std::vector<double>& heading() { return heading_; }
  int dimension() const { return k_; }
  Newton& newton() { return newton_; }
  NeighbourTest& test() { return test_; }

  /// To a point of the manifold with its tangent basis.
  void put(const double* point, const double* basis);
  /// To the point of the manifold above a point, where about this is the tangent basis. False when there is none, or it
  /// is outside the bounds.
  bool put_above(const double* point, const double* basis);
  /// To the point of the manifold above one nearby, whatever the bounds. False when there is none.
  bool follow(const double* point);

  enum class Step { taken, out_of_bounds, failed };
  /// A step of a length along a direction [dimension] of the tangent space, to where the two points' charts could be
  /// neighbours.
  Step step(const double* direction, double length);
  /// The same, with half the length for so many times as it fails; `length` becomes that of the last trial.
  Step step_halving(const double* direction, double& length, int halvings);

  /// Coordinates [dimension] of the heading in the tangent basis.
  void heading_coordinates(double* u) const { tangent_coordinates(Phi(), heading_.data(), k_, n_, u); }

 private:
  System& system_;
  BoundCheck bounds_;
  int left_out_, n_, k_;
  Newton newton_;
  NeighbourTest test_;
  std::vector<double> x_, Phi_, heading_;
  std::vector<double> x_new_, Phi_new_, step_;  // scratch of a step
  Beside beside_;
};

}  // namespace graspatlas
