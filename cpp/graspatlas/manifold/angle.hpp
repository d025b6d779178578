#pragma once

#include <cmath>

namespace graspatlas {

/// The angle [rad] in [-pi, pi) that differs from `angle` by a multiple of 2 pi.
inline double wrap_angle(double angle) {
  constexpr double two_pi = 6.283185307179586476925286766559;
  if (angle >= -0.5 * two_pi && angle < 0.5 * two_pi) return angle;
  return angle - two_pi * std::floor(angle / two_pi + 0.5);
}

/// Charts on angles are smaller than this [rad], so that neighbours are less than half a turn apart.
constexpr double kLargestAngularRadius = 1.5707963267948966;

}  // namespace graspatlas
