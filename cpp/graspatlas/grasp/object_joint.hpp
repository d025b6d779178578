#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <string>

#include "graspatlas/types.hpp"

namespace graspatlas {

/// How the object moves: freely in space, in the palm's x-y plane, or there is no object.
///
/// A pose is Pinocchio's configuration of the joint: a position, then a quaternion (x, y, z, w), in the plane the
/// cosine and the sine of an angle. Its velocity is linear, then angular. What a contact constrains depends on the
/// joint too.
class ObjectJoint {
 public:
  enum class Kind : std::uint8_t { free_flyer, planar, none };
  static const ObjectJoint free_flyer, planar, none;

  /// By its name in Python: 'free_flyer', 'planar' or 'none'. Throws Error for any other.
  static ObjectJoint from_name(const std::string& name);
  const char* name() const;
  Kind kind() const { return kind_; }

  int q_size() const { return q_size_; }    ///< numbers in a pose
  int dof() const { return dof_; }          ///< numbers in a velocity
  int lengths() const { return lengths_; }  ///< of both, the first so many are lengths
  /// Dimensions of the space of positions and forces: 3, in the plane 2.
  int space_dimension() const { return space_dimension_; }
  int embedding_size() const { return embedding_size_; }

  /// Entries of a contact: the three coordinates of the vector between the points, and the hand's two tangents on the
  /// object's normal. `contact_rows` names those that are equations: in the plane the z coordinate and the tangent
  /// along z vanish.
  static constexpr int kContactEntries = 5;
  int equations_per_contact() const { return equations_per_contact_; }
  const int* contact_rows() const;

  /// The hand's first tangent of a contact in the world, from the hand patch's rotation, first tangent and normal, or
  /// its derivative from theirs: in the plane it is the one in the plane.
  Eigen::Vector3d first_tangent(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& a,
                                const Eigen::Vector3d& normal) const {
    if (kind_ != Kind::planar) return rotation * a;
    return Eigen::Vector3d::UnitZ().cross(rotation * normal);
  }

  /// A pose as a point of Euclidean space [embedding_size], see System::embed; lengths are divided by `length_scale`.
  void embed(const double* pose, double length_scale, double* out) const;

  /// Throws Error unless the numbers are a pose.
  void check(const double* pose) const;

  /// Velocity of a point that the object carries, at `arm` from its origin, for each of the object's velocities (linear
  /// at its origin, then angular; world axes): out [3 x dof].
  void point_velocities(const Eigen::Vector3d& arm, Eigen::Ref<RowMatrix> out) const;

  bool operator==(const ObjectJoint& other) const { return kind_ == other.kind_; }

 private:
  constexpr ObjectJoint(Kind kind, int q_size, int dof, int lengths, int space_dimension, int embedding_size,
                        int equations_per_contact)
      : kind_(kind),
        q_size_(q_size),
        dof_(dof),
        lengths_(lengths),
        space_dimension_(space_dimension),
        embedding_size_(embedding_size),
        equations_per_contact_(equations_per_contact) {}

  Kind kind_;
  int q_size_, dof_, lengths_, space_dimension_, embedding_size_, equations_per_contact_;
};

}  // namespace graspatlas
