#pragma once

#include <Eigen/Core>
#include <vector>

#include "graspatlas/grasp/piecewise_cubic.hpp"
#include "graspatlas/grasp/placement.hpp"

namespace graspatlas {

/// A patch at one (u, v): the point o, the outward unit normal m and two unit tangents a, b that are normal
/// to m, each with its derivatives by u and v. Eqs (3) and (4) of the paper.
struct PatchPoint {
  Eigen::Vector3d o, m, a, b;
  Eigen::Vector3d o_u, m_u, a_u, b_u;
  Eigen::Vector3d o_v, m_v, a_v, b_v;
};

/// What a patch's parameter measures: a length [m], an angle [rad], or a pure number, which counts as much as as many
/// radians.
enum class ParameterUnit { length, angle, number };

/// A parametrised piece of surface in the frame of the body that carries it. The identities that must hold:
/// a, b, m are orthonormal, o_u and o_v are normal to m.
class Patch {
 public:
  virtual ~Patch() = default;
  virtual void evaluate(double u, double v, PatchPoint& out) const = 0;
  virtual ParameterUnit u_unit() const = 0;
  virtual ParameterUnit v_unit() const = 0;
};

/// o(u, v) = u e_x + v e_z + 0 e_y in the placement, with normal e_y. A fixed point is a plane with u and v
/// frozen.
class PlanePatch : public Patch {
 public:
  explicit PlanePatch(const Placement& placement);
  const Placement& placement() const { return placement_; }
  void evaluate(double u, double v, PatchPoint& out) const override;
  ParameterUnit u_unit() const override { return ParameterUnit::length; }
  ParameterUnit v_unit() const override { return ParameterUnit::length; }

 private:
  Placement placement_;
};

/// o(u, v) = (r(v) cos u, v, r(v) sin u) in the placement, with outward normal (cos u, -r', sin u) / sqrt(1 +
/// r'^2).
///
/// r is a piecewise cubic, so cylinders and cones are the cases of one constant or linear piece. It should have a
/// continuous second derivative, for Newton's sake.
class RevolutionPatch : public Patch {
 public:
  /// `breaks` ascend, one more than there are rows of `coefficients` [pieces x 4].
  RevolutionPatch(const Placement& placement, std::vector<double> breaks,
                  const Eigen::Matrix<double, Eigen::Dynamic, 4>& coefficients);
  const Placement& placement() const { return placement_; }
  const PiecewiseCubic& outline() const { return outline_; }
  void evaluate(double u, double v, PatchPoint& out) const override;
  ParameterUnit u_unit() const override { return ParameterUnit::angle; }
  ParameterUnit v_unit() const override { return ParameterUnit::length; }

 private:
  Placement placement_;
  PiecewiseCubic outline_;
};

}  // namespace graspatlas
