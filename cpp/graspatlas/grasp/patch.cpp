#include "graspatlas/grasp/patch.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "graspatlas/continuation/system.hpp"

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
    : placement_(placement), breaks_(std::move(breaks)), coefficients_(coefficients) {
  if (coefficients_.rows() < 1 || static_cast<Eigen::Index>(breaks_.size()) != coefficients_.rows() + 1)
    throw Error("an outline of n pieces needs n + 1 breaks; got " + std::to_string(coefficients_.rows()) +
                " pieces and " + std::to_string(breaks_.size()) + " breaks");
  for (std::size_t i = 1; i < breaks_.size(); ++i)
    if (!(breaks_[i - 1] < breaks_[i])) throw Error("the breaks of an outline must ascend");
}

void RevolutionPatch::evaluate(double u, double v, PatchPoint& out) const {
  // Outside the outline the end pieces go on: Newton may pass there on its way.
  Eigen::Index piece = 0;
  if (coefficients_.rows() > 1) {
    const auto above = std::upper_bound(breaks_.begin() + 1, breaks_.end() - 1, v);
    piece = above - breaks_.begin() - 1;
  }
  const auto c = coefficients_.row(piece);
  const double s = v - breaks_[static_cast<std::size_t>(piece)];
  const double r = c(0) + s * (c(1) + s * (c(2) + s * c(3)));
  const double slope = c(1) + s * (2.0 * c(2) + s * 3.0 * c(3));
  const double bend = 2.0 * c(2) + 6.0 * s * c(3);
  const double cosine = std::cos(u), sine = std::sin(u);
  const double w = 1.0 / std::sqrt(1.0 + slope * slope);
  const double turn = bend * w * w;  // rate at which the meridian's direction turns with v

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
