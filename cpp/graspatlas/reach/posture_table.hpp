#pragma once

#include <Eigen/Core>
#include <vector>

#include "graspatlas/reach/inverse_kinematics.hpp"

namespace graspatlas {

/// Random postures of an arm and where its frame is in each: from those with the frame nearest to a target inverse
/// kinematics starts. It does not change once it is made.
class PostureTable {
 public:
  /// `count` postures, drawn evenly within the joint limits: of joints that can turn more than once round, within one
  /// turn. The same ones each time.
  PostureTable(InverseKinematics& arm, int count);

  int count() const { return static_cast<int>(postures_.cols()); }
  /// A posture [q_size].
  const double* posture(int i) const { return postures_.col(i).data(); }
  /// Numbers of the `most` postures with the frame nearest to a target, the nearest first.
  void nearest(const Placement& target, int most, std::vector<int>& out) const;

 private:
  double length_;
  Eigen::MatrixXd postures_;  // [q_size x count]
  Eigen::ArrayXXf frames_;    // [count x 7]: position / length, quaternion
};

}  // namespace graspatlas
