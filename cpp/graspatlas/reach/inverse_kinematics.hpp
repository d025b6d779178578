#pragma once

#include <Eigen/Core>
#include <vector>

#include "graspatlas/grasp/model.hpp"
#include "graspatlas/grasp/placement.hpp"

namespace graspatlas {

/// An arm, and the frame of it that is to be brought somewhere.
struct ArmParts {
  Model model;                       ///< the arm alone, without an object; its root is the arm's base
  int joint;                         ///< joint that carries the frame
  Placement frame;                   ///< of the frame in the joint
  std::vector<double> lower, upper;  ///< limits [q_size]; infinite ones are none
};

/// Inverse kinematics of an arm by damped least squares within joint limits. Work space of one thread.
///
/// Each step solves (J J' + lambda I) y = e, dq = J' y for the error e = [position / length, rotation vector] in the
/// base's axes, damped by a share of the squared error (Sugihara, IEEE Transactions on Robotics 2011), so that it is
/// quadratic in the end. Joints stop at their limits; those that would leave them are left out of J.
class InverseKinematics {
 public:
  /// Throws Error when the frame or a limit makes no sense, or no joint moves the frame.
  explicit InverseKinematics(const ArmParts& arm);

  /// A joint on the way from the base to the frame.
  struct Axis {
    int v, q;
    bool turns_round;  ///< its cosine and sine stand in q
    bool slides;       ///< its q is a length [m]
    double lower, upper;
  };

  const Model& model() const { return model_; }
  const std::vector<Axis>& axes() const { return axes_; }
  /// A length about that of the arm, which counts as much as one radian [m].
  double length() const { return length_; }

  /// The frame at a configuration q [q_size], in the base's.
  Placement place(const double* q);
  /// True when the frame cannot get to a placement, which is farther away than the arm is long.
  bool too_far(const Placement& target) const;
  /// Moves q [q_size] until the frame is at the target, to kTolerance; false when it ends elsewhere. Joints that could
  /// be there by less than half a turn are, where their limits let them.
  bool solve(const Placement& target, double* q);

  static constexpr double kTolerance = 1e-9;  ///< [m] and [rad]

 private:
  using Vector6 = Eigen::Matrix<double, 6, 1>;

  Placement frame() const;
  Vector6 error(const Placement& at, const Placement& target) const;
  void fill_columns(const Placement& at, const double* q, const Vector6& e);
  void step(const Vector6& e, double damping, double* q);
  void unwind(double* q) const;

  Model model_;
  int joint_;
  Placement frame_;
  std::vector<Axis> axes_;
  Eigen::Vector3d shoulder_;  ///< the origin of the first joint at rest
  double longest_, length_;
  Eigen::Matrix<double, 6, Eigen::Dynamic> columns_;
};

}  // namespace graspatlas
