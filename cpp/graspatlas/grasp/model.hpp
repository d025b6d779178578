#pragma once

#include <memory>
#include <string>
#include <vector>

#include "graspatlas/grasp/joint_tree.hpp"
#include "graspatlas/grasp/object_joint.hpp"
#include "graspatlas/grasp/placement.hpp"

namespace graspatlas {

struct JointInfo {
  std::string name;
  int q_index, q_size, v_index, v_size;
  bool prismatic;  ///< its q is a length [m]

  /// Whether its numbers may be compared one by one: those of quaternions, whose negatives are the same, may not.
  bool comparable() const { return q_size == v_size || q_size == 2; }
};

struct FrameInfo {
  std::string name;
  int joint;            ///< joint that carries the frame; 0 is the fixed base
  Placement placement;  ///< of the frame in the joint
};

/// Hand and object as one kinematic tree; q = [hand, object] in Pinocchio's conventions.
///
/// Its source is the only file that includes Pinocchio, which defines what a model is. Where all joints of the hand
/// have one degree of freedom a JointTree computes the same, which is checked when the model is made. A model holds the
/// results of its last `update`, so it must not be shared between threads: each takes a copy.
class Model {
 public:
  /// `urdf` is the text of the hand's URDF; its root is the world. Throws Error when it cannot be read.
  Model(const std::string& urdf, const ObjectJoint& object);
  Model(const Model& other);
  ~Model();

  int q_size() const;
  int v_size() const;
  int joint_count() const { return static_cast<int>(placements_.size()); }  ///< the base, 0, included
  int hand_q_size() const { return hand_q_size_; }
  int hand_v_size() const { return hand_v_size_; }
  const ObjectJoint& object_joint() const { return object_joint_; }
  /// Joint of the tree that carries the object; -1 without one.
  int object_joint_index() const { return object_joint_index_; }
  const std::string& urdf() const { return *urdf_; }
  const std::vector<JointInfo>& hand_joints() const { return hand_joints_; }
  const std::vector<FrameInfo>& hand_frames() const { return hand_frames_; }
  std::vector<double> lower_limits() const;  ///< of the hand [hand_q_size]
  std::vector<double> upper_limits() const;
  std::vector<double> neutral() const;  ///< [q_size]
  /// True when the hand's q are plain numbers (revolute and prismatic joints), so that (+) is addition.
  bool hand_is_euclidean() const { return hand_is_euclidean_; }

  /// v in q (+) v, and q1 (-) q0: Pinocchio's integrate and difference.
  void integrate(const double* q, const double* v, double* out) const;
  void difference(const double* q0, const double* q1, double* out) const;

  /// Placements of all joints, and with `jacobians` the columns below.
  void update(const double* q, bool jacobians) { update(q, jacobians, all_joints_); }
  /// The same of some joints, see `carriers`; what others have is not to be asked for.
  void update(const double* q, bool jacobians, const std::vector<int>& joints);
  /// These joints and those that carry them, ascending, without the base.
  std::vector<int> carriers(const std::vector<int>& joints) const;
  const Placement& placement(int joint) const { return placements_[joint]; }
  /// Spatial velocity [linear at the world's origin, angular] of everything that tangent coordinate v
  /// carries.
  const double* velocity(int v) const { return &velocities_[6 * static_cast<std::size_t>(v)]; }
  /// Tangent coordinates that move a joint.
  const std::vector<int>& support(int joint) const { return supports_[joint]; }

 private:
  struct Pinocchio;

  void make_tree();
  void update_with_pinocchio(const double* q, bool jacobians);

  std::unique_ptr<Pinocchio> pinocchio_;
  std::shared_ptr<const std::string> urdf_;
  int hand_q_size_, hand_v_size_, object_joint_index_ = -1;
  ObjectJoint object_joint_;
  bool hand_is_euclidean_ = true;
  std::vector<JointInfo> hand_joints_;
  std::vector<FrameInfo> hand_frames_;
  std::vector<Placement> placements_;
  std::vector<double> velocities_;  // [v_size x 6]
  std::vector<std::vector<int>> supports_;
  std::vector<int> all_joints_;
  JointTree tree_;
  bool has_tree_ = false;
};

}  // namespace graspatlas
