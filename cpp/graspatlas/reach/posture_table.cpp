#include "graspatlas/reach/posture_table.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "graspatlas/errors.hpp"
#include "graspatlas/random.hpp"

namespace graspatlas {

namespace {

/// Position by a length, and quaternion.
Eigen::Array<float, 7, 1> numbers_of(const Placement& frame, double length) {
  Eigen::Array<float, 7, 1> out;
  out << (frame.translation / length).cast<float>().array(),
      Eigen::Quaterniond(frame.rotation).coeffs().cast<float>().array();
  return out;
}

/// An end of what is drawn of a joint's range: one turn about 0, or as near to it as the limits let.
std::pair<double, double> drawn_range(const InverseKinematics::Axis& axis) {
  if (axis.turns_round || axis.upper - axis.lower <= 2.0 * M_PI)
    return axis.turns_round ? std::pair(-M_PI, M_PI) : std::pair(axis.lower, axis.upper);
  const double middle = std::clamp(0.0, axis.lower + M_PI, axis.upper - M_PI);
  return {middle - M_PI, middle + M_PI};
}

}  // namespace

PostureTable::PostureTable(InverseKinematics& arm, int count) : length_(arm.length()) {
  if (count < 1) throw Error("a table needs a posture, got " + std::to_string(count));
  const std::vector<double> neutral = arm.model().neutral();
  postures_.resize(arm.model().q_size(), count);
  frames_.resize(count, 7);
  SplitMix64 random(0);
  for (int i = 0; i < count; ++i) {
    auto q = postures_.col(i);
    q = Eigen::Map<const Eigen::VectorXd>(neutral.data(), q.size());
    for (const InverseKinematics::Axis& axis : arm.axes()) {
      const auto [low, high] = drawn_range(axis);
      const double drawn = low + random.uniform() * (high - low);
      q[axis.q] = axis.turns_round ? std::cos(drawn) : drawn;
      if (axis.turns_round) q[axis.q + 1] = std::sin(drawn);
    }
    frames_.row(i) = numbers_of(arm.place(q.data()), length_).transpose();
  }
}

void PostureTable::nearest(const Placement& target, int most, std::vector<int>& out) const {
  // Squared distance of the positions, and 8 (1 - |cos(angle / 2)|), about the square of the angle.
  const Eigen::Array<float, 7, 1> to = numbers_of(target, length_);
  thread_local Eigen::ArrayXf squared;
  squared =
      (frames_.col(0) - to[0]).square() + (frames_.col(1) - to[1]).square() + (frames_.col(2) - to[2]).square() +
      8.0f *
          (1.0f -
           (frames_.col(3) * to[3] + frames_.col(4) * to[4] + frames_.col(5) * to[5] + frames_.col(6) * to[6]).abs());
  const auto nearer = [](int a, int b) { return squared[a] < squared[b] || (squared[a] == squared[b] && a < b); };
  out.clear();
  for (int i = 0; i < count(); ++i) {  // a heap of the nearest so far, the farthest of them on top
    const bool full = static_cast<int>(out.size()) == most;
    if (full && !nearer(i, out.front())) continue;
    if (full) {
      std::pop_heap(out.begin(), out.end(), nearer);
      out.pop_back();
    }
    out.push_back(i);
    std::push_heap(out.begin(), out.end(), nearer);
  }
  std::sort_heap(out.begin(), out.end(), nearer);
}

}  // namespace graspatlas
