#include "graspatlas/grasp/joint_tree.hpp"

#include <Eigen/Geometry>
#include <cmath>

namespace graspatlas {

namespace {

Eigen::Matrix3d cross_product_matrix(const Eigen::Vector3d& a) {
  Eigen::Matrix3d m;
  m << 0.0, -a.z(), a.y(), a.z(), 0.0, -a.x(), -a.y(), a.x(), 0.0;
  return m;
}

void write(const Eigen::Vector3d& linear, const Eigen::Vector3d& angular, double* velocity) {
  Eigen::Map<Eigen::Matrix<double, 6, 1>> out(velocity);
  out << linear, angular;
}

// Velocities of what turns about an axis through a point, or slides along one.
void turn(const Eigen::Vector3d& axis, const Eigen::Vector3d& point, double* velocity) {
  write(point.cross(axis), axis, velocity);
}
void slide(const Eigen::Vector3d& axis, double* velocity) { write(axis, Eigen::Vector3d::Zero(), velocity); }

}  // namespace

JointTree::JointTree(const std::vector<AxisJoint>& joints, const ObjectJoint& object, int object_q_index)
    : object_(object), object_q_index_(object_q_index) {
  for (const AxisJoint& axis : joints) {
    // Rodrigues' formula: a rotation about a by q is aa' + sin(q) [a] + cos(q) (I - aa').
    const Eigen::Matrix3d along = axis.axis * axis.axis.transpose();
    const Eigen::Matrix3d &R = axis.at_zero.rotation, across = Eigen::Matrix3d::Identity() - along;
    joints_.push_back({axis, along * R, cross_product_matrix(axis.axis) * R, across * R});
  }
}

void JointTree::place(const double* q, const std::vector<int>& joints, Placement* placements) const {
  for (const int j : joints) {
    Placement& placement = placements[j];
    if (j == object_index()) {
      place_object(q + object_q_index_, placement);
      continue;
    }
    const Joint& joint = joints_[static_cast<std::size_t>(j) - 1];
    const Placement& parent = placements[joint.axis.parent];
    const double* const number = q + joint.axis.q_index;
    if (joint.axis.turns) {
      const double sine = joint.axis.unbounded ? number[1] : std::sin(*number);
      const double cosine = joint.axis.unbounded ? number[0] : std::cos(*number);
      const Eigen::Matrix3d in_parent = joint.constant + sine * joint.by_sine + cosine * joint.by_cosine;
      placement.rotation.noalias() = parent.rotation.lazyProduct(in_parent);
      placement.translation.noalias() = parent.rotation * joint.axis.at_zero.translation + parent.translation;
    } else {
      const Eigen::Vector3d in_parent = joint.axis.at_zero.translation + *number * joint.axis.axis;
      placement.rotation.noalias() = parent.rotation.lazyProduct(joint.axis.at_zero.rotation);
      placement.translation.noalias() = parent.rotation * in_parent + parent.translation;
    }
  }
}

void JointTree::place_object(const double* pose, Placement& placement) const {
  if (object_.kind() == ObjectJoint::Kind::free_flyer) {
    placement.rotation = Eigen::Map<const Eigen::Quaterniond>(pose + 3).toRotationMatrix();
    placement.translation = Eigen::Map<const Eigen::Vector3d>(pose);
  } else {
    placement.rotation << pose[2], -pose[3], 0.0, pose[3], pose[2], 0.0, 0.0, 0.0, 1.0;
    placement.translation << pose[0], pose[1], 0.0;
  }
}

void JointTree::move(const std::vector<int>& joints, const Placement* placements, double* velocities) const {
  for (const int j : joints) {
    double* const velocity = velocities + 6 * (static_cast<std::ptrdiff_t>(j) - 1);
    if (j == object_index()) {
      move_object(placements[j], velocity);
      continue;
    }
    const AxisJoint& joint = joints_[static_cast<std::size_t>(j) - 1].axis;
    const Eigen::Vector3d axis = placements[joint.parent].rotation * joint.axis;
    if (joint.turns)
      turn(axis, placements[j].translation, velocity);
    else
      slide(axis, velocity);
  }
}

void JointTree::move_object(const Placement& placement, double* velocities) const {
  const int lengths = object_.lengths(), first_axis = 3 - (object_.dof() - lengths);
  for (int i = 0; i < lengths; ++i, velocities += 6) slide(placement.rotation.col(i), velocities);
  for (int axis = first_axis; axis < 3; ++axis, velocities += 6)
    turn(placement.rotation.col(axis), placement.translation, velocities);
}

}  // namespace graspatlas
