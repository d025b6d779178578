#include "graspatlas/grasp/bspline_patch.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "graspatlas/errors.hpp"
#include "graspatlas/grasp/unit_vector.hpp"

namespace graspatlas {

namespace {

// From the d functions of degree d - 1 that do not vanish on the span [knots[span], knots[span + 1]] to the d + 1 of
// degree d: their values at t.
void raise_degree(const double* knots, int span, int d, double t, const double* lower, double* out) {
  for (int j = 0; j <= d; ++j) {
    const int i = span - d + j;
    double sum = 0.0;
    if (j > 0) sum += (t - knots[i]) / (knots[i + d] - knots[i]) * lower[j - 1];
    if (j < d) sum += (knots[i + d + 1] - t) / (knots[i + d + 1] - knots[i + 1]) * lower[j];
    out[j] = sum;
  }
}

// The same for their derivatives: from values to first derivatives, and from these to second ones.
void raise_derivative(const double* knots, int span, int d, const double* lower, double* out) {
  for (int j = 0; j <= d; ++j) {
    const int i = span - d + j;
    double sum = 0.0;
    if (j > 0) sum += lower[j - 1] / (knots[i + d] - knots[i]);
    if (j < d) sum -= lower[j] / (knots[i + d + 1] - knots[i + 1]);
    out[j] = d * sum;
  }
}

}  // namespace

BSplineBasis::BSplineBasis(int degree, std::vector<double> knots) : degree_(degree), knots_(std::move(knots)) {
  if (degree < 1 || degree > kMaxDegree)
    throw Error("the degree of a B-spline must be from 1 to " + std::to_string(kMaxDegree) + ", got " +
                std::to_string(degree));
  const int n = count();
  if (n < degree + 1)
    throw Error("a B-spline of degree " + std::to_string(degree) + " needs at least " + std::to_string(2 * degree + 2) +
                " knots, got " + std::to_string(knots_.size()));
  for (std::size_t i = 0; i < knots_.size(); ++i) {
    if (!std::isfinite(knots_[i])) throw Error("knots must be finite");
    if (i > 0 && knots_[i] < knots_[i - 1]) throw Error("knots must not descend");
  }
  if (!(knots_[degree] < knots_[degree + 1] && knots_[n - 1] < knots_[n]))
    throw Error(
        "the first and the last span of a B-spline's knots must not be empty: of its end knots, degree + 1 at "
        "most may be equal");
  for (int i = degree + 1; i < n; ++i)
    if (std::count(knots_.begin() + degree + 1, knots_.begin() + n, knots_[i]) > degree - 1)
      throw Error("the inner knot " + to_text(knots_[i]) +
                  " comes too often: degree - 1 times at most, so that the normal is continuous");
}

void BSplineBasis::evaluate(double t, Values& out) const {
  const int p = degree_, n = count();
  const auto above = std::upper_bound(knots_.begin() + p + 1, knots_.begin() + n, t);
  const int span = static_cast<int>(above - knots_.begin()) - 1;
  out.first = span - p;
  // Values and first derivatives of the lower degrees, turn by turn in two rows.
  double values[2][kMaxDegree + 1], first_derivatives[kMaxDegree + 1];
  int row = 0;
  values[0][0] = 1.0;
  for (int d = 1; d < p; ++d, row ^= 1) {
    if (d == p - 1) raise_derivative(knots_.data(), span, d, values[row], first_derivatives);
    raise_degree(knots_.data(), span, d, t, values[row], values[row ^ 1]);
  }
  raise_degree(knots_.data(), span, p, t, values[row], out.value);
  raise_derivative(knots_.data(), span, p, values[row], out.first_derivative);
  if (p == 1)
    std::fill_n(out.second_derivative, 2, 0.0);
  else
    raise_derivative(knots_.data(), span, p, first_derivatives, out.second_derivative);
}

BSplinePatch::BSplinePatch(BSplineBasis u, BSplineBasis v,
                           const Eigen::Matrix<double, Eigen::Dynamic, 3>& control_points, ParameterUnit unit)
    : u_(std::move(u)), v_(std::move(v)), control_points_(control_points.transpose()), unit_(unit) {
  const Eigen::Index n = static_cast<Eigen::Index>(u_.count()) * v_.count();
  if (control_points.rows() != n)
    throw Error("these degrees and knots need " + std::to_string(u_.count()) + " x " + std::to_string(v_.count()) +
                " control points, got " + std::to_string(control_points.rows()));
  if (!control_points.allFinite()) throw Error("control points must be finite");
}

void BSplinePatch::evaluate(double u, double v, PatchPoint& out) const {
  using Eigen::Vector3d;
  BSplineBasis::Values Nu, Nv;
  u_.evaluate(u, Nu);
  v_.evaluate(v, Nv);
  Vector3d o_uu, o_uv, o_vv;
  for (Vector3d* sum : {&out.o, &out.o_u, &out.o_v, &o_uu, &o_uv, &o_vv}) sum->setZero();
  for (int i = 0; i <= u_.degree(); ++i) {
    Vector3d row = Vector3d::Zero(), row_v = Vector3d::Zero(), row_vv = Vector3d::Zero();
    const Eigen::Index start = static_cast<Eigen::Index>(Nu.first + i) * v_.count() + Nv.first;
    for (int j = 0; j <= v_.degree(); ++j) {
      const auto P = control_points_.col(start + j);
      row += Nv.value[j] * P;
      row_v += Nv.first_derivative[j] * P;
      row_vv += Nv.second_derivative[j] * P;
    }
    out.o += Nu.value[i] * row;
    out.o_u += Nu.first_derivative[i] * row;
    out.o_v += Nu.value[i] * row_v;
    o_uu += Nu.second_derivative[i] * row;
    o_uv += Nu.first_derivative[i] * row_v;
    o_vv += Nu.value[i] * row_vv;
  }
  const UnitVector a(out.o_u), m(out.o_u.cross(out.o_v));
  out.a = a.value;
  out.m = m.value;
  out.b = m.value.cross(a.value);
  out.a_u = a.derivative(o_uu);
  out.a_v = a.derivative(o_uv);
  out.m_u = m.derivative(o_uu.cross(out.o_v) + out.o_u.cross(o_uv));
  out.m_v = m.derivative(o_uv.cross(out.o_v) + out.o_u.cross(o_vv));
  out.b_u = out.m_u.cross(out.a) + out.m.cross(out.a_u);
  out.b_v = out.m_v.cross(out.a) + out.m.cross(out.a_v);
}

}  // namespace graspatlas
