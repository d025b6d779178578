#pragma once

#include <vector>

#include "graspatlas/manifold/system.hpp"

namespace graspatlas {

/// Whether points are within the bounds of a system, with work space for one thread.
class BoundCheck {
 public:
  explicit BoundCheck(const System& system)
      : system_(system), slacks_(static_cast<std::size_t>(system.bound_count())) {}

  /// Slacks of the bounds at x [bound_count].
  const std::vector<double>& slacks(const double* x) {
    if (!slacks_.empty()) system_.slack(x, slacks_.data());
    return slacks_;
  }

  /// True when x is beyond no bound by more than rounding; one bound may be left out.
  bool inside(const double* x, int left_out = -1) {
    slacks(x);
    for (std::size_t b = 0; b < slacks_.size(); ++b)
      if (!(slacks_[b] >= -kTolerance) && static_cast<int>(b) != left_out) return false;
    return true;
  }

 private:
  /// A point may miss a bound by rounding only [units of the tangent space].
  static constexpr double kTolerance = 1e-10;

  const System& system_;
  std::vector<double> slacks_;
};

}  // namespace graspatlas
