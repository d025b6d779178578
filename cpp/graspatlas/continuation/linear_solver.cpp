#include "graspatlas/continuation/linear_solver.hpp"

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
      permuted_(size) {}

bool LinearSolver::factorize() {
  const int n = size_;
  double largest = 0.0;
  for (int i = 0; i < n; ++i) {
    rows_[i] = row(i);
    origin_[i] = i;
    for (int j = 0; j < n; ++j) largest = std::max(largest, std::abs(rows_[i][j]));
  }
  const double threshold = kSingular * largest;
  for (int c = 0; c < n; ++c) {
    int pivot = c;
    for (int i = c + 1; i < n; ++i)
      if (std::abs(rows_[i][c]) > std::abs(rows_[pivot][c])) pivot = i;
    if (!(std::abs(rows_[pivot][c]) > threshold)) return false;
    std::swap(rows_[c], rows_[pivot]);
    std::swap(origin_[c], origin_[pivot]);
    const double* __restrict top = rows_[c];
    const double inverse = 1.0 / top[c];
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

void LinearSolver::solve(double* b) const {
  const int n = size_;
  double* y = permuted_.data();
  for (int i = 0; i < n; ++i) {
    double sum = b[origin_[i]];
    for (int j = 0; j < i; ++j) sum -= rows_[i][j] * y[j];
    y[i] = sum;
  }
  for (int i = n - 1; i >= 0; --i) {
    double sum = y[i];
    for (int j = i + 1; j < n; ++j) sum -= rows_[i][j] * b[j];
    b[i] = sum / rows_[i][i];
  }
}

}  // namespace graspatlas
