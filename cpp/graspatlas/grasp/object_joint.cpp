#include "graspatlas/grasp/object_joint.hpp"

#include <algorithm>

#include "graspatlas/errors.hpp"
#include "graspatlas/manifold/quaternion.hpp"

namespace graspatlas {

constexpr ObjectJoint ObjectJoint::free_flyer{Kind::free_flyer, 7, 6, 3, 3, 3 + kRotationEmbedding, 5};
constexpr ObjectJoint ObjectJoint::planar{Kind::planar, 4, 3, 2, 2, 4, 3};
constexpr ObjectJoint ObjectJoint::none{Kind::none, 0, 0, 0, 3, 0, 5};

ObjectJoint ObjectJoint::from_name(const std::string& name) {
  for (const ObjectJoint& joint : {free_flyer, planar, none})
    if (name == joint.name()) return joint;
  throw Error("the object's joint is 'free_flyer', 'planar' or 'none', not '" + name + "'");
}

const char* ObjectJoint::name() const {
  return kind_ == Kind::free_flyer ? "free_flyer" : kind_ == Kind::planar ? "planar" : "none";
}

const int* ObjectJoint::contact_rows() const {
  static constexpr int kInSpace[] = {0, 1, 2, 3, 4};
  static constexpr int kInPlane[] = {0, 1, 3};
  return kind_ == Kind::planar ? kInPlane : kInSpace;
}

void ObjectJoint::embed(const double* pose, double length_scale, double* out) const {
  for (int i = 0; i < lengths_; ++i) *out++ = pose[i] / length_scale;
  if (kind_ == Kind::free_flyer)
    embed_rotation(pose + lengths_, out);
  else
    std::copy_n(pose + lengths_, q_size_ - lengths_, out);
}

void ObjectJoint::check(const double* pose) const {
  if (kind_ == Kind::free_flyer) check_quaternion(pose + lengths_);
}

void ObjectJoint::point_velocities(const Eigen::Vector3d& arm, Eigen::Ref<RowMatrix> out) const {
  for (int i = 0; i < lengths_; ++i) out.col(i) = Eigen::Vector3d::Unit(i);
  // The axes of rotation: all, in the plane that along z.
  for (int i = lengths_; i < dof_; ++i) out.col(i) = Eigen::Vector3d::Unit(i - dof_ + 3).cross(arm);
}

}  // namespace graspatlas
