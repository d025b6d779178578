#include "graspatlas/manifold/newton.hpp"

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <utility>

#include "graspatlas/manifold/tangent.hpp"
#include "graspatlas/types.hpp"

namespace graspatlas {

namespace {

// How far from an equation's zero set a point may be, to first order [units of the tangent space]: the largest |R_e(x)|
// beside the largest entry of row e of J(x), so that no equation's scale matters.
constexpr double kTolerance = 1e-12;
// Steps after which a point has not converged. Newton's method takes 3 to 6 from within a chart's radius.
constexpr int kMostIterations = 10;
// Steps go on with one factorisation while each is at most this share of the one before: then they cost less than new
// factorisations, and converge.
constexpr double kContraction = 0.05;
// The same where few steps are left.
constexpr double kFastContraction = 0.3;
// A step that is foreseen only, from the two before it, is left out when it is shorter than what a projection may be
// off by this factor.
constexpr double kForeseen = 0.1;
// Rounding of an equation beside the numbers in x, which no step can make smaller.
constexpr double kRounding = 1e-14;
// A Jacobian whose smallest singular value is this far below its largest has lost rank.
constexpr double kRankTolerance = 1e-9;
// Tangent vectors, which have no zeros, are made this much smaller than the equations' rows in the matrix to factorise:
// then they become pivots last.
constexpr double kTangentShare = 0.1;
// Numbers of the inverse iteration are made smaller before they overflow.
constexpr double kLargestNumber = 1e100;
// A tangent vector whose squared length is below this beside the ones before it depends on them.
constexpr double kDependent = 1e-20;

// In four running maxima, which the processor keeps side by side.
inline double largest_entry(const double* values, int size) {
  double m0 = 0.0, m1 = 0.0, m2 = 0.0, m3 = 0.0;
  int i = 0;
  for (; i + 4 <= size; i += 4) {
    m0 = std::max(m0, std::abs(values[i]));
    m1 = std::max(m1, std::abs(values[i + 1]));
    m2 = std::max(m2, std::abs(values[i + 2]));
    m3 = std::max(m3, std::abs(values[i + 3]));
  }
  for (; i < size; ++i) m0 = std::max(m0, std::abs(values[i]));
  return std::max(std::max(m0, m1), std::max(m2, m3));
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

double distance_to_zero(const double* R, const double* J, int equations, int n, double* row_sizes) {
  double distance = 0.0;
  for (int e = 0; e < equations; ++e) {
    row_sizes[e] = largest_entry(J + static_cast<std::ptrdiff_t>(e) * n, n);
    const double off = R[e] == 0.0 ? 0.0 : std::abs(R[e]) / row_sizes[e];
    distance = std::isfinite(off) ? std::max(distance, off) : HUGE_VAL;
  }
  return distance;
}

Newton::Newton(System& system)
    : system_(system),
      solver_(system.tangent_size()),
      R_(system.equation_count()),
      J_(static_cast<std::size_t>(system.equation_count()) * system.tangent_size()),
      row_sizes_(system.equation_count()),
      inverse_sizes_(system.equation_count()),
      step_(system.tangent_size()) {}

// R and J at x; the distance to zero.
double Newton::linearize(const double* x) {
  const int n = system_.tangent_size(), equations = system_.equation_count();
  system_.linearize(x, R_.data(), J_.data());
  residual_ = largest_entry(R_.data(), equations);
  return distance_to_zero(R_.data(), J_.data(), equations, n, row_sizes_.data());
}

bool Newton::factorize(const double* Phi) {
  const int n = system_.tangent_size(), equations = system_.equation_count();
  for (int i = 0; i < equations; ++i) {
    const double inverse = row_sizes_[i] > 0.0 ? 1.0 / row_sizes_[i] : 1.0;
    inverse_sizes_[i] = inverse;
    const double* const from = &J_[static_cast<std::size_t>(i) * n];
    double* const row = solver_.row(i);
    for (int c = 0; c < n; ++c) row[c] = inverse * from[c];
  }
  for (int i = equations; i < n; ++i) {
    const double* const from = Phi + static_cast<std::ptrdiff_t>(i - equations) * n;
    double* const row = solver_.row(i);
    for (int c = 0; c < n; ++c) row[c] = kTangentShare * from[c];
  }
  return solver_.factorize();
}

Projection Newton::project(double* x, const double* Phi) {
  double previous = HUGE_VAL;
  for (int iteration = 0; iteration <= kMostIterations; ++iteration) {
    const double distance = linearize(x);
    if (!std::isfinite(distance)) return Projection::not_converged;
    if (!factorize(Phi)) return Projection::singular;
    const double enough = tolerance(x);
    if (distance <= enough) return Projection::converged;
    if (iteration >= 2 && distance > 10.0 * previous) return Projection::not_converged;
    previous = distance;
    const double length = step_down(x);
    if (!std::isfinite(length)) return Projection::not_converged;
    descend(x, length, kForeseen * enough, kContraction);
  }
  return Projection::not_converged;
}

// The step with the residual and the factorisation that there are, into step_; its length.
double Newton::solve_step() {
  for (std::size_t e = 0; e < R_.size(); ++e) step_[e] = -R_[e] * inverse_sizes_[e];
  std::fill(step_.begin() + static_cast<long>(R_.size()), step_.end(), 0.0);
  solver_.solve(step_.data());
  return std::sqrt(squared_length(step_.data(), system_.tangent_size()));
}

// That step from x; its length. Where that is not finite x stays.
double Newton::step_down(double* x) {
  const double length = solve_step();
  if (std::isfinite(length)) system_.integrate(x, step_.data(), x);
  return length;
}

// After a step of a length, more with the same factorisation, which ask for residuals only: true when the next would be
// shorter than `enough`, false when one is a larger share than `contraction` of the one before. None is longer than
// that.
bool Newton::descend(double* x, double length, double enough, double contraction) {
  for (int iteration = 0; iteration < kMostIterations && length > enough; ++iteration) {
    system_.residual(x, R_.data());
    const double previous = std::exchange(length, solve_step());
    if (!(length < previous)) return false;
    system_.integrate(x, step_.data(), x);
    if (length > contraction * previous) return false;
    if (length * length <= enough * previous) return true;
  }
  return length <= enough;
}

Projection Newton::project_nearly(double* x, const double* Phi, double enough) {
  double previous = HUGE_VAL;
  for (int iteration = 0; iteration <= kMostIterations; ++iteration) {
    const double distance = linearize(x);
    if (!std::isfinite(distance)) return Projection::not_converged;
    if (iteration >= 2 && distance > 10.0 * previous) return Projection::not_converged;
    previous = distance;
    if (!factorize(Phi)) return Projection::singular;
    const double length = step_down(x);
    if (!std::isfinite(length)) return Projection::not_converged;
    if (length <= enough || descend(x, length, kForeseen * enough, kFastContraction)) return Projection::converged;
  }
  return Projection::not_converged;
}

double Newton::tolerance(const double* x) const {
  return std::max(kTolerance, kRounding * largest_entry(x, system_.configuration_size()));
}

// Inverse iteration on A A', from a start that lies along no axis.
double Newton::regularity(int iterations) {
  const int n = system_.tangent_size();
  for (int i = 0; i < n; ++i) step_[i] = 1.0 + 0.3 * ((5 * i + 2) % 7) - (i % 2 != 0 ? 2.2 : 0.0);
  double before = 0.0, after = 0.0;
  for (int c = 0; c < n; ++c) after += step_[c] * step_[c];
  // The rows that were factorised are those of the scaled matrix times these factors.
  const bool scaled = scales_ && !scales_->empty();
  const auto rescale = [&] {
    for (std::size_t e = 0; scaled && e < R_.size(); ++e) step_[e] *= (*scales_)[e] * inverse_sizes_[e];
    for (std::size_t i = R_.size(); i < step_.size(); ++i) step_[i] *= kTangentShare;
  };
  for (int i = 0; i < iterations; ++i) {
    rescale();
    solver_.solve(step_.data());
    solver_.solve_transposed(step_.data());
    rescale();
    before = after;
    after = 0.0;
    for (int c = 0; c < n; ++c) after += step_[c] * step_[c];
    if (after > kLargestNumber) {
      const double shrink = 1.0 / std::sqrt(after);
      for (int c = 0; c < n; ++c) step_[c] *= shrink;
      before /= after;
      after = 1.0;
    }
  }
  const double smallest = std::sqrt(std::sqrt(before / after));
  return solver_.determinant_negative() ? -smallest : smallest;
}

bool Newton::hold(const double* x, const double* Phi) { return std::isfinite(linearize(x)) && factorize(Phi); }

bool Newton::approach(double* x) {
  system_.residual(x, R_.data());
  return std::isfinite(step_down(x));
}

// Phi's row i solves [J; Phi'] d = [0; e_i], but for its length.
bool Newton::tangent_basis(double* Phi) {
  const int n = system_.tangent_size(), k = system_.dimension(), equations = system_.equation_count();
  std::fill_n(Phi, static_cast<std::ptrdiff_t>(k) * n, 0.0);
  for (int i = 0; i < k; ++i) {
    double* const row = Phi + static_cast<std::ptrdiff_t>(i) * n;
    row[equations + i] = kTangentShare;
    solver_.solve(row);
  }
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
  for (int iteration = 0; iteration <= kMostIterations; ++iteration) {
    const double distance = linearize(x);
    const bool flat = std::any_of(row_sizes_.begin(), row_sizes_.end(), [](double size) { return size == 0.0; });
    if (std::isfinite(residual_) && flat) return Projection::singular;
    if (!std::isfinite(distance)) return Projection::not_converged;
    Eigen::Map<RowMatrix> J(J_.data(), equations, n);
    if (!J.allFinite()) return Projection::not_converged;
    for (int e = 0; e < equations; ++e) {
      J.row(e) /= row_sizes_[e];
      R_[e] /= row_sizes_[e];
    }
    const Eigen::JacobiSVD<Matrix> svd(Matrix(J), Eigen::ComputeFullU | Eigen::ComputeFullV);
    const auto& s = svd.singularValues();
    if (!(s(equations - 1) > kRankTolerance * s(0))) return Projection::singular;
    if (distance <= tolerance(x)) {
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
