#pragma once

#include <memory>
#include <string>
#include <vector>

#include "graspatlas/grasp/model.hpp"
#include "graspatlas/grasp/object_joint.hpp"
#include "graspatlas/grasp/patch.hpp"
#include "graspatlas/grasp/placement.hpp"
#include "graspatlas/manifold/system.hpp"
#include "graspatlas/types.hpp"

namespace graspatlas {

/// One parameter of a patch: frozen at a value, or one of the unknowns.
struct PatchParameter {
  bool free = false;
  double value = 0.0;  ///< where it is frozen [rad or m]
  bool periodic = false;
  double lower = -1.0, upper = 1.0;  ///< interval of a free parameter that is not periodic
};

/// A patch on a joint of the model.
struct ContactSide {
  int joint = 0;
  Placement frame;  ///< frame of the patch in the joint
  std::shared_ptr<const Patch> patch;
  PatchParameter u, v;
};

/// Points coincide and normals oppose, eqs (7) and (8): five equations, three in the plane.
struct Contact {
  ContactSide hand, object;
};

/// Where both sides of a contact are: in the world (the palm's frame).
struct ContactPoint {
  Eigen::Vector3d hand_point, object_point;
  Eigen::Vector3d hand_normal, object_normal;  ///< outward unit normals
};

/// What a grasp system is made of.
struct GraspParts {
  std::shared_ptr<Model> model;  ///< used by the system only
  std::vector<Contact> contacts;
  /// Hand motions that are kept [hand_v_size x p]: a column is a motion's joint velocities, of length one in the metric
  /// of the tangent space: orthonormal for revolute joints; the identity keeps them all.
  Matrix motions;
  double length_scale;  ///< [m]
  /// Limits [hand_q_size] of joints with one number each; infinite ones are none.
  std::vector<double> lower, upper;
  /// Joint velocities that the unit velocity of each actuated joint makes [hand_v_size x d], a column for each: the
  /// identity unless joints mimic others.
  Matrix transmission;
};

/// The relevant grasps R (Sections II and III): contacts, hand motions, joint limits and patch intervals.
///
/// A point is x = [q, w]: Pinocchio's configuration of hand and object, then the free patch parameters, contact by
/// contact, hand before object, u before v. A tangent vector is [y, object, w]: y are velocities along the hand motions
/// that are kept, so that eq (13), E_s' (q_hand - q_hand,1) = 0, holds by construction; lengths are divided by
/// `length_scale`. Equations: for each contact three for the points (divided by length_scale) and two for the normals;
/// in the plane two and one.
class GraspSystem : public System {
 public:
  explicit GraspSystem(GraspParts parts);

  void residual(const double* x, double* R) override;
  void linearize(const double* x, double* R, double* J) override;
  void integrate(const double* x, const double* v, double* out) const override;
  void difference(const double* x0, const double* x1, double* out) const override;
  void embed(const double* x, double* out) const override;
  void slack(const double* x, double* out) const override;
  std::string bound_name(int i) const override { return bound_names_[static_cast<std::size_t>(i)]; }
  void check_point(const double* x) const override;
  double radius_limit() const override;
  std::unique_ptr<System> clone() const override;

  /// Two grasps may differ in hand motions that are frozen, of which differences say nothing.
  bool same_point(const double* x0, const double* x1, double tolerance) const override;

  /// Of the placements that it holds only those of the contacts' joints and the object are what x has.
  const Model& model() const { return *model_; }
  int contact_count() const { return static_cast<int>(contacts_.size()); }
  int parameter_count() const { return static_cast<int>(free_parameters_.size()); }
  double length_scale() const { return length_scale_; }
  const std::vector<Contact>& contacts() const { return contacts_; }
  const RowMatrix& motions() const { return motions_; }
  const RowMatrix& transmission() const { return transmission_; }
  const std::vector<double>& lower_limits() const { return lower_limits_; }
  const std::vector<double>& upper_limits() const { return upper_limits_; }
  /// Name of each bound, in the order of `slack`.
  const std::vector<std::string>& bound_names() const { return bound_names_; }
  const ObjectJoint& object_joint() const { return object_joint_; }
  int object_dof() const { return object_joint_.dof(); }
  int actuated_count() const { return static_cast<int>(transmission_.cols()); }

  /// Contact points and normals at x [contact_count].
  void contact_points(const double* x, ContactPoint* out);
  /// The same with Gt, see below.
  void contact_points(const double* x, ContactPoint* out, Eigen::Ref<RowMatrix> Gt);
  /// J [3m x actuated_count]: velocities of the actuated joints to those of the contact points, and Gt [3m x
  /// object_dof], the grasp matrix transposed: the object's velocity (linear at its origin, then angular; world axes)
  /// to those of the points.
  void grasp_matrices(const double* x, Eigen::Ref<RowMatrix> J, Eigen::Ref<RowMatrix> Gt);
  /// Velocities of the actuated joints to angular velocities of the fingertips about the contact normals into the
  /// object [contact_count x actuated_count].
  void normal_spins(const double* x, Eigen::Ref<RowMatrix> out);

 private:
  struct Bound {
    int at;       // its number in x
    int tangent;  // the joint's number among the velocities, or the parameter's in w
    bool joint;   // else a patch parameter
    double sign, limit, scale;
  };
  struct FreeParameter {
    PatchParameter parameter;
    ParameterUnit unit;
    double scale;  // see parameter_scale
  };
  /// One side of a contact where it is.
  struct SideState {
    PatchPoint local;
    Eigen::Matrix3d rotation;
    Eigen::Vector3d point;
  };
  /// In the world: the object's normal, and the hand's tangents.
  struct ContactAxes {
    Eigen::Vector3d m, a, b;
  };
  /// What turns velocities into those of a contact's entries: the side's point, and hand tangents times the normal.
  struct ContactArms {
    const Eigen::Vector3d &point, &a_cross_m, &b_cross_m;
  };
  /// Derivatives of a patch's point, normal and tangents by one of its parameters, in the patch's frame.
  struct PatchDerivative {
    const Eigen::Vector3d &o, &m, &a, &b;
  };

  static PatchDerivative by_u(const PatchPoint& p) { return {p.o_u, p.m_u, p.a_u, p.b_u}; }
  static PatchDerivative by_v(const PatchPoint& p) { return {p.o_v, p.m_v, p.a_v, p.b_v}; }

  void check_parts() const;
  void collect_free_parameters();
  void add_joint_bounds();
  void add_parameter_bounds();
  RowMatrix normals_of_bounds() const;

  template <class Visit>
  void visit_contacts(const double* x, bool velocities, Visit visit);
  void place_side(const ContactSide& side, const double*& w, SideState& out) const;
  ContactAxes contact_axes(const SideState& hand, const SideState& object) const;
  void write_equations(const SideState& hand, const SideState& object, const ContactAxes& axes, double*& R) const;
  void add_velocity_column(const double* velocity, double scale, const ContactArms& arms, double* J) const;
  void add_velocity_columns(int joint, double sign, const ContactArms& arms, double* J);
  int write_parameter_columns(const Contact& contact, const SideState& hand, const SideState& object,
                              const ContactAxes& axes, double* J) const;
  void write_hand_column(const SideState& hand, const ContactAxes& axes, const PatchDerivative& by, ParameterUnit unit,
                         double* J) const;
  void write_object_column(const SideState& object, const ContactAxes& axes, const PatchDerivative& by,
                           ParameterUnit unit, double* J) const;
  void write_column(const double* entries, double* J) const;
  void along_motions(const double* y, double* velocity) const;
  void on_motions(const double* velocity, double* y) const;

  // How much a number of q or a parameter changes when its tangent coordinate changes by one.
  double object_scale(int i) const { return i < object_joint_.lengths() ? length_scale_ : 1.0; }
  double parameter_scale(ParameterUnit unit) const { return unit == ParameterUnit::length ? length_scale_ : 1.0; }

  std::shared_ptr<Model> model_;
  std::vector<Contact> contacts_;
  std::vector<int> placed_;           // joints of the contacts and of the object, and those that carry them
  RowMatrix motions_;                 // columns are the hand motions kept, in joint velocities
  RowMatrix motions_pseudo_inverse_;  // joint velocities to those along the motions
  RowMatrix transmission_;            // columns are the joint velocities that each actuated joint makes
  bool all_motions_;
  int motion_count_;
  ObjectJoint object_joint_;
  int rows_per_contact_;
  const int* rows_;  // of the entries of a contact, those that are equations
  double length_scale_;
  std::vector<double> twists_;  // velocities of a joint along each motion kept [motion_count x 6]
  std::vector<double> lower_limits_, upper_limits_;
  std::vector<FreeParameter> free_parameters_;
  std::vector<Bound> bounds_;
  std::vector<std::string> bound_names_;
};

}  // namespace graspatlas
