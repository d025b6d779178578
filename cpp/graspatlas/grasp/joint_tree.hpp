#pragma once

#include <Eigen/Core>
#include <vector>

#include "graspatlas/grasp/object_joint.hpp"
#include "graspatlas/grasp/placement.hpp"

namespace graspatlas {

/// A joint with one degree of freedom: what it carries turns about an axis, or slides along it.
struct AxisJoint {
  int parent;            ///< the joint that carries it; 0 is the fixed base
  bool turns;            ///< else it slides
  int q_index;           ///< of its angle [rad] or length [m]
  bool unbounded;        ///< its angle is given by cosine and sine, from q_index on
  Placement at_zero;     ///< in the parent, where its number is zero
  Eigen::Vector3d axis;  ///< unit vector in the parent
};

/// Placements and velocities of a hand's joints, all with one degree of freedom, and of an object that it does not
/// carry: what Pinocchio computes for joints of all kinds, and Model compares with it.
class JointTree {
 public:
  JointTree() = default;
  /// Joint j of the hand is joints[j - 1], its velocity the number j - 1; parents come first. The object is the last
  /// joint, its pose and velocity the last numbers.
  JointTree(const std::vector<AxisJoint>& joints, const ObjectJoint& object, int object_q_index);

  /// Placements of some joints at q, each after those that carry it.
  void place(const double* q, const std::vector<int>& joints, Placement* placements) const;
  /// Their velocities [v_size x 6], see Model::velocity, where the placements are these.
  void move(const std::vector<int>& joints, const Placement* placements, double* velocities) const;

 private:
  struct Joint {
    AxisJoint axis;
    // The rotation in the parent is the first of these, plus the sine times the second, plus the cosine times the
    // third.
    Eigen::Matrix3d constant, by_sine, by_cosine;
  };

  void place_object(const double* pose, Placement& placement) const;
  void move_object(const Placement& placement, double* velocities) const;
  int object_index() const { return static_cast<int>(joints_.size()) + 1; }

  std::vector<Joint> joints_;
  ObjectJoint object_ = ObjectJoint::none;
  int object_q_index_ = 0;
};

}  // namespace graspatlas
