#include "graspatlas/quality/force_closure.hpp"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>

namespace graspatlas {

namespace {

constexpr double kRankTolerance = 1e-9;
constexpr double kGap = 1e-10;     // the margin is found to within this
constexpr double kGrowth = 12.0;   // of the barrier's weight from one centring to the next
constexpr double kCentred = 1e-8;  // squared Newton decrement at which a centring ends
constexpr int kMaxNewtonSteps = 200;
constexpr double kHopeless = -1.0;  // a barrier that starts this far outside the cones

// max t  s.t.  |S_i z| <= a_i . z + b_i  for z = (c, t): the cones as functions of the unknowns.
struct Cone {
  Matrix tangential;  // 3 x unknowns, and its constant part
  Vector tangential_0;
  Vector axial;  // mu n . f - s t
  double axial_0;
};

// Slack of a cone at z: axial^2 - |tangential|^2, with both parts; not positive outside.
double slack(const Cone& cone, const Vector& z, double& axial, Vector& tangential) {
  axial = cone.axial.dot(z) + cone.axial_0;
  tangential = cone.tangential * z + cone.tangential_0;
  return axial > 0.0 ? axial * axial - tangential.squaredNorm() : -1.0;
}

// weight t + sum log(slack), or -infinity outside.
double barrier(const std::vector<Cone>& cones, const Vector& z, double weight) {
  double value = weight * z(z.size() - 1), axial;
  Vector tangential;
  for (const Cone& cone : cones) {
    const double s = slack(cone, z, axial, tangential);
    if (!(s > 0.0)) return -HUGE_VAL;
    value += std::log(s);
  }
  return value;
}

// One Newton step with backtracking towards the maximum of the barrier; false when there is nothing left to gain.
bool newton_step(const std::vector<Cone>& cones, double weight, Vector& z) {
  const Eigen::Index n = z.size();
  Vector gradient = Vector::Zero(n), tangential;
  Matrix hessian = Matrix::Zero(n, n);
  gradient(n - 1) = weight;
  double axial;
  for (const Cone& cone : cones) {
    const double s = slack(cone, z, axial, tangential);
    const Vector ds = 2.0 * (axial * cone.axial - cone.tangential.transpose() * tangential);
    gradient += ds / s;
    hessian += ds * ds.transpose() / (s * s);
    hessian -= (2.0 / s) * (cone.axial * cone.axial.transpose() - cone.tangential.transpose() * cone.tangential);
  }
  const Eigen::LDLT<Matrix> factor(hessian);
  const Vector step = factor.solve(gradient);
  const double decrement = gradient.dot(step);
  if (!(decrement > kCentred)) return false;
  const double here = barrier(cones, z, weight);
  for (double length = 1.0; length > 1e-12; length *= 0.5) {
    const Vector next = z + length * step;
    if (barrier(cones, next, weight) >= here + 0.1 * length * decrement) {
      z = next;
      return true;
    }
  }
  return false;
}

}  // namespace

ForceClosure::ForceClosure(GraspSystem& system, double friction)
    : system_(system),
      friction_(friction),
      force_size_(system.object_dof() == 3 ? 2 : 3),
      points_(system.contact_count()) {
  if (system.object_dof() == 0 || system.contact_count() == 0)
    throw Error("force closure needs an object and at least one contact");
  if (!(friction > 0.0) || !std::isfinite(friction)) throw Error("friction must be positive, got " + to_text(friction));
  J_.resize(3 * system.contact_count(), system.model().hand_v_size());
  Gt_.resize(3 * system.contact_count(), system.object_dof());
  normals_.resize(force_size_, system.contact_count());
}

double ForceClosure::margin(const double* x) {
  system_.grasp_matrices(x, J_, Gt_);
  system_.contact_points(x, points_.data());
  for (int c = 0; c < system_.contact_count(); ++c) normals_.col(c) = -points_[c].object_normal.head(force_size_);
  return internal_forces() ? std::max(widest_margin(), 0.0) : 0.0;
}

// Solves [G; n'] f = [0; 1] by a QR factorisation of the transpose; false when G or the whole has lost rank.
bool ForceClosure::internal_forces() {
  const int contacts = system_.contact_count(), dof = system_.object_dof();
  const Eigen::Index forces = static_cast<Eigen::Index>(contacts) * force_size_;
  if (forces < dof + 1) return false;
  Matrix A(forces, dof + 1);
  for (int c = 0; c < contacts; ++c) {
    A.block(c * force_size_, 0, force_size_, dof) = Gt_.block(3 * c, 0, force_size_, dof);
    A.block(c * force_size_, dof, force_size_, 1) = normals_.col(c);
  }
  // Torques in units of the grasp's size, so that one tolerance serves all rows.
  for (int column = 0; column <= dof; ++column) {
    const double norm = A.col(column).norm();
    if (!(norm > 0.0)) return false;
    if (column < dof) A.col(column) /= norm;
  }
  const Eigen::ColPivHouseholderQR<Matrix> qr(A);
  const auto& R = qr.matrixR();
  for (int i = 0; i <= dof; ++i)
    if (!(std::abs(R(i, i)) > kRankTolerance * std::abs(R(0, 0)))) return false;
  Vector y = qr.colsPermutation().transpose() * Vector::Unit(dof + 1, dof);
  y = R.topLeftCorner(dof + 1, dof + 1).triangularView<Eigen::Upper>().transpose().solve(y).eval();
  Matrix Q = Matrix::Identity(forces, forces);
  Q.applyOnTheLeft(qr.householderQ());
  particular_ = Q.leftCols(dof + 1) * y;
  basis_ = Q.rightCols(forces - dof - 1);
  return true;
}

double ForceClosure::widest_margin() {
  const int contacts = system_.contact_count();
  const Eigen::Index unknowns = basis_.cols() + 1;
  const double spread = std::sqrt(1.0 + friction_ * friction_);
  std::vector<Cone> cones(contacts);
  for (int c = 0; c < contacts; ++c) {
    const Vector n = normals_.col(c);
    const Matrix along = basis_.middleRows(c * force_size_, force_size_);
    const Vector f0 = particular_.segment(c * force_size_, force_size_);
    const Matrix P = Matrix::Identity(force_size_, force_size_) - n * n.transpose();
    Cone& cone = cones[c];
    cone.tangential = Matrix::Zero(force_size_, unknowns);
    cone.tangential.leftCols(unknowns - 1) = P * along;
    cone.tangential_0 = P * f0;
    cone.axial = Vector::Zero(unknowns);
    cone.axial.head(unknowns - 1) = friction_ * (along.transpose() * n);
    cone.axial(unknowns - 1) = -spread;
    cone.axial_0 = friction_ * n.dot(f0);
  }
  Vector z = Vector::Zero(unknowns);
  double start = 0.0;
  for (const Cone& cone : cones) start = std::min(start, (cone.axial_0 - cone.tangential_0.norm()) / spread);
  z(unknowns - 1) = start + kHopeless;
  const double parameter = 2.0 * contacts;
  int steps = 0;
  for (double weight = parameter; parameter / weight > kGap && steps < kMaxNewtonSteps; weight *= kGrowth) {
    while (steps < kMaxNewtonSteps && newton_step(cones, weight, z)) ++steps;
    // The optimum is at most parameter / weight above: outside the cones for good, or known well enough.
    if (z(unknowns - 1) + parameter / weight < 0.0) break;
  }
  return z(unknowns - 1);
}

}  // namespace graspatlas
