#pragma once

#include <eiquadprog/eiquadprog-fast.hpp>
#include <vector>

#include "graspatlas/climb/measure.hpp"
#include "graspatlas/types.hpp"

namespace graspatlas {

/// A linear model that holds a little away from the current grasp: of the index, or of the slack of a requirement.
struct Cut {
  bool of_index;
  double value;  ///< at the current grasp, of the index less that of the grasp
  Vector slopes;
  Vector at;  ///< where it was made, in tangent coordinates of the current grasp
};

/// The step of a climb in tangent coordinates w, from a quadratic programme that always has a solution:
///
///   maximise  v - w' B w / 2 - penalty t
///   so that   v <= g . w, and the index's cuts,   c_i + a_i . w + t >= 0,   t >= 0,   |w|_inf <= trust radius
///
/// with the slope g of the index, and the slacks c_i and their slopes a_i. What requirements miss is t, so a step
/// towards them is found where they cannot be met at once. Where the current grasp meets them t is left out.
class StepProgram {
 public:
  explicit StepProgram(int dimension);

  /// B [k x k] positive definite, g [k], rows of slacks, cuts; a penalty of 0 leaves t out. False when rounding defeats
  /// the solver.
  bool solve(const Matrix& B, const Vector& g, const Rows& slacks, const std::vector<Cut>& cuts, double trust_radius,
             double penalty);

  const Vector& w() const { return w_; }
  double missed() const { return missed_; }              ///< t
  const Vector& multipliers() const { return lambda_; }  ///< of the slacks [rows]
  /// g + sum_i lambda_i a_i, with cuts in the place of what they cut: what no requirement holds back of the slope.
  const Vector& left_over() const { return left_over_; }
  double model_gain() const { return gain_; }  ///< v - w' B w / 2

 private:
  int k_;
  eiquadprog::solvers::EiquadprogFast solver_;
  Matrix hessian_, rows_;
  Vector linear_, right_, solution_, w_, lambda_, left_over_, no_right_;
  Matrix no_rows_;
  std::vector<int> source_;
  double missed_ = 0.0, gain_ = 0.0;
};

}  // namespace graspatlas
