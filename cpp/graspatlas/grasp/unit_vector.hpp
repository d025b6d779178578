#pragma once

#include <Eigen/Core>

namespace graspatlas {

/// A vector w of length one, w / |w|, and how it turns when w changes.
struct UnitVector {
  explicit UnitVector(const Eigen::Vector3d& w) : length(w.norm()), value(w / length) {}
  /// Derivative of w / |w| for the derivative w_t of w.
  Eigen::Vector3d derivative(const Eigen::Vector3d& w_t) const { return (w_t - value * value.dot(w_t)) / length; }

  double length;
  Eigen::Vector3d value;
};

}  // namespace graspatlas
