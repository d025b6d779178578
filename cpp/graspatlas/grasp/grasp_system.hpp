#pragma once

#include <memory>
#include <string>
#include <vector>

#include "graspatlas/continuation/system.hpp"
#include "graspatlas/grasp/model.hpp"
#include "graspatlas/grasp/patch.hpp"

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

/// The relevant grasps R (Sections II and III): contacts, hand motions, joint limits and patch intervals.
///
/// A point is x = [q, w]: Pinocchio's configuration of hand and object, then the free patch parameters, contact by
/// contact, hand before object, u before v. A tangent vector is [y, object, w]: y are velocities along the hand motions
/// that are kept, so that eq (13), E_s' (q_hand - q_hand,1) = 0, holds by construction; lengths are divided by
/// `length_scale`. Equations: for each contact three for the points (divided by length_scale) and two for the normals;
/// in the plane two and one.
class GraspSystem : public System {
 public:
  /// Columns of `motions` [hand_v_size x p] are the joint velocities of the hand motions kept, each of length one in
  /// the metric of the tangent space: orthonormal for revolute joints; the identity keeps them all. Limits
  /// [hand_q_size] apply to joints with one number each; infinite ones are none. Columns of `drives`
  /// [hand_v_size x d] are the joint velocities that the unit velocity of each driven joint makes: the identity unless
  /// joints mimic others. The model is used by this system only.
  GraspSystem(std::shared_ptr<Model> model, std::vector<Contact> contacts, const Matrix& motions, double length_scale,
              const std::vector<double>& lower, const std::vector<double>& upper, const Matrix& drives);

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

  const Model& model() const { return *model_; }
  int contact_count() const { return static_cast<int>(contacts_.size()); }
  int parameter_count() const { return static_cast<int>(parameters_.size()); }
  double length_scale() const { return length_scale_; }
  const std::vector<Contact>& contacts() const { return contacts_; }
  const RowMatrix& motions() const { return motions_; }
  const RowMatrix& drives() const { return drives_; }
  const std::vector<double>& lower_limits() const { return lower_limits_; }
  const std::vector<double>& upper_limits() const { return upper_limits_; }
  /// Name of each bound, in the order of `slack`.
  const std::vector<std::string>& bound_names() const { return bound_names_; }

  /// Contact points and normals at x [contact_count].
  void contact_points(const double* x, ContactPoint* out);
  /// J [3m x drive_count]: velocities of the driven joints to those of the contact points, and Gt [3m x object dof],
  /// the grasp matrix transposed: the object's velocity (linear at its origin, then angular; world axes) to
  /// those of the points.
  void grasp_matrices(const double* x, Eigen::Ref<RowMatrix> J, Eigen::Ref<RowMatrix> Gt);
  int object_dof() const;
  int drive_count() const { return static_cast<int>(drives_.cols()); }

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
  };
  struct SideState {
    PatchPoint local;
    Eigen::Matrix3d rotation;
    Eigen::Vector3d point;
  };

  static int count_free(const std::vector<Contact>& contacts);
  static int embedding_size(const Model& model, const std::vector<Contact>& contacts, int motions);
  void add_joint_bounds(const std::vector<double>& lower, const std::vector<double>& upper);
  void add_parameter_bounds();
  void place_side(const ContactSide& side, const double*& w, SideState& out) const;
  void contact_entries(const SideState& hand, const SideState& object, double* entries) const;
  Eigen::Vector3d first_tangent(const SideState& hand, const Eigen::Vector3d& a, const Eigen::Vector3d& normal) const;
  void add_column(int v, double sign, const Eigen::Vector3d& point, const Eigen::Vector3d& a_cross_m,
                  const Eigen::Vector3d& b_cross_m, double* J) const;

  std::shared_ptr<Model> model_;
  std::vector<Contact> contacts_;
  RowMatrix motions_;      // columns are the hand motions kept, in joint velocities
  RowMatrix coordinates_;  // its pseudo-inverse, transposed: joint velocities along the motions
  RowMatrix drives_;       // columns are the joint velocities that each driven joint makes
  bool all_motions_;
  int motion_count_, object_v_size_, rows_per_contact_;
  const int* rows_;  // of the entries of a contact, those that are equations
  double length_scale_;
  std::vector<double> lower_limits_, upper_limits_;
  std::vector<FreeParameter> parameters_;
  std::vector<Bound> bounds_;
  std::vector<std::string> bound_names_;
};

}  // namespace graspatlas
