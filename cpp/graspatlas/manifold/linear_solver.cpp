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
  int c = 0;
  // Two columns at a time: the rows below are read and written once for both.
  for (; c + 1 < n; c += 2) {
    if (!choose_pivot(c, threshold)) return false;
    const double* __restrict first = rows_[c];
    for (int i = c + 1; i < n; ++i) {
      rows_[i][c] *= inverse_pivots_[c];
      rows_[i][c + 1] -= rows_[i][c] * first[c + 1];
    }
    if (!choose_pivot(c + 1, threshold)) return false;
    double* __restrict second = rows_[c + 1];
    for (int j = c + 2; j < n; ++j) second[j] -= second[c] * first[j];
    for (int i = c + 2; i < n; ++i) {
      double* __restrict below = rows_[i];
      const double factor = below[c], other = below[c + 1] * inverse_pivots_[c + 1];
      below[c + 1] = other;
      for (int j = c + 2; j < n; ++j) below[j] = below[j] - factor * first[j] - other * second[j];
    }
  }
  return c == n || choose_pivot(c, threshold);
}

// Swaps the row with the largest number in column c into its place; false when that is too small.
bool LinearSolver::choose_pivot(int c, double threshold) {
  int pivot = c;
  for (int i = c + 1; i < size_; ++i)
    if (std::abs(rows_[i][c]) > std::abs(rows_[pivot][c])) pivot = i;
  if (!(std::abs(rows_[pivot][c]) > threshold)) return false;
  std::swap(rows_[c], rows_[pivot]);
  std::swap(origin_[c], origin_[pivot]);
  determinant_negative_ ^= (pivot != c) != (rows_[c][c] < 0.0);
  inverse_pivots_[c] = 1.0 / rows_[c][c];
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
  permuted_.resize(static_cast<std::size_t>(size_) * columns);
  switch (columns) {
    case 1:
      return solve_columns<1>(B, 1);
    case 2:
      return solve_columns<2>(B, 2);
    case 3:
      return solve_columns<3>(B, 3);
    case 4:
      return solve_columns<4>(B, 4);
    default:
      return solve_columns<0>(B, columns);
  }
}

// Columns is their number where the compiler may know it, else 0.
template <int Columns>
void LinearSolver::solve_columns(double* B, int count) const {
  const int n = size_, columns = Columns > 0 ? Columns : count;
  double* Y = permuted_.data();
  int first = n;  // of the rows of Y that are not zero
  for (int i = 0; i < n; ++i) {
    double* __restrict y = Y + static_cast<std::ptrdiff_t>(i) * columns;
    const double* b = B + static_cast<std::ptrdiff_t>(origin_[i]) * columns;
    std::copy_n(b, columns, y);
    if (first == n && std::any_of(b, b + columns, [](double number) { return number != 0.0; })) first = i;
    for (int j = first; j < i; ++j) {
      const double factor = rows_[i][j];
      const double* __restrict above = Y + static_cast<std::ptrdiff_t>(j) * columns;
      for (int c = 0; c < columns; ++c) y[c] -= factor * above[c];
    }
  }
  for (int i = n - 1; i >= 0; --i) {
    const double* y = Y + static_cast<std::ptrdiff_t>(i) * columns;
    double sums[Columns > 0 ? Columns : 1];
    double* __restrict b = B + static_cast<std::ptrdiff_t>(i) * columns;
    double* __restrict sum = Columns > 0 ? sums : b;
    std::copy_n(y, columns, sum);
    for (int j = i + 1; j < n; ++j) {
      const double factor = rows_[i][j];
      const double* __restrict below = B + static_cast<std::ptrdiff_t>(j) * columns;
      for (int c = 0; c < columns; ++c) sum[c] -= factor * below[c];
    }
    for (int c = 0; c < columns; ++c) b[c] = sum[c] * inverse_pivots_[i];
  }
}

}  // namespace graspatlas
