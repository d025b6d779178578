#pragma once

#include "graspatlas/grasp/patch.hpp"

namespace graspatlas {

/// A ring of radius R about y of the placement, with a tube of radius r: o(u, v) = (R + r cos v) e(u) + r sin v e_y,
/// e(u) = cos u e_x + sin u e_z. Its outward normal is cos v e(u) + sin v e_y. A sphere is the case R = 0; u is then
/// the longitude and v the latitude. Regular wherever R + r cos v > 0.
class TorusPatch : public Patch {
 public:
  TorusPatch(const Placement& placement, double ring_radius, double tube_radius);
  const Placement& placement() const { return placement_; }
  double ring_radius() const { return ring_radius_; }
  double tube_radius() const { return tube_radius_; }
  void evaluate(double u, double v, PatchPoint& out) const override;
  ParameterUnit u_unit() const override { return ParameterUnit::angle; }
  ParameterUnit v_unit() const override { return ParameterUnit::angle; }

 private:
  Placement placement_;
  double ring_radius_, tube_radius_;
};

/// An ellipsoid with semi-axes A, B, C along e_x, e_y, e_z of the placement: o(u, v) = (A cos v cos u, B sin v, C cos v
/// sin u), with outward normal along (cos v cos u / A, sin v / B, cos v sin u / C). Regular wherever cos v > 0.
class EllipsoidPatch : public Patch {
 public:
  EllipsoidPatch(const Placement& placement, const Eigen::Vector3d& semi_axes);
  const Placement& placement() const { return placement_; }
  const Eigen::Vector3d& semi_axes() const { return semi_axes_; }
  void evaluate(double u, double v, PatchPoint& out) const override;
  ParameterUnit u_unit() const override { return ParameterUnit::angle; }
  ParameterUnit v_unit() const override { return ParameterUnit::angle; }

 private:
  Placement placement_;
  Eigen::Vector3d semi_axes_;
};

}  // namespace graspatlas
