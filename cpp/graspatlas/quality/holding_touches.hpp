#pragma once

#include <vector>

#include "graspatlas/grasp/grasp_system.hpp"
#include "graspatlas/quality/holding_force.hpp"
#include "graspatlas/quality/touch_program.hpp"

namespace graspatlas {

/// The directions in which a grasp withstands least: where the ball of HoldingForce touches, and where larger ones
/// would next. Each is a local minimum of how far contact forces reach, found to rounding, with its slopes.
///
/// The hull of HoldingForce says where to look: below each minimum there is a facet no farther away, so refined to a
/// gap of a hundredth it leaves few places.
class HoldingTouches {
 public:
  /// A direction with the forces that reach least far in it, in the object's frame. Where grasps are moved, all but the
  /// grasp stays: the slope of the reach is that of the Lagrangian (the envelope theorem).
  struct Touch {
    double force;               ///< the reach [N]
    Eigen::Vector3d direction;  ///< d
    Eigen::Vector3d about;      ///< multipliers of the torques about the centre of mass [1/m]
    double budget;              ///< multiplier of the sum of normal forces [units]
    Matrix forces;              ///< [3 x contacts] shares of the budget
    Matrix sliding;             ///< [3 x contacts] multipliers of the cones, across the normals
    Vector pressing;            ///< [contacts] and along them
    Vector torques;             ///< [contacts] about the normals, of soft fingers [m]
  };

  /// The joints' efforts may not be limited.
  HoldingTouches(GraspSystem& system, HoldingLimits limits);

  /// Those of x up to `share` above the least, the least first; none without force closure.
  const std::vector<Touch>& find(const double* x, double share);

  /// The reaches' Lagrangians at a grasp x near that of the touches [N], in their order: at that grasp their slopes are
  /// those of the reaches.
  void lagrangians(const double* x, const std::vector<Touch>& touches, double* out);

 private:
  void set_program();
  bool known(const TouchProgram::Touch& touch) const;
  Touch touch_of(const TouchProgram::Touch& found) const;

  GraspSystem& system_;
  HoldingLimits limits_;
  HoldingForce holding_;
  TouchProgram program_;
  RowMatrix E_;
  double torque_unit_ = 1.0;  // that divides torques in E [m]
  std::vector<TouchProgram::Touch> found_;
  std::vector<Touch> touches_;
  std::vector<ContactPoint> points_;
};

}  // namespace graspatlas
