#pragma once

#include <vector>

#include "graspatlas/grasp/patch.hpp"

namespace graspatlas {

/// One direction of a tensor-product B-spline: the degree p and the knots, and with them the basis functions
/// N_i(t), i = 0 ... knots - p - 2, by the recurrence of Cox and de Boor.
class BSplineBasis {
 public:
  static constexpr int kMaxDegree = 9;
  /// At one t the p + 1 basis functions that do not vanish, from N_first on, with their derivatives.
  struct Values {
    int first;
    double value[kMaxDegree + 1], first_derivative[kMaxDegree + 1], second_derivative[kMaxDegree + 1];
  };

  /// `knots` do not descend; an inner knot comes at most p - 1 times, so that the surface's normal is continuous.
  BSplineBasis(int degree, std::vector<double> knots);
  int degree() const { return degree_; }
  const std::vector<double>& knots() const { return knots_; }
  int count() const { return static_cast<int>(knots_.size()) - degree_ - 1; }
  /// Beyond the ends of the domain [knots[p], knots[count]] the polynomials of the end pieces go on.
  void evaluate(double t, Values& out) const;

 private:
  int degree_;
  std::vector<double> knots_;
};

/// o(u, v) = sum over i, j of N_i(u) N_j(v) P_ij, with normal along o_u x o_v. A Bezier patch is the case of knots that
/// are all at the ends. Regular wherever o_u and o_v are independent.
///
/// Source: "Global Optimization of Robotic Grasps", Section II, which takes Bezier patches for eqs (3) and (4).
class BSplinePatch : public Patch {
 public:
  /// `control_points` [u.count() v.count() x 3], the index of v running fastest.
  BSplinePatch(BSplineBasis u, BSplineBasis v, const Eigen::Matrix<double, Eigen::Dynamic, 3>& control_points,
               ParameterUnit unit);
  const BSplineBasis& u() const { return u_; }
  const BSplineBasis& v() const { return v_; }
  const Eigen::Matrix<double, 3, Eigen::Dynamic>& control_points() const { return control_points_; }
  void evaluate(double u, double v, PatchPoint& out) const override;
  ParameterUnit u_unit() const override { return unit_; }
  ParameterUnit v_unit() const override { return unit_; }

 private:
  BSplineBasis u_, v_;
  Eigen::Matrix<double, 3, Eigen::Dynamic> control_points_;
  ParameterUnit unit_;
};

}  // namespace graspatlas
