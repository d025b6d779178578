#include "graspatlas/grasp/derived_patch.hpp"

#include <utility>

namespace graspatlas {

FlippedPatch::FlippedPatch(std::shared_ptr<const Patch> patch) : patch_(std::move(patch)) {}

void FlippedPatch::evaluate(double u, double v, PatchPoint& out) const {
  patch_->evaluate(u, v, out);
  out.m = -out.m;
  out.m_u = -out.m_u;
  out.m_v = -out.m_v;
}

CurvePatch::CurvePatch(std::shared_ptr<const Patch> patch, PiecewiseCubic u, PiecewiseCubic v)
    : patch_(std::move(patch)), u_(std::move(u)), v_(std::move(v)) {}

void CurvePatch::evaluate(double s, double, PatchPoint& out) const {
  const PiecewiseCubic::Value u = u_.evaluate(s), v = v_.evaluate(s);
  patch_->evaluate(u.value, v.value, out);
  const auto along = [&](Eigen::Vector3d& by_u, Eigen::Vector3d& by_v) {
    by_u = u.first_derivative * by_u + v.first_derivative * by_v;
    by_v.setZero();
  };
  along(out.o_u, out.o_v);
  along(out.m_u, out.m_v);
  along(out.a_u, out.a_v);
  along(out.b_u, out.b_v);
}

}  // namespace graspatlas
