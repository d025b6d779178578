#include "graspatlas/continuation/newton.hpp"

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

namespace graspatlas {

namespace {

// Below this residual the factorisation serves for the remaining steps, which converge at once, and for the
// tangent basis.
constexpr double kNearlyZero = 1e-6;
// A Jacobian whose smallest singular value is this far below its largest has lost rank.
constexpr double kRankTolerance = 1e-9;
// A tangent vector whose squared length is below this beside the ones before it depends on them.
constexpr double kDependent = 1e-20;

double largest_entry(const std::vector<double>& R) {
  double largest = 0.0;
  for (double r : R) {
    if (!std::isfinite(r)) return HUGE_VAL;
    largest = std::max(largest, std::abs(r));
  }
  return largest;
}

// Gram-Schmidt on the rows, twice for orthogonality to working precision; false when they are dependent.
bool orthonormalize(double* rows, int count, int n) {
  for (int i = 0; i < count; ++i) {
    double* row = rows + static_cast<std::ptrdiff_t>(i) * n;
    for (int pass = 0; pass < 2; ++pass)
      for (int j = 0; j < i; ++j) {
        const double* other = rows + static_cast<std::ptrdiff_t>(j) * n;
        double dot = 0.0;
        for (int c = 0; c < n; ++c) dot += row[c] * other[c];
        for (int c = 0; c < n; ++c) row[c] -= dot * other[c];
      }
    double squared = 0.0;
    for (int c = 0; c < n; ++c) squared += row[c] * row[c];
    if (!(squared > kDependent) || !std::isfinite(squared)) return false;
    const double inverse = 1.0 / std::sqrt(squared);
    for (int c = 0; c < n; ++c) row[c] *= inverse;
  }
  return true;
}

}  // namespace

Newton::Newton(System& system, NewtonOptions options)
    : system_(system),
      options_(options),
      solver_(system.tangent_size()),
      R_(system.equation_count()),
      J_(static_cast<std::size_t>(system.equation_count()) * system.tangent_size()),
      step_(system.tangent_size()),
      tangents_(static_cast<std::size_t>(system.tangent_size()) * system.dimension()),
      corrections_(tangents_.size()) {}

bool Newton::factorize(const double* Phi) {
  const int n = system_.tangent_size(), equations = system_.equation_count();
  for (int i = 0; i < equations; ++i) std::copy_n(&J_[static_cast<std::size_t>(i) * n], n, solver_.row(i));
  for (int i = equations; i < n; ++i) std::copy_n(Phi + static_cast<std::size_t>(i - equations) * n, n, solver_.row(i));
  return solver_.factorize();
}

Projection Newton::project(double* x, const double* Phi) {
  const int n = system_.tangent_size();
  bool nearly = false;  // the last factorisation was made nearly at the solution: it finishes the work
  double previous = HUGE_VAL;
  for (int iteration = 0; iteration <= options_.max_iterations; ++iteration) {
    system_.linearize(x, R_.data(), J_.data());
    residual_ = largest_entry(R_);
    if (!std::isfinite(residual_)) return Projection::not_converged;
    if (nearly && residual_ > 0.1 * previous) nearly = false;
    if (!nearly && !factorize(Phi)) return Projection::singular;
    if (residual_ <= options_.tolerance) return Projection::converged;
    if (iteration >= 2 && residual_ > 10.0 * previous) return Projection::not_converged;
    previous = residual_;
    nearly = nearly || residual_ <= kNearlyZero;
    std::transform(R_.begin(), R_.end(), step_.begin(), [](double r) { return -r; });
    std::fill(step_.begin() + static_cast<long>(R_.size()), step_.end(), 0.0);
    solver_.solve(step_.data());
    double squared = 0.0;
    for (int i = 0; i < n; ++i) squared += step_[i] * step_[i];
    if (!std::isfinite(squared)) return Projection::not_converged;
    system_.integrate(x, step_.data(), x);
  }
  return Projection::not_converged;
}

bool Newton::tangent_basis(double* Phi) {
  const int n = system_.tangent_size(), k = system_.dimension(), equations = system_.equation_count();
  // Columns of T solve [J; Phi'] T = [0; I]. The factorisation may be that of a point nearby, so one step of iterative
  // refinement follows with the Jacobian here.
  double* T = tangents_.data();
  double* correction = corrections_.data();
  std::fill(tangents_.begin(), tangents_.end(), 0.0);
  for (int i = 0; i < k; ++i) T[(equations + i) * k + i] = 1.0;
  solver_.solve(T, k);
  std::fill(corrections_.begin(), corrections_.end(), 0.0);
  for (int e = 0; e < equations; ++e)
    for (int c = 0; c < n; ++c) {
      const double slope = J_[static_cast<std::size_t>(e) * n + c];
      for (int i = 0; i < k; ++i) correction[e * k + i] += slope * T[c * k + i];
    }
  solver_.solve(correction, k);
  for (int i = 0; i < k; ++i)
    for (int c = 0; c < n; ++c) Phi[i * n + c] = T[c * k + i] - correction[c * k + i];
  return orthonormalize(Phi, k, n);
}

Projection Newton::project_freely(double* x, double* Phi) {
  const int n = system_.tangent_size(), equations = system_.equation_count(), k = system_.dimension();
  Eigen::Map<RowMatrix> basis(Phi, k, n);
  if (equations == 0) {
    basis.setIdentity();
    residual_ = 0.0;
    return Projection::converged;
  }
  for (int iteration = 0; iteration <= options_.max_iterations; ++iteration) {
    system_.linearize(x, R_.data(), J_.data());
    residual_ = largest_entry(R_);
    if (!std::isfinite(residual_)) return Projection::not_converged;
    const Eigen::Map<const RowMatrix> J(J_.data(), equations, n);
    if (!J.allFinite()) return Projection::not_converged;
    const Eigen::JacobiSVD<Matrix> svd(Matrix(J), Eigen::ComputeFullU | Eigen::ComputeFullV);
    const auto& s = svd.singularValues();
    if (!(s(equations - 1) > kRankTolerance * s(0))) return Projection::singular;
    if (residual_ <= options_.tolerance) {
      basis = svd.matrixV().rightCols(k).transpose();
      return Projection::converged;
    }
    const Eigen::Map<const Vector> R(R_.data(), equations);
    const Vector d =
        -(svd.matrixV().leftCols(equations) * ((svd.matrixU().transpose() * R).array() / s.array()).matrix());
    system_.integrate(x, d.data(), x);
  }
  return Projection::not_converged;
}

}  // namespace graspatlas
