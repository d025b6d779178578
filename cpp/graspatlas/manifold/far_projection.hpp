#pragma once

#include <vector>

#include "graspatlas/manifold/system.hpp"
#include "graspatlas/types.hpp"

namespace graspatlas {

/// Projection of points that may be far off the manifold: Levenberg and Marquardt's method within bounds.
///
/// Unlike Newton's method it may start far off. A bound that is broken counts as an equation, so the point ends within
/// the bounds, a millionth at least.
///
/// Source: J. J. More, "The Levenberg-Marquardt Algorithm: Implementation and Theory", 1978; the steps are tangent
/// vectors.
class FarProjection {
 public:
  explicit FarProjection(System& system);

  /// Moves x [configuration_size] onto the manifold; false when the method ends elsewhere.
  bool project(double* x);

 private:
  void evaluate(const double* x, Vector& r);

  System& system_;
  Vector r_, moved_r_, slacks_, gradient_;
  RowMatrix J_;
  Matrix normal_, damped_;
  std::vector<double> residual_, moved_, step_;
};

}  // namespace graspatlas
