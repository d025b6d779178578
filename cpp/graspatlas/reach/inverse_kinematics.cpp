#include "graspatlas/reach/inverse_kinematics.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "graspatlas/errors.hpp"

namespace graspatlas {

namespace {

using Vector3 = Eigen::Vector3d;

/// Steps after which a start is given up.
constexpr int kMostSteps = 40;
/// A start is also given up when the squared error has not fallen to this share of its least in so many steps.
constexpr double kProgress = 0.5;
constexpr int kPatience = 4;
/// Damping as a share of the squared error, and the least of it: J has entries of about one.
constexpr double kDamping = 0.1, kLeastDamping = 1e-12;
/// No joint moves farther in one step [rad, or metres by the arm's length].
constexpr double kLongestStep = 1.0;
/// What rounding may add to the length of an arm [m].
constexpr double kRounding = 1e-9;

/// The rotation vector of a rotation, of length pi at most.
Vector3 rotation_vector(const Eigen::Matrix3d& rotation) {
  Eigen::Quaterniond turn(rotation);
  if (turn.w() < 0.0) turn.coeffs() = -turn.coeffs();
  const double sine = turn.vec().norm();
  return sine > 0.0 ? Vector3(2.0 * std::atan2(sine, turn.w()) / sine * turn.vec()) : Vector3::Zero();
}

}  // namespace

InverseKinematics::InverseKinematics(const ArmParts& arm) : model_(arm.model), joint_(arm.joint), frame_(arm.frame) {
  if (joint_ < 1 || joint_ >= model_.joint_count())
    throw Error("the frame sits on joint " + std::to_string(joint_) + ", but an arm's joints are 1 to " +
                std::to_string(model_.joint_count() - 1));
  const auto size = static_cast<std::size_t>(model_.q_size());
  if (arm.lower.size() != size || arm.upper.size() != size)
    throw Error("the limits must be " + std::to_string(size) + " numbers each");
  model_.update(model_.neutral().data(), true);
  // Distances of the origins of joints one after the other stay what they are; those that slide add their range.
  Vector3 last = Vector3::Zero();
  longest_ = 0.0;
  const std::vector<JointInfo>& joints = model_.hand_joints();
  for (const int v : model_.support(joint_)) {
    const auto found =
        std::find_if(joints.begin(), joints.end(), [v](const JointInfo& joint) { return joint.v_index == v; });
    if (found == joints.end() || found->v_size != 1)
      throw Error("an arm's joints must turn about or slide along one axis each");
    const auto q = static_cast<std::size_t>(found->q_index);
    const bool turns_round = found->q_size == 2;
    if (!turns_round && !(arm.lower[q] < arm.upper[q])) throw Error("joint '" + found->name + "' has no range");
    if (found->prismatic && !std::isfinite(arm.upper[q] - arm.lower[q]))
      throw Error("joint '" + found->name + "' slides without limits");
    const Vector3 origin = model_.placement(static_cast<int>(found - joints.begin()) + 1).translation;
    if (axes_.empty())
      shoulder_ = origin;
    else
      longest_ += (origin - last).norm();
    if (found->prismatic) longest_ += std::max(std::abs(arm.lower[q]), std::abs(arm.upper[q]));
    last = origin;
    axes_.push_back({v, found->q_index, turns_round, found->prismatic, arm.lower[q], arm.upper[q]});
  }
  longest_ += frame_.translation.norm();
  length_ = std::max(0.5 * longest_, 1e-3);
  columns_.resize(6, static_cast<Eigen::Index>(axes_.size()));
}

Placement InverseKinematics::frame() const {
  const Placement& joint = model_.placement(joint_);
  return {joint.rotation * frame_.rotation, joint.translation + joint.rotation * frame_.translation};
}

Placement InverseKinematics::place(const double* q) {
  model_.update(q, false);
  return frame();
}

bool InverseKinematics::too_far(const Placement& target) const {
  return (target.translation - shoulder_).norm() > longest_ + kRounding;
}

InverseKinematics::Vector6 InverseKinematics::error(const Placement& at, const Placement& target) const {
  Vector6 e;
  e << (target.translation - at.translation) / length_, rotation_vector(target.rotation * at.rotation.transpose());
  return e;
}

/// Velocities of the frame by those of the joints that are free to move down the error's slope.
void InverseKinematics::fill_columns(const Placement& at, const double* q, const Vector6& e) {
  for (std::size_t i = 0; i < axes_.size(); ++i) {
    const Axis& axis = axes_[i];
    const Eigen::Map<const Vector6> velocity(model_.velocity(axis.v));
    auto column = columns_.col(static_cast<Eigen::Index>(i));
    const Vector3 turn = velocity.tail<3>();
    column.head<3>() = (velocity.head<3>() + turn.cross(at.translation)) / length_;
    column.tail<3>() = turn;
    if (axis.turns_round) continue;
    const double slope = column.dot(e);
    if ((q[axis.q] <= axis.lower && slope < 0.0) || (q[axis.q] >= axis.upper && slope > 0.0)) column.setZero();
  }
}

void InverseKinematics::step(const Vector6& e, double damping, double* q) {
  Eigen::Matrix<double, 6, 6> A;
  A.noalias() = columns_.lazyProduct(columns_.transpose());
  A.diagonal().array() += damping;
  const Vector6 y = A.llt().solve(e);
  double largest = 0.0;
  for (Eigen::Index i = 0; i < columns_.cols(); ++i) largest = std::max(largest, std::abs(columns_.col(i).dot(y)));
  const double share = largest > kLongestStep ? kLongestStep / largest : 1.0;
  for (std::size_t i = 0; i < axes_.size(); ++i) {
    const Axis& axis = axes_[i];
    const double by = share * columns_.col(static_cast<Eigen::Index>(i)).dot(y);
    double* at = q + axis.q;
    if (axis.turns_round) {
      const double angle = std::atan2(at[1], at[0]) + by;
      at[0] = std::cos(angle);
      at[1] = std::sin(angle);
    } else {
      *at = std::clamp(*at + by, axis.lower, axis.upper);
    }
  }
}

/// Takes whole turns off the joints, which changes nothing else.
void InverseKinematics::unwind(double* q) const {
  constexpr double kTurn = 2.0 * M_PI;
  for (const Axis& axis : axes_) {
    if (axis.turns_round || axis.slides) continue;
    double& at = q[axis.q];
    while (at > M_PI && at - kTurn >= axis.lower) at -= kTurn;
    while (at < -M_PI && at + kTurn <= axis.upper) at += kTurn;
  }
}

bool InverseKinematics::solve(const Placement& target, double* q) {
  double least = std::numeric_limits<double>::infinity();
  for (int steps = 0, idle = 0; steps < kMostSteps && idle < kPatience; ++steps) {
    model_.update(q, true);
    const Placement at = frame();
    const Vector6 e = error(at, target);
    if (e.head<3>().norm() * length_ < kTolerance && e.tail<3>().norm() < kTolerance) {
      unwind(q);
      return true;
    }
    const double squared = e.squaredNorm();
    if (!std::isfinite(squared)) return false;
    idle = squared < kProgress * least ? 0 : idle + 1;
    least = std::min(least, squared);
    fill_columns(at, q, e);
    step(e, kDamping * squared + kLeastDamping, q);
  }
  return false;
}

}  // namespace graspatlas
