#include "graspatlas/manifold/linear_solver.hpp"

#include <algorithm>
#include <cmath>

namespace graspatlas {

namespace {
constexpr double kSingular = 1e-12;  // a pivot this small beside the largest entry means a singular matrix
}

LinearSolver::LinearSolver(int size)
    : size_(size),
      stride_((size + 1) / 2 * 2),
      storage_(static_cast<std::size_t>(size) * stride_),
      rows_(size),
      origin_(size),
      inverse_pivots_(size),
      permuted_(size) {}

bool LinearSolver::factorize() {
  const int n = size_;
  double largest = 0.0;
  for (int i = 0; i < n; ++i) {
    rows_[i] = row(i);
    origin_[i] = i;
    for (int j = 0; j < n; ++j) largest = std::max(largest, std::abs(rows_[i][j]));
  }
  determinant_negative_ = false;
  const double threshold = kSingular * largest;
  for (int c = 0; c < n; ++c) {
    int pivot = c;
    for (int i = c + 1; i < n; ++i)
      if (std::abs(rows_[i][c]) > std::abs(rows_[pivot][c])) pivot = i;
    if (!(std::abs(rows_[pivot][c]) > threshold)) return false;
    std::swap(rows_[c], rows_[pivot]);
    std::swap(origin_[c], origin_[pivot]);
    determinant_negative_ ^= (pivot != c) != (rows_[c][c] < 0.0);
    const double* __restrict top = rows_[c];
    const double inverse = 1.0 / top[c];
    inverse_pivots_[c] = inverse;
    for (int i = c + 1; i < n; ++i) {
      double* __restrict below = rows_[i];
      if (below[c] == 0.0) continue;
      const double factor = below[c] * inverse;
      below[c] = factor;
      for (int j = c + 1; j < n; ++j) below[j] -= factor * top[j];
    }
  }
  return true;
}

namespace {

// Dot product in four running sums, which the processor adds up side by side.
inline double dot(const double* __restrict a, const double* __restrict b, int n) {
  double s0 = 0.0, s1 = 0.0, s2 = 0.0, s3 = 0.0;
  int i = 0;
  for (; i + 4 <= n; i += 4) {
    s0 += a[i] * b[i];
    s1 += a[i + 1] * b[i + 1];
    s2 += a[i + 2] * b[i + 2];
    s3 += a[i + 3] * b[i + 3];
  }
  for (; i < n; ++i) s0 += a[i] * b[i];
  return (s0 + s1) + (s2 + s3);
}

}  // namespace

void LinearSolver::solve(double* b) const {
  const int n = size_;
  permuted_.resize(n);
  double* y = permuted_.data();
  for (int i = 0; i < n; ++i) y[i] = b[origin_[i]] - dot(rows_[i], y, i);
  for (int i = n - 1; i >= 0; --i) b[i] = (y[i] - dot(rows_[i] + i + 1, b + i + 1, n - i - 1)) * inverse_pivots_[i];
}

// A = P' L U: first U' z = b, then L' y = z; row by row, since rows are contiguous.
void LinearSolver::solve_transposed(double* b) const {
  const int n = size_;
  permuted_.resize(n);
  double* y = permuted_.data();
  std::copy_n(b, n, y);
  for (int i = 0; i < n; ++i) {
    const double* __restrict row = rows_[i];
    y[i] *= inverse_pivots_[i];
    for (int j = i + 1; j < n; ++j) y[j] -= y[i] * row[j];
  }
  for (int i = n - 1; i > 0; --i) {
    const double* __restrict row = rows_[i];
    for (int j = 0; j < i; ++j) y[j] -= y[i] * row[j];
  }
  for (int i = 0; i < n; ++i) b[origin_[i]] = y[i];
}

void LinearSolver::solve(double* B, int columns) const {
  const int n = size_;
  permuted_.resize(static_cast<std::size_t>(n) * columns);
  double* Y = permuted_.data();
  for (int i = 0; i < n; ++i) {
    double* __restrict y = Y + static_cast<std::ptrdiff_t>(i) * columns;
    std::copy_n(B + static_cast<std::ptrdiff_t>(origin_[i]) * columns, columns, y);
    for (int j = 0; j < i; ++j) {
      const double factor = rows_[i][j];
      const double* __restrict above = Y + static_cast<std::ptrdiff_t>(j) * columns;
      for (int c = 0; c < columns; ++c) y[c] -= factor * above[c];
    }
  }
  for (int i = n - 1; i >= 0; --i) {
    const double* y = Y + static_cast<std::ptrdiff_t>(i) * columns;
    double* __restrict b = B + static_cast<std::ptrdiff_t>(i) * columns;
    std::copy_n(y, columns, b);
    for (int j = i + 1; j < n; ++j) {
      const double factor = rows_[i][j];
      const double* __restrict below = B + static_cast<std::ptrdiff_t>(j) * columns;
      for (int c = 0; c < columns; ++c) b[c] -= factor * below[c];
    }
    for (int c = 0; c < columns; ++c) b[c] *= inverse_pivots_[i];
  }
}

}  // namespace graspatlas
