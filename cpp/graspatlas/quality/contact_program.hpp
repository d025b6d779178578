#pragma once

#include "graspatlas/types.hpp"

namespace graspatlas {

/// How far contact forces reach in a direction: a second-order cone programme, solved from one inside point to the
/// next.
///
///   maximise c . y  so that  z_i(y) in the cone |(z_1, ..., z_s)| <= z_0 for each contact i,  sum_i z_i0 <= 1,
///                            |r_j . y| <= 1 for each limit j
///
/// The coordinates z_i of a contact's force are linear in y; y spans the forces that meet the equations there are. A
/// barrier method with exact line search stays strictly inside, so that each of its points can be exerted; and as soon
/// as a Newton step is short it gives a dual point too, which bounds the maximum from above. Both bounds hold whatever
/// the centring left over.
class ContactProgram {
 public:
  /// What the maximum lies between.
  struct Bounds {
    double lower, upper;
  };

  /// `rows` [contacts cone_size x n]: z in terms of y. `limits` [l x n]: the rows r_j. `budget`: the bound of the sum.
  void set(const RowMatrix& rows, int cone_size, const RowMatrix& limits, double budget);

  /// Takes y for the point to start from; false when it is not strictly inside.
  bool start(const Vector& y);

  /// Goes to the centre of what the forces reach, the least of the barrier.
  void center();

  /// Improves the point until the bounds are within `relative_gap` of each other, or it reaches as far as `enough`.
  Bounds maximize(const Vector& c, double relative_gap, double enough);

  const Vector& y() const { return y_; }

  /// E H^-1 E' with the Hessian of the barrier at the point, for the linear map E [d x n]: by the shape of the Dikin
  /// ellipsoid, which lies inside what the forces reach.
  Matrix dikin_shape(const RowMatrix& E);

 private:
  struct Quadratic {
    double a0, a1, a2;
  };

  double inside() const;
  void linearize();
  template <int N>
  void linearize_sized();
  template <int N>
  void factorize_sized();
  void solve(const Vector& right, Vector& out);
  Quadratic along_step(int i) const;
  double way_out() const;
  double line_search(double slope);

  int contacts_ = 0, cone_size_ = 0;
  double parameter_ = 0.0;  // of the barrier
  RowMatrix rows_, limits_;
  Vector budget_row_;
  RowMatrix curvatures_;  // of each contact's cone, n x n flat
  Vector y_, z_, v_, gradient_, along_, center_, step_, dz_, dv_, normal_;
  double budget_left_ = 0.0;
  RowMatrix hessian_, factor_;
};

}  // namespace graspatlas
