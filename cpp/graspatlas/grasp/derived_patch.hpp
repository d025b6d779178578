#pragma once

#include <memory>

#include "graspatlas/grasp/patch.hpp"

namespace graspatlas {

/// Another patch, seen from its other side: the outward normal is the opposite.
class FlippedPatch : public Patch {
 public:
  explicit FlippedPatch(std::shared_ptr<const Patch> patch);
  const std::shared_ptr<const Patch>& patch() const { return patch_; }
  void evaluate(double u, double v, PatchPoint& out) const override;
  ParameterUnit u_unit() const override { return patch_->u_unit(); }
  ParameterUnit v_unit() const override { return patch_->v_unit(); }

 private:
  std::shared_ptr<const Patch> patch_;
};

/// A curve on another patch: o(s) = o(u(s), v(s)), and all else of the patch there. Its first parameter is s, about a
/// length; the second is not used. u and v are piecewise cubics; they should have continuous second derivatives.
class CurvePatch : public Patch {
 public:
  CurvePatch(std::shared_ptr<const Patch> patch, PiecewiseCubic u, PiecewiseCubic v);
  const std::shared_ptr<const Patch>& patch() const { return patch_; }
  const PiecewiseCubic& u() const { return u_; }
  const PiecewiseCubic& v() const { return v_; }
  void evaluate(double s, double unused, PatchPoint& out) const override;
  ParameterUnit u_unit() const override { return ParameterUnit::length; }
  ParameterUnit v_unit() const override { return ParameterUnit::length; }

 private:
  std::shared_ptr<const Patch> patch_;
  PiecewiseCubic u_, v_;
};

}  // namespace graspatlas
