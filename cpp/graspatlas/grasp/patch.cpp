#include "graspatlas/grasp/patch.hpp"

#include <cmath>
#include <utility>

namespace graspatlas {

PlanePatch::PlanePatch(const Placement& placement) : placement_(placement) {}

void PlanePatch::evaluate(double u, double v, PatchPoint& out) const {
  const Eigen::Matrix3d& E = placement_.rotation;
  out.a = E.col(0);
  out.b = E.col(2);
  out.m = E.col(1);
  out.o = placement_.translation + u * out.a + v * out.b;
  out.o_u = out.a;
  out.o_v = out.b;
  out.m_u.setZero();
  out.m_v.setZero();
  out.a_u.setZero();
  out.a_v.setZero();
  out.b_u.setZero();
  out.b_v.setZero();
}

RevolutionPatch::RevolutionPatch(const Placement& placement, std::vector<double> breaks,
                                 const Eigen::Matrix<double, Eigen::Dynamic, 4>& coefficients)
    : placement_(placement), outline_(std::move(breaks), coefficients, "an outline") {}

void RevolutionPatch::evaluate(double u, double v, PatchPoint& out) const {
  const auto [r, slope, second_derivative] = outline_.evaluate(v);
  const double cosine = std::cos(u), sine = std::sin(u);
  const double w = 1.0 / std::sqrt(1.0 + slope * slope);
  const double turn = second_derivative * w * w;  // rate at which the meridian's direction turns with v

  const Eigen::Matrix3d& E = placement_.rotation;
  const Eigen::Vector3d radial = cosine * E.col(0) + sine * E.col(2);
  out.a = cosine * E.col(2) - sine * E.col(0);
  out.m = w * (radial - slope * E.col(1));
  out.b = w * (slope * radial + E.col(1));
  out.o = placement_.translation + r * radial + v * E.col(1);
  out.o_u = r * out.a;
  out.o_v = slope * radial + E.col(1);
  out.a_u = -radial;
  out.a_v.setZero();
  out.m_u = w * out.a;
  out.m_v = -turn * out.b;
  out.b_u = w * slope * out.a;
  out.b_v = turn * out.m;
}

}  // namespace graspatlas
