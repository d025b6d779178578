#pragma once

#include <vector>

namespace graspatlas {

/// LU factorisation with partial pivoting of one square matrix after another of the same small size.
///
/// Matrices of 10 to 40 rows are factorised millions of times. Columns are eliminated from the last to the first, so
/// that what is left of each row begins where the row does, and rows are as long as whole vectors of the processor: no
/// loop has a rest. Rows that are zero in a column are passed over. So a matrix costs least whose last columns belong
/// to few rows each, like those of a contact's parameters, and whose other rows, being smaller, are no pivots there.
class LinearSolver {
 public:
  explicit LinearSolver(int size);

  /// Row i of the matrix to factorise next; fill all rows, then call factorize(). Entries should be at most about one.
  double* row(int i) { return &storage_[static_cast<std::size_t>(i) * 2 * stride_]; }

  /// False when the matrix is singular to working precision.
  bool factorize();

  /// Solve A y = b in place with the last factorisation.
  void solve(double* b);

  /// Solve A' y = b in place.
  void solve_transposed(double* b);

  /// True when the determinant of the last matrix is negative.
  bool determinant_negative() const { return determinant_negative_; }

 private:
  void take_pivot(int step, int column, int pivot);
  double* factors(int step) { return rows_[step] + stride_; }
  double* factors_of_step(int step) { return &by_pivot_[static_cast<std::size_t>(step) * stride_]; }
  double* entries_of_column(int column) { return &by_column_[static_cast<std::size_t>(column) * stride_]; }

  int size_, stride_;
  bool determinant_negative_ = false;
  // Of each row what is left of it at its step, then the factors by which the pivots before were taken from it; and the
  // same by columns: the factors of each step by row, what is left in each column by step.
  std::vector<double> storage_, by_pivot_, by_column_;
  std::vector<double*> rows_;  // in the order of their steps
  std::vector<int> origin_;    // origin_[t]: index of the row whose pivot step t takes
  std::vector<double> inverse_pivots_;
  std::vector<double> work_, steps_;  // [stride]
};

}  // namespace graspatlas
