#pragma once

#include <vector>

#include "graspatlas/manifold/linear_solver.hpp"
#include "graspatlas/manifold/system.hpp"

namespace graspatlas {

/// Why a projection ended; values are stable, Python shows the names.
enum class Projection { converged, not_converged, singular };

/// Largest of |R_e| / max_c |J_ec|: how far a point is from the zero sets of its equations, to first order [units of
/// the tangent space]. Infinite where a number is not finite, or an equation is off whose row is zero.
/// `row_sizes` [equations] gets the largest entries of the rows.
double distance_to_zero(const double* R, const double* J, int equations, int n, double* row_sizes);

/// Orthogonal projection of points of a tangent space onto the manifold: eqs (14) and (15) of the paper.
///
/// Solves [J(x); Phi'] d = -[R(x); 0] and moves x <- x (+) d until R(x) = 0, so that x stays above its
/// starting point. Rows are divided by their largest entries first: an equation may be multiplied by any number.
/// One factorisation serves for as many steps as it makes much shorter, which ask for R alone; the last is made at the
/// point found, and gives the tangent basis there.
class Newton {
 public:
  explicit Newton(System& system);

  /// Move x [configuration_size] onto the manifold along the normal space of Phi.
  /// Phi is row-major [dimension x tangent_size]: its rows are the tangent vectors.
  Projection project(double* x, const double* Phi);

  /// The same, to within about `enough` [units of the tangent space]: without the last steps, which are shorter than
  /// that and quickly vanish. Nothing can be asked of the point afterwards.
  Projection project_nearly(double* x, const double* Phi, double enough);

  /// Orthonormal tangent basis [dimension x tangent_size] at the point that `project` has just found.
  /// False when the tangent space is not well defined there.
  bool tangent_basis(double* Phi);

  /// Move x onto the manifold by least-norm steps, and its tangent basis: for a first point, where no basis
  /// is known.
  Projection project_freely(double* x, double* Phi);

  double residual() const { return residual_; }  ///< largest entry of |R(x)| at the last point

  /// How near the last factorised [J; Phi'] is to losing rank: about its smallest singular value, from above, with the
  /// sign of its determinant; J's rows are divided by the scales. Beside tangent vectors this is about that of J alone.
  double regularity(int iterations = 2);

  /// Scales of the equations [equations], for regularity: a pointer that stays valid. Until it is set, or while it is
  /// empty, rows are divided by their own largest entries.
  void set_scales(const std::vector<double>* scales) { scales_ = scales; }
  /// Largest entries of J's rows at the last point.
  const std::vector<double>& row_sizes() const { return row_sizes_; }

  /// Factorises [J; Phi'] at x, for `approach` and `regularity`. False when it is singular.
  bool hold(const double* x, const double* Phi);

  /// One step towards the manifold with the factorisation that is held: from a step u away from its point this comes
  /// within the order of |u|^3. False when a number is not finite.
  bool approach(double* x);

 private:
  double linearize(const double* x);
  double solve_step();
  double step_down(double* x);
  bool descend(double* x, double length, double enough, double contraction);
  bool factorize(const double* Phi);
  double tolerance(const double* x) const;

  System& system_;
  LinearSolver solver_;
  const std::vector<double>* scales_ = nullptr;
  std::vector<double> R_, J_, row_sizes_, inverse_sizes_, step_;
  double residual_ = 0.0;
};

}  // namespace graspatlas
