#pragma once

#include <Eigen/Cholesky>
#include <Eigen/QR>

#include "graspatlas/grasp/grasp_system.hpp"
#include "graspatlas/types.hpp"

namespace graspatlas {

/// Force closure of grasps: contact forces f_i within friction cones, G mapping them to the wrench.
///
/// A grasp is force-closed when G has full rank and some internal forces, G f = 0, lie strictly inside all cones. The
/// margin says how strictly: with normal forces that add up to one,
///
///   margin = max over f of  min over i of  (mu n_i . f_i - |f_i - (n_i . f_i) n_i|) / sqrt(1 + mu^2),
///
/// the distance from the nearest cone's surface. It is a small second-order cone programme in the null space of G,
/// which a barrier method solves with the cones as they are, not as pyramids. Where all internal forces leave their
/// cones the same maximum is negative, and says how far the best of them are outside.
///
/// Soft fingers also resist being turned about the normal, by a torque tau_i with the friction limit surface
///
///   |f_i - (n_i . f_i) n_i|^2 / mu^2 + tau_i^2 / gamma^2 <= (n_i . f_i)^2,
///
/// an ellipsoid. With mu tau_i / gamma as one more component of the contact force it is the same round cone, of a
/// dimension more; so the margin is that above. A torsional friction gamma of 0 is a hard finger.
class ForceClosure {
 public:
  /// Contact forces on the object, and the torques at the actuated joints with which the fingers exert them.
  struct Forces {
    RowMatrix forces;      // contacts x 3: world axes
    Vector torques;        // contacts: of soft fingers, about the normals into the object
    Vector joint_torques;  // actuated joints; forces where they slide
  };

  /// `friction` is mu > 0, `torsional` is gamma >= 0 [m]; in the plane nothing turns about a normal.
  ForceClosure(GraspSystem& system, double friction, double torsional);

  /// The margin at x; zero when the grasp is not force-closed.
  double margin(const double* x);

  /// The margin at x with its sign; minus infinity when G has lost rank or internal forces cannot press at all.
  double slack(const double* x);

  /// The forces that attain the margin, by which they balance a load: G f + load = 0, normal forces adding up to one.
  ///
  /// `load` is a wrench on the object at its origin, world axes [object_dof], or null for none. Returns the margin;
  /// where that is not positive no forces inside the cones balance the load, and `out` holds NaN. Joint torques are
  /// those of statics, without the weight of the hand.
  double forces(const double* x, const double* load, Forces& out);

  /// Some internal forces strictly inside the cones, normal forces adding up to one; false without force closure. It
  /// stops as soon as it has them. What follows is of the grasp asked for last.
  bool closes(const double* x, Forces& out);

  /// After `slack` or `margin` at x: the multipliers of the programme there, for `lagrangian`.
  void keep_multipliers();

  /// The Lagrangian of the programme of a grasp nearby, with the forces and multipliers kept: at x its value is the
  /// margin, and its slope there that of the margin.
  double lagrangian(const double* x);

  const RowMatrix& J() const { return J_; }  ///< [3 contacts x actuated joints]
  const std::vector<ContactPoint>& points() const { return points_; }

 private:
  enum class Aim { signed_margin, margin, inside };
  using Force = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 4, 1>;  // see force_size_

  /// |tangential z + tangential_0| <= axial . z + axial_0: a cone as a function of the unknowns z = (c, t).
  struct Cone {
    Matrix tangential;
    Force tangential_0;
    Vector axial;
    double axial_0;

    double evaluate(const Vector& z, Force& tangent, double& along) const;
  };

  bool balancing_forces(const double* x, const double* load = nullptr);
  void set_cones();
  double widest_margin(Aim aim);
  double write_forces(const double* x, double margin, Forces& out);
  double barrier(const Vector& z, double weight) const;
  bool newton_step(double weight);
  double newton_direction(double weight);

  GraspSystem& system_;
  double friction_, torsional_;
  int directions_;  // of a contact force: three, in the plane two
  int force_size_;  // its components: these, and of soft fingers the torque about the normal times mu / gamma
  RowMatrix J_, Gt_, spins_;
  Matrix normals_;     // force_size x contacts: into the object
  Matrix basis_;       // of the internal forces with no total normal force, one a column
  Vector particular_;  // forces with total normal force one that balance the load; without one they are internal
  std::vector<ContactPoint> points_;

  // For `lagrangian`: the last weight of the barrier, what the columns of the equations were divided by, the forces,
  // and the multipliers of cones and equations.
  double weight_ = 1.0;
  Vector norms_, forces_, cone_axial_, equation_multipliers_;
  Matrix cone_tangential_;

  // Room to work in, the same for all grasps.
  Matrix equations_, Q_;
  Eigen::ColPivHouseholderQR<Matrix> qr_;
  std::vector<Cone> cones_;
  Vector z_, next_, gradient_, step_, slope_;
  Matrix hessian_;
  Eigen::LDLT<Matrix> factor_;
};

}  // namespace graspatlas
