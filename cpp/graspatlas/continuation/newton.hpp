#pragma once

#include <vector>

#include "graspatlas/continuation/linear_solver.hpp"
#include "graspatlas/continuation/system.hpp"

namespace graspatlas {

/// Why a projection ended; values are stable, Python shows the names.
enum class Projection { converged, not_converged, singular };

struct NewtonOptions {
  double tolerance = 1e-11;  ///< largest entry of |R(x)| that counts as zero [-]
  int max_iterations = 10;
};

/// Orthogonal projection of points of a tangent space onto the manifold: eqs (14) and (15) of the paper.
///
/// Solves [J(x); Phi'] d = -[R(x); 0] and moves x <- x (+) d until R(x) = 0, so that x stays above its
/// starting point. The last factorisation is kept: it also gives the tangent basis at the point found.
class Newton {
 public:
  Newton(System& system, NewtonOptions options);

  /// Move x [configuration_size] onto the manifold along the normal space of Phi.
  /// Phi is row-major [dimension x tangent_size]: its rows are the tangent vectors.
  Projection project(double* x, const double* Phi);

  /// Orthonormal tangent basis [dimension x tangent_size] at the point that `project` has just found.
  /// False when the tangent space is not well defined there.
  bool tangent_basis(double* Phi);

  /// Move x onto the manifold by least-norm steps, and its tangent basis: for a first point, where no basis
  /// is known.
  Projection project_freely(double* x, double* Phi);

  double residual() const { return residual_; }  ///< largest entry of |R(x)| at the last point

 private:
  bool factorize(const double* Phi);

  System& system_;
  NewtonOptions options_;
  LinearSolver solver_;
  std::vector<double> R_, J_, step_, tangents_, corrections_;
  double residual_ = 0.0;
};

}  // namespace graspatlas
