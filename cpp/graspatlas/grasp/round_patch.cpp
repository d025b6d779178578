#include "graspatlas/grasp/round_patch.hpp"

#include <Eigen/Geometry>
#include <cmath>

#include "graspatlas/errors.hpp"
#include "graspatlas/grasp/unit_vector.hpp"

namespace graspatlas {

TorusPatch::TorusPatch(const Placement& placement, double ring_radius, double tube_radius)
    : placement_(placement), ring_radius_(ring_radius), tube_radius_(tube_radius) {
  if (!(ring_radius >= 0.0 && tube_radius > 0.0 && std::isfinite(ring_radius) && std::isfinite(tube_radius)))
    throw Error("a torus needs a ring radius of at least 0 and a positive tube radius");
}

void TorusPatch::evaluate(double u, double v, PatchPoint& out) const {
  const double cos_u = std::cos(u), sin_u = std::sin(u), cos_v = std::cos(v), sin_v = std::sin(v);
  const Eigen::Matrix3d& E = placement_.rotation;
  const Eigen::Vector3d radial = cos_u * E.col(0) + sin_u * E.col(2);
  out.a = cos_u * E.col(2) - sin_u * E.col(0);
  out.m = cos_v * radial + sin_v * E.col(1);
  out.b = cos_v * E.col(1) - sin_v * radial;
  out.o = placement_.translation + ring_radius_ * radial + tube_radius_ * out.m;
  out.a_u = -radial;
  out.a_v.setZero();
  out.m_u = cos_v * out.a;
  out.m_v = out.b;
  out.b_u = -sin_v * out.a;
  out.b_v = -out.m;
  out.o_u = (ring_radius_ + tube_radius_ * cos_v) * out.a;
  out.o_v = tube_radius_ * out.b;
}

EllipsoidPatch::EllipsoidPatch(const Placement& placement, const Eigen::Vector3d& semi_axes)
    : placement_(placement), semi_axes_(semi_axes) {
  if (!(semi_axes.allFinite() && semi_axes.minCoeff() > 0.0))
    throw Error("the semi-axes of an ellipsoid must be positive");
}

void EllipsoidPatch::evaluate(double u, double v, PatchPoint& out) const {
  using Eigen::Vector3d;
  const double cos_u = std::cos(u), sin_u = std::sin(u), cos_v = std::cos(v), sin_v = std::sin(v);
  const double A = semi_axes_.x(), B = semi_axes_.y(), C = semi_axes_.z();
  // The direction of o_u, free of its factor cos v, and the gradient of the implicit equation.
  const UnitVector a(Vector3d(-A * sin_u, 0.0, C * cos_u));
  const UnitVector m(Vector3d(cos_v * cos_u / A, sin_v / B, cos_v * sin_u / C));
  const Vector3d a_u = a.derivative(Vector3d(-A * cos_u, 0.0, -C * sin_u));
  const Vector3d m_u = m.derivative(Vector3d(-cos_v * sin_u / A, 0.0, cos_v * cos_u / C));
  const Vector3d m_v = m.derivative(Vector3d(-sin_v * cos_u / A, cos_v / B, -sin_v * sin_u / C));

  const Eigen::Matrix3d& E = placement_.rotation;
  out.o = placement_.translation + E * Vector3d(A * cos_v * cos_u, B * sin_v, C * cos_v * sin_u);
  out.o_u = E * Vector3d(-A * cos_v * sin_u, 0.0, C * cos_v * cos_u);
  out.o_v = E * Vector3d(-A * sin_v * cos_u, B * cos_v, -C * sin_v * sin_u);
  out.a = E * a.value;
  out.m = E * m.value;
  out.b = E * a.value.cross(m.value);
  out.a_u = E * a_u;
  out.a_v.setZero();
  out.m_u = E * m_u;
  out.m_v = E * m_v;
  out.b_u = E * (a_u.cross(m.value) + a.value.cross(m_u));
  out.b_v = E * a.value.cross(m_v);
}

}  // namespace graspatlas
