#include "graspatlas/manifold/far_projection.hpp"

#include <Eigen/Cholesky>
#include <algorithm>

namespace graspatlas {

namespace {

constexpr int kMostSteps = 60;     // those that converge need a dozen
constexpr double kZero = 1e-9;     // largest |R_e(x)| that counts as zero
constexpr double kMargin = 1e-6;   // kept from the bounds, so that rounding cannot break them [tangent space]
constexpr double kDamping = 1e-2;  // of the first step
constexpr double kEased = 0.2, kTightened = 4.0, kLargest = 1e6, kLeast = 1e-12;  // after good and bad steps; its range
// After so many steps each must bring the squared residual below this share.
constexpr int kPatience = 10;
constexpr double kProgress = 0.999;

}  // namespace

FarProjection::FarProjection(System& system)
    : system_(system),
      r_(system.equation_count() + system.bound_count()),
      moved_r_(r_),
      slacks_(system.bound_count()),
      gradient_(system.tangent_size()),
      J_(r_.size(), system.tangent_size()),
      residual_(static_cast<std::size_t>(system.equation_count())),
      moved_(static_cast<std::size_t>(system.configuration_size())),
      step_(static_cast<std::size_t>(system.tangent_size())) {}

// R(x), and by how much each bound is broken.
void FarProjection::evaluate(const double* x, Vector& r) {
  system_.residual(x, r.data());
  if (slacks_.size() == 0) return;
  system_.slack(x, slacks_.data());
  r.tail(slacks_.size()) = (kMargin - slacks_.array()).max(0.0);
}

bool FarProjection::project(double* x) {
  const int n = system_.tangent_size(), equations = system_.equation_count();
  const RowMatrix& B = system_.bound_normals();
  double damping = kDamping;
  evaluate(x, r_);
  for (int step = 0; step < kMostSteps; ++step) {
    if (!r_.allFinite()) return false;
    if (r_.size() == 0 || r_.lpNorm<Eigen::Infinity>() <= kZero) return true;
    const double before = r_.squaredNorm();
    system_.linearize(x, residual_.data(), J_.data());
    for (int b = 0; b < slacks_.size(); ++b) {
      if (r_(equations + b) > 0.0)
        J_.row(equations + b) = B.row(b);
      else
        J_.row(equations + b).setZero();
    }
    normal_.noalias() = J_.transpose() * J_;
    gradient_.noalias() = J_.transpose() * r_;
    for (;; damping *= kTightened) {
      if (damping > kLargest) return false;
      damped_ = normal_;
      damped_.diagonal().array() += damping;
      Eigen::Map<Vector>(step_.data(), n) = -damped_.llt().solve(gradient_);
      system_.integrate(x, step_.data(), moved_.data());
      evaluate(moved_.data(), moved_r_);
      if (moved_r_.squaredNorm() < before) break;
    }
    std::copy(moved_.begin(), moved_.end(), x);
    r_.swap(moved_r_);
    if (step >= kPatience && r_.squaredNorm() > kProgress * before) return false;
    damping = std::max(kEased * damping, kLeast);
  }
  return false;
}

}  // namespace graspatlas
