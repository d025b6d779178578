#pragma once

#include <vector>

#include "graspatlas/manifold/system.hpp"

namespace graspatlas {

/// A point x of a manifold, and the points x (+) +-h phi_i a little ahead and behind along its tangent vectors: central
/// differences of what is smooth in the space around the manifold are its slopes on the manifold, to about 1e-10.
class Surroundings {
 public:
  explicit Surroundings(const System& system);

  /// x [configuration_size] and its tangent basis Phi, row-major [dimension x tangent_size].
  void set(const double* x, const double* Phi);

  int dimension() const { return k_; }
  const double* x() const { return x_.data(); }
  const RowMatrix& Phi() const { return Phi_; }
  const double* ahead(int i) const { return ahead_.row(i).data(); }
  const double* behind(int i) const { return behind_.row(i).data(); }

  /// The slope along a tangent vector of a number with these values ahead and behind.
  double slope(double ahead, double behind) const { return (ahead - behind) / (2.0 * h_); }

  void set_step(double h) { h_ = h; }
  static constexpr double kStep = 1e-5;  ///< h, unless another is set [units of the tangent space]

 private:
  const System& system_;
  int k_;
  double h_ = kStep;
  std::vector<double> x_, step_;
  RowMatrix Phi_, ahead_, behind_;
};

}  // namespace graspatlas
