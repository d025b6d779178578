#pragma once

#include <Eigen/LU>

#include "graspatlas/types.hpp"

namespace graspatlas {

/// Where a ball about the origin touches the body that contact forces reach: of all directions nearby the one in which
/// they reach least far.
///
///   t = min over d, |d| = 1,  of  max { d . E_d z  :  E_w z = 0,  z_i in the cone |(z_1, ..., z_s)| <= z_0,  sum_i
///   z_i0 <= 1 }
///
/// With multipliers w of the equations, v = (d, w) and E = (E_d; E_w) a local minimum has
///
///   E z = rho (d, 0),   sum_i z_i0 = 1,   |d| = 1,   z_i o l_i = mu e,   l_i = t e - E_i' v  in the cone too,
///
/// o the Jordan product of cones and mu = 0. Newton's method follows these from a large mu to none: unlike a barrier it
/// keeps forces and multipliers, so both are found to rounding.
///
/// Source: F. Alizadeh, D. Goldfarb, "Second-order cone programming", Mathematical Programming 95 (2003).
class TouchProgram {
 public:
  /// Such a direction with its forces and their multipliers.
  struct Touch {
    double reach;        ///< t
    Vector v;            ///< d, and w
    Vector z;            ///< coordinates of the contact forces
    Vector multipliers;  ///< l
  };

  /// `E` [ball_size + equations x contacts cone_size]; both must outlive their use.
  void set(const RowMatrix& E, int cone_size, int ball_size);

  /// The touch near a direction [ball_size], from forces z strictly inside their cones; false when it is not found.
  bool find(const Vector& direction, const Vector& z, Touch& out);

  /// What is taken for a touch where none is found: the direction with its reach, and multipliers that suit the forces.
  Touch guess(const Vector& direction, const Vector& z, double reach);

 private:
  void start(const Vector& direction, const Vector& z);
  void set_multipliers();
  double complementarity() const { return z_.dot(l_) / contacts_; }
  bool newton_step(double mu);
  double step_length(const Vector& point, const Vector& step) const;

  const RowMatrix* E_ = nullptr;
  int contacts_ = 0, cone_size_ = 0, ball_size_ = 0;
  double t_ = 0.0, rho_ = 0.0;
  double left_ = 0.0, last_length_ = 0.0;  // of the equations, and how long the last step was
  Vector v_, z_, l_;
  Vector right_, step_, dl_;
  Matrix system_;
  Eigen::PartialPivLU<Matrix> lu_;
};

}  // namespace graspatlas
