#include "graspatlas/quality/force_closure.hpp"

#include <algorithm>
#include <cmath>

#include "graspatlas/errors.hpp"

namespace graspatlas {

namespace {

constexpr double kRankTolerance = 1e-9;
constexpr double kGap = 1e-10;     // the margin is found to within this
constexpr double kGrowth = 12.0;   // of the barrier's weight from one centring to the next
constexpr double kCentred = 1e-8;  // squared Newton decrement at which a centring ends
constexpr int kMaxNewtonSteps = 200;
constexpr int kPolishing = 2;  // more steps, so that multipliers are as exact as the margin
constexpr double kStartMargin =
    -1.0;  // a barrier starts this far outside the cones, so that it is inside all of its own

}  // namespace

ForceClosure::ForceClosure(GraspSystem& system, double friction, double torsional)
    : system_(system),
      friction_(friction),
      torsional_(torsional),
      directions_(system.object_joint().space_dimension()),
      force_size_(directions_ + (directions_ == 3 && torsional > 0.0 ? 1 : 0)),
      points_(system.contact_count()),
      cones_(system.contact_count()) {
  if (system.object_dof() == 0 || system.contact_count() == 0)
    throw Error("force closure needs an object and at least one contact");
  if (!(friction > 0.0) || !std::isfinite(friction)) throw Error("friction must be positive, got " + to_text(friction));
  if (!(torsional >= 0.0) || !std::isfinite(torsional))
    throw Error("torsional friction must not be negative, got " + to_text(torsional));
  J_.resize(3 * system.contact_count(), system.actuated_count());
  Gt_.resize(3 * system.contact_count(), system.object_dof());
  spins_.resize(system.contact_count(), system.actuated_count());
  normals_.setZero(force_size_, system.contact_count());
}

double ForceClosure::margin(const double* x) {
  return balancing_forces(x) ? std::max(widest_margin(Aim::margin), 0.0) : 0.0;
}

double ForceClosure::slack(const double* x) {
  return balancing_forces(x) ? widest_margin(Aim::signed_margin) : -HUGE_VAL;
}

double ForceClosure::forces(const double* x, const double* load, Forces& out) {
  return write_forces(x, balancing_forces(x, load) ? widest_margin(Aim::margin) : 0.0, out);
}

bool ForceClosure::closes(const double* x, Forces& out) {
  return write_forces(x, balancing_forces(x) ? widest_margin(Aim::inside) : 0.0, out) > 0.0;
}

// The forces of the last z_, or NaN where their margin is not positive; returns the margin, or 0.
double ForceClosure::write_forces(const double* x, double margin, Forces& out) {
  const int contacts = system_.contact_count();
  out.forces.setConstant(contacts, 3, std::nan(""));
  out.torques.setConstant(contacts, std::nan(""));
  out.joint_torques.setConstant(system_.actuated_count(), std::nan(""));
  if (!(margin > 0.0)) return 0.0;
  particular_.noalias() += basis_ * z_.head(basis_.cols());
  out.forces.setZero();
  out.torques.setZero();
  for (int c = 0; c < contacts; ++c) {
    const auto f = particular_.segment(static_cast<Eigen::Index>(c) * force_size_, force_size_);
    out.forces.row(c).head(directions_) = f.head(directions_).transpose();
    if (force_size_ > directions_) out.torques(c) = (torsional_ / friction_) * f(directions_);
  }
  const Eigen::Map<const Vector> stacked(out.forces.data(), out.forces.size());
  out.joint_torques.noalias() = J_.transpose() * stacked;
  if (force_size_ > directions_) {
    system_.normal_spins(x, spins_);
    out.joint_torques.noalias() += spins_.transpose() * out.torques;
  }
  return margin;
}

// Solves [G; n'] f = [-load; 1] by a QR factorisation of the transpose; false when G or the whole has lost rank.
bool ForceClosure::balancing_forces(const double* x, const double* load) {
  system_.grasp_matrices(x, J_, Gt_);
  system_.contact_points(x, points_.data());
  norms_.setOnes(system_.object_dof() + 1);
  const int contacts = system_.contact_count(), dof = system_.object_dof();
  for (int c = 0; c < contacts; ++c) normals_.col(c).head(directions_) = -points_[c].object_normal.head(directions_);
  const Eigen::Index forces = static_cast<Eigen::Index>(contacts) * force_size_;
  if (forces < dof + 1) return false;
  equations_.resize(forces, dof + 1);
  for (int c = 0; c < contacts; ++c) {
    equations_.block(c * force_size_, 0, directions_, dof) = Gt_.block(3 * c, 0, directions_, dof);
    if (force_size_ > directions_) {
      auto turning = equations_.row(c * force_size_ + directions_);
      turning.setZero();
      turning.segment<3>(3) = (torsional_ / friction_) * normals_.col(c).head<3>().transpose();
    }
    equations_.block(c * force_size_, dof, force_size_, 1) = normals_.col(c);
  }
  // Torques in units of the grasp's size, so that one tolerance serves all rows.
  Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 7, 1> right = Vector::Unit(dof + 1, dof);
  for (int column = 0; column <= dof; ++column) {
    const double norm = equations_.col(column).norm();
    if (!(norm > 0.0)) return false;
    if (column == dof) continue;
    norms_(column) = norm;
    equations_.col(column) /= norm;
    if (load) right(column) = -load[column] / norm;
  }
  qr_.compute(equations_);
  const auto& R = qr_.matrixR();
  for (int i = 0; i <= dof; ++i)
    if (!(std::abs(R(i, i)) > kRankTolerance * std::abs(R(0, 0)))) return false;
  Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 7, 1> y = qr_.colsPermutation().transpose() * right;
  R.topLeftCorner(dof + 1, dof + 1).triangularView<Eigen::Upper>().transpose().solveInPlace(y);
  Q_.setIdentity(forces, forces);
  Q_.applyOnTheLeft(qr_.householderQ());
  particular_.noalias() = Q_.leftCols(dof + 1) * y;
  basis_ = Q_.rightCols(forces - dof - 1);
  return true;
}

// The cones in terms of z = (c, t), f = particular + basis c; and a z inside all of them.
void ForceClosure::set_cones() {
  const Eigen::Index unknowns = basis_.cols() + 1;
  const double spread = std::sqrt(1.0 + friction_ * friction_);
  double outside = 0.0;
  for (std::size_t c = 0; c < cones_.size(); ++c) {
    const auto n = normals_.col(static_cast<Eigen::Index>(c));
    const auto along = basis_.middleRows(static_cast<Eigen::Index>(c) * force_size_, force_size_);
    const auto f0 = particular_.segment(static_cast<Eigen::Index>(c) * force_size_, force_size_);
    Cone& cone = cones_[c];
    cone.axial.resize(unknowns);
    cone.axial.head(unknowns - 1).noalias() = along.transpose() * n;
    cone.tangential.resize(force_size_, unknowns);
    cone.tangential.leftCols(unknowns - 1) = along;
    cone.tangential.leftCols(unknowns - 1).noalias() -= n * cone.axial.head(unknowns - 1).transpose();
    cone.tangential.col(unknowns - 1).setZero();
    cone.tangential_0 = f0 - n * n.dot(f0);
    cone.axial.head(unknowns - 1) *= friction_;
    cone.axial(unknowns - 1) = -spread;
    cone.axial_0 = friction_ * n.dot(f0);
    outside = std::min(outside, (cone.axial_0 - cone.tangential_0.norm()) / spread);
  }
  z_.setZero(unknowns);
  z_(unknowns - 1) = outside + kStartMargin;
}

double ForceClosure::widest_margin(Aim aim) {
  set_cones();
  const Eigen::Index t = z_.size() - 1;
  const double parameter = 2.0 * static_cast<double>(cones_.size());
  int steps = 0;
  for (double weight = parameter; parameter / weight > kGap && steps < kMaxNewtonSteps; weight *= kGrowth) {
    while (steps < kMaxNewtonSteps && newton_step(weight)) ++steps;
    weight_ = weight;
    // The optimum is at most parameter / weight above: outside the cones for good, or known well enough.
    if (aim != Aim::signed_margin && z_(t) + parameter / weight < 0.0) break;
    if (aim == Aim::inside && z_(t) > 0.0) break;
  }
  return z_(t);
}

// axial^2 - |tangential|^2 at z, with both parts; not positive outside.
double ForceClosure::Cone::evaluate(const Vector& z, Force& tangent, double& along) const {
  along = axial.dot(z) + axial_0;
  tangent = tangential_0;
  tangent.noalias() += tangential * z;
  return along > 0.0 ? along * along - tangent.squaredNorm() : -1.0;
}

// weight t + sum log(along^2 - |tangent|^2), or -infinity outside.
double ForceClosure::barrier(const Vector& z, double weight) const {
  double value = weight * z(z.size() - 1), along;
  Force tangent;
  for (const Cone& cone : cones_) {
    const double s = cone.evaluate(z, tangent, along);
    if (!(s > 0.0)) return -HUGE_VAL;
    value += std::log(s);
  }
  return value;
}

// The Newton step towards the maximum of the barrier as step_; its squared decrement.
double ForceClosure::newton_direction(double weight) {
  const Eigen::Index n = z_.size();
  gradient_.setZero(n);
  hessian_.setZero(n, n);
  gradient_(n - 1) = weight;
  double along;
  Force tangent;
  for (const Cone& cone : cones_) {
    const double s = cone.evaluate(z_, tangent, along);
    slope_ = along * cone.axial;
    slope_.noalias() -= cone.tangential.transpose() * tangent;
    slope_ *= 2.0 / s;
    gradient_ += slope_;
    hessian_.noalias() += slope_ * slope_.transpose();
    hessian_.noalias() -= (2.0 / s) * cone.axial * cone.axial.transpose();
    hessian_.noalias() += (2.0 / s) * cone.tangential.transpose().lazyProduct(cone.tangential);
  }
  factor_.compute(hessian_);
  step_ = factor_.solve(gradient_);
  return gradient_.dot(step_);
}

// One step with backtracking; false when there is nothing left to gain.
bool ForceClosure::newton_step(double weight) {
  const double decrement = newton_direction(weight);
  if (!(decrement > kCentred)) return false;
  const double here = barrier(z_, weight);
  for (double length = 1.0; length > 1e-12; length *= 0.5) {
    next_ = z_ + length * step_;
    if (barrier(next_, weight) >= here + 0.1 * length * decrement) {
      z_.swap(next_);
      return true;
    }
  }
  return false;
}

// L(f, t) = t + sum of (axial multiplier along + tangential multiplier . tangent) over the cones
//             + equation multipliers . (equations' f - right-hand side); at the centre of the barrier its slope by f is
//             0.
void ForceClosure::keep_multipliers() {
  for (int polish = 0; polish < kPolishing; ++polish) {
    newton_direction(weight_);
    next_ = z_ + step_;
    if (barrier(next_, weight_) == -HUGE_VAL || !next_.allFinite()) break;
    z_.swap(next_);
  }
  forces_ = particular_;
  forces_.noalias() += basis_ * z_.head(basis_.cols());
  const int contacts = system_.contact_count();
  cone_axial_.resize(contacts);
  cone_tangential_.resize(force_size_, contacts);
  Vector slope(forces_.size());
  double along;
  Force tangent;
  for (int c = 0; c < contacts; ++c) {
    const double s = cones_[static_cast<std::size_t>(c)].evaluate(z_, tangent, along);
    cone_axial_(c) = 2.0 * along / (weight_ * s);
    cone_tangential_.col(c) = (-2.0 / (weight_ * s)) * tangent;
    slope.segment(c * force_size_, force_size_) =
        friction_ * cone_axial_(c) * normals_.col(c) + cone_tangential_.col(c);
  }
  equation_multipliers_ = qr_.solve(-slope);
  equation_multipliers_.array() /= norms_.array();
}

double ForceClosure::lagrangian(const double* x) {
  const int contacts = system_.contact_count(), dof = system_.object_dof();
  system_.contact_points(x, points_.data(), Gt_);
  Force n = Force::Zero(force_size_);
  double value = 0.0;
  for (int c = 0; c < contacts; ++c) {
    const auto f = forces_.segment(c * force_size_, force_size_);
    n.head(directions_) = -points_[static_cast<std::size_t>(c)].object_normal.head(directions_);
    const double normal = n.dot(f);
    value += friction_ * cone_axial_(c) * normal + cone_tangential_.col(c).dot(f - n * normal);
    value += equation_multipliers_(dof) * normal;
    value += f.head(directions_).dot(Gt_.block(3 * c, 0, directions_, dof) * equation_multipliers_.head(dof));
    if (force_size_ > directions_)
      value += (torsional_ / friction_) * f(directions_) * n.head<3>().dot(equation_multipliers_.segment<3>(3));
  }
  return value;
}

}  // namespace graspatlas
