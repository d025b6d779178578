#pragma once

#include <vector>

namespace graspatlas {

/// LU factorisation with partial pivoting of one square matrix after another of the same small size.
///
/// Matrices of 10 to 40 rows are factorised millions of times, so the storage is kept and rows are
/// contiguous.
class LinearSolver {
 public:
  explicit LinearSolver(int size);

  /// Row i of the matrix to factorise next; fill all rows, then call factorize().
  double* row(int i) { return &storage_[static_cast<std::size_t>(i) * stride_]; }

  /// False when the matrix is singular to working precision, relative to its largest entry.
  bool factorize();

  /// Solve A y = b in place with the last factorisation.
  void solve(double* b) const;

  /// Solve A' y = b in place.
  void solve_transposed(double* b) const;

  /// True when the determinant of the last matrix is negative.
  bool determinant_negative() const { return determinant_negative_; }

  /// Solve A Y = B in place for `columns` right-hand sides; B is row-major [size x columns].
  void solve(double* B, int columns) const;

 private:
  bool choose_pivot(int c, double threshold);
  template <int Columns>
  void solve_columns(double* B, int count) const;

  int size_, stride_;
  bool determinant_negative_ = false;
  std::vector<double> storage_;
  std::vector<double*> rows_;  // rows in pivoted order
  std::vector<int> origin_;    // origin_[i]: index of the original row that stands at i
  std::vector<double> inverse_pivots_;
  mutable std::vector<double> permuted_;
};

}  // namespace graspatlas
