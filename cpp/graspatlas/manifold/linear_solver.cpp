#include "graspatlas/manifold/linear_solver.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

namespace graspatlas {

namespace {

// A pivot this small, in a matrix of entries of about one, means a singular matrix.
constexpr double kSingular = 1e-13;

// Numbers that are taken at a time; arrays are as long as a multiple of that, and what is behind their ends is zero, or
// does not matter.
constexpr int kWidth = 4;
using Numbers = Eigen::Array<double, kWidth, 1>;

int padded(int size) { return (size + kWidth - 1) / kWidth * kWidth; }

// a -= factor b
inline void subtract(double* __restrict a, const double* __restrict b, double factor, int size) {
  for (int i = 0; i < size; i += kWidth) Eigen::Map<Numbers>(a + i) -= factor * Eigen::Map<const Numbers>(b + i);
}

inline void keep_largest(double entry, int i, double& largest, int& at) {
  const double size = std::abs(entry);
  if (size > largest) {
    largest = size;
    at = i;
  }
}

}  // namespace

LinearSolver::LinearSolver(int size)
    : size_(size),
      stride_(padded(size)),
      storage_(static_cast<std::size_t>(size) * 2 * stride_),
      by_pivot_(static_cast<std::size_t>(size) * stride_),
      by_column_(static_cast<std::size_t>(size) * stride_),
      rows_(size),
      origin_(size),
      inverse_pivots_(size),
      work_(stride_),
      steps_(stride_) {}

bool LinearSolver::factorize() {
  const int n = size_;
  for (int i = 0; i < n; ++i) {
    rows_[i] = row(i);
    origin_[i] = i;
  }
  // To take the columns from the last to the first is to reverse them.
  determinant_negative_ = n * (n - 1) / 2 % 2 != 0;
  int pivot = 0;
  double largest = 0.0;
  for (int i = 0; i < n; ++i) keep_largest(rows_[i][n - 1], i, largest, pivot);
  for (int t = 0; t < n; ++t) {
    const int c = n - 1 - t;
    if (!(largest > kSingular)) return false;
    take_pivot(t, c, pivot);
    const double* const pivot_row = rows_[t];
    const double inverse_pivot = inverse_pivots_[t];
    double* const taken = factors_of_step(t);
    for (int i = 0; i < n; i += kWidth) Eigen::Map<Numbers>(taken + i).setZero();
    // The next pivot is sought in the same pass.
    largest = 0.0;
    for (int i = t + 1; i < n; ++i) {
      double* const below = rows_[i];
      const double factor = below[stride_ + t] = taken[origin_[i]] = below[c] * inverse_pivot;
      if (factor != 0.0) subtract(below, pivot_row, factor, c);
      keep_largest(below[c - 1], i, largest, pivot);
    }
  }
  return true;
}

// Swaps a row into the place of its step.
void LinearSolver::take_pivot(int step, int column, int pivot) {
  std::swap(rows_[step], rows_[pivot]);
  std::swap(origin_[step], origin_[pivot]);
  const double* const row = rows_[step];
  determinant_negative_ ^= (pivot != step) != (row[column] < 0.0);
  inverse_pivots_[step] = 1.0 / row[column];
  for (int c = 0; c < column; ++c) entries_of_column(c)[step] = row[c];
}

void LinearSolver::solve(double* b) {
  const int n = size_;
  double *const left = work_.data(), *const y = steps_.data();
  std::copy_n(b, n, left);
  for (int t = 0; t < n; ++t) {
    y[t] = left[origin_[t]];
    if (y[t] != 0.0) subtract(left, factors_of_step(t), y[t], n);
  }
  for (int c = 0, t = n - 1; c < n; ++c, --t) {
    b[c] = y[t] * inverse_pivots_[t];
    subtract(y, entries_of_column(c), b[c], t);
  }
}

// With the rows U_t, by step, of what elimination left: A's row of step t is U_t plus the U_s before it times factors.
// First the numbers w_t with sum_t w_t U_t = b, then y with sum_t y_t (row of step t) = b.
void LinearSolver::solve_transposed(double* b) {
  const int n = size_;
  double *const w = steps_.data(), *const left = work_.data();
  std::copy_n(b, n, left);
  for (int t = 0, c = n - 1; t < n; ++t, --c) {
    w[t] = left[c] * inverse_pivots_[t];
    subtract(left, rows_[t], w[t], c);
  }
  for (int t = n - 1; t >= 0; --t) {
    b[origin_[t]] = w[t];
    subtract(w, factors(t), w[t], t);
  }
}

}  // namespace graspatlas
