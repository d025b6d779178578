#include "graspatlas/quality/touch_program.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace graspatlas {

namespace {

constexpr int kMaxSteps = 60;
constexpr double kOutside = 0.01;     // of the reach: how far a programme starts outside the body
constexpr double kDone = 1e-13;       // mu, relative to the reach, at which it ends
constexpr double kLeft = 1e-11;       // of the equations that may be left then
constexpr double kGoodEnough = 1e-9;  // of both, where rounding ends it earlier
constexpr double kBack = 0.995;       // of the way to the boundary of a cone, at most
constexpr double kLeastShare = 0.01;  // of mu that a step aims at

// The farthest that p + t step stays in the cone of `size` numbers.
double way_out(const double* p, const double* step, int size) {
  double a0 = p[0] * p[0], a1 = p[0] * step[0], a2 = step[0] * step[0];
  for (int k = 1; k < size; ++k) {
    a0 -= p[k] * p[k];
    a1 -= p[k] * step[k];
    a2 -= step[k] * step[k];
  }
  double end = step[0] < 0.0 ? -p[0] / step[0] : HUGE_VAL;
  const double discriminant = a1 * a1 - a2 * a0;
  if (discriminant < 0.0 || (a1 >= 0.0 && a2 >= 0.0)) return end;
  const double root = std::max(a0, 0.0) / (-a1 + std::sqrt(discriminant));
  return root >= 0.0 ? std::min(end, root) : end;
}

}  // namespace

void TouchProgram::set(const RowMatrix& E, int cone_size, int ball_size) {
  E_ = &E;
  cone_size_ = cone_size;
  ball_size_ = ball_size;
  contacts_ = static_cast<int>(E.cols()) / cone_size;
}

void TouchProgram::set_multipliers() {
  l_.noalias() = E_->transpose() * -v_;
  for (int i = 0; i < contacts_; ++i) l_(static_cast<Eigen::Index>(i) * cone_size_) += t_;
}

// The multipliers w that suit the forces best, by least squares of z o l; and t so large that all l are inside.
void TouchProgram::start(const Vector& direction, const Vector& z) {
  const Eigen::Index n = z.size(), rows = E_->rows(), equations = rows - ball_size_;
  z_ = z;
  double total = 0.0;
  for (Eigen::Index i = 0; i < n; i += cone_size_) total += z_(i);
  z_ /= total;
  v_.setZero(rows);
  v_.head(ball_size_) = direction;
  t_ = 0.0;
  set_multipliers();
  Matrix products(n, equations + 1);
  Vector right(n);
  const auto multiplied = [&](const auto& l, auto out) {
    for (Eigen::Index i = 0; i < n; i += cone_size_) {
      const auto zi = z_.segment(i, cone_size_);
      out.segment(i, cone_size_) = zi(0) * l.segment(i, cone_size_) + l(i) * zi;
      out(i) = zi.dot(l.segment(i, cone_size_));
    }
  };
  multiplied(l_, right.col(0));
  Vector unit = Vector::Zero(n);
  for (Eigen::Index i = 0; i < n; i += cone_size_) unit(i) = 1.0;
  multiplied(unit, products.col(0));
  for (Eigen::Index e = 0; e < equations; ++e) multiplied(E_->row(ball_size_ + e).transpose(), products.col(e + 1));
  const Vector found = (products.transpose() * products).ldlt().solve(products.transpose() * right);
  if (found.allFinite()) v_.tail(equations) = found.tail(equations);
  set_multipliers();
  for (Eigen::Index i = 0; i < n; i += cone_size_) t_ = std::max(t_, l_.segment(i + 1, cone_size_ - 1).norm() - l_(i));
  t_ *= 1.0 + kOutside;
  set_multipliers();
  rho_ = v_.head(ball_size_).dot(E_->topRows(ball_size_) * z_);
}

// Solves the equations, linear in z, v, t and rho but for products, and goes as far as the cones allow; false when it
// cannot.
bool TouchProgram::newton_step(double mu) {
  const Eigen::Index n = z_.size(), rows = E_->rows(), size = n + rows + 2, at_t = n + rows, at_rho = at_t + 1;
  system_.setZero(size, size);
  right_.resize(size);
  for (Eigen::Index i = 0; i < n; i += cone_size_) {
    const auto z = z_.segment(i, cone_size_), l = l_.segment(i, cone_size_);
    const auto Ei = E_->middleCols(i, cone_size_);
    auto by_z = system_.block(i, i, cone_size_, cone_size_);
    by_z.diagonal().setConstant(l(0));
    by_z.row(0) = l.transpose();
    by_z.col(0) = l;
    auto by_v = system_.block(i, n, cone_size_, rows);
    for (int k = 1; k < cone_size_; ++k) by_v.row(k) = -z(0) * Ei.col(k).transpose() - z(k) * Ei.col(0).transpose();
    by_v.row(0).noalias() = -(Ei * z).transpose();
    system_.col(at_t).segment(i, cone_size_) = z;
    right_(i) = mu - z.dot(l);
    right_.segment(i + 1, cone_size_ - 1) = -z(0) * l.tail(cone_size_ - 1) - l(0) * z.tail(cone_size_ - 1);
    system_(at_t, i) = 1.0;
  }
  system_.block(n, 0, rows, n) = *E_;
  for (int k = 0; k < ball_size_; ++k) {
    system_(n + k, n + k) = -rho_;
    system_(n + k, at_rho) = -v_(k);
    system_(at_rho, n + k) = v_(k);
  }
  right_.segment(n, rows).noalias() = -(*E_ * z_);
  right_.segment(n, ball_size_) += rho_ * v_.head(ball_size_);
  double total = 0.0;
  for (Eigen::Index i = 0; i < n; i += cone_size_) total += z_(i);
  right_(at_t) = 1.0 - total;
  right_(at_rho) = 0.5 * (1.0 - v_.head(ball_size_).squaredNorm());
  left_ = std::max(right_.tail(rows + 2).lpNorm<Eigen::Infinity>(), 0.0);
  lu_.compute(system_);
  step_ = lu_.solve(right_);
  if (!step_.allFinite()) return false;
  dl_.noalias() = E_->transpose() * -step_.segment(n, rows);
  for (Eigen::Index i = 0; i < n; i += cone_size_) dl_(i) += step_(at_t);
  const double length = std::min(1.0, kBack * std::min(step_length(z_, step_), step_length(l_, dl_)));
  z_ += length * step_.head(n);
  v_ += length * step_.segment(n, rows);
  t_ += length * step_(at_t);
  rho_ += length * step_(at_rho);
  const double norm = v_.head(ball_size_).norm();
  v_ /= norm;
  t_ /= norm;
  set_multipliers();
  last_length_ = length;
  return length > 1e-8;
}

double TouchProgram::step_length(const Vector& point, const Vector& step) const {
  double end = HUGE_VAL;
  for (Eigen::Index i = 0; i < point.size(); i += cone_size_)
    end = std::min(end, way_out(point.data() + i, step.data() + i, cone_size_));
  return end;
}

bool TouchProgram::find(const Vector& direction, const Vector& z, Touch& out) {
  start(direction, z);
  last_length_ = 0.0;
  for (int steps = 0; steps < kMaxSteps; ++steps) {
    const double away = 1.0 - last_length_;
    if (!newton_step(std::max(kLeastShare, away * away) * complementarity())) break;
    if (complementarity() <= kDone * t_ && left_ <= kLeft) break;
  }
  out = {t_, v_, z_, l_};
  return complementarity() <= kGoodEnough * t_ && left_ <= kGoodEnough && t_ > 0.0;
}

TouchProgram::Touch TouchProgram::guess(const Vector& direction, const Vector& z, double reach) {
  start(direction, z);
  return {reach, v_, z_, l_};
}

}  // namespace graspatlas
