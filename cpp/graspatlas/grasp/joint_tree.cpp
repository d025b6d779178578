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

void JointTree::place(const double* q, Placement* placements) const {
  placements[0] = Placement();
  for (std::size_t j = 0; j < joints_.size(); ++j) {
    const Joint& joint = joints_[j];
    const Placement& parent = placements[joint.axis.parent];
    Placement& placement = placements[j + 1];
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
  const double* const pose = q + object_q_index_;
  Placement& object = placements[joints_.size() + 1];
  if (object_.kind() == ObjectJoint::Kind::free_flyer) {
    object.rotation = Eigen::Map<const Eigen::Quaterniond>(pose + 3).toRotationMatrix();
    object.translation = Eigen::Map<const Eigen::Vector3d>(pose);
  } else if (object_.kind() == ObjectJoint::Kind::planar) {
    object.rotation << pose[2], -pose[3], 0.0, pose[3], pose[2], 0.0, 0.0, 0.0, 1.0;
    object.translation << pose[0], pose[1], 0.0;
  }
}

void JointTree::move(const Placement* placements, double* velocities) const {
  for (std::size_t j = 0; j < joints_.size(); ++j, velocities += 6) {
    const AxisJoint& joint = joints_[j].axis;
    const Eigen::Vector3d axis = placements[joint.parent].rotation * joint.axis;
    if (joint.turns)
      turn(axis, placements[j + 1].translation, velocities);
    else
      slide(axis, velocities);
  }
  if (object_.kind() == ObjectJoint::Kind::none) return;
  const Placement& object = placements[joints_.size() + 1];
  for (int i = 0; i < object_.lengths(); ++i, velocities += 6) slide(object.rotation.col(i), velocities);
  for (int i = object_.lengths(); i < object_.dof(); ++i, velocities += 6)
    turn(object.rotation.col(i - object_.dof() + 3), object.translation, velocities);
}

}  // namespace graspatlas
