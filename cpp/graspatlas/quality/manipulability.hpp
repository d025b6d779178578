#pragma once

#include "graspatlas/grasp/grasp_system.hpp"
#include "graspatlas/types.hpp"

namespace graspatlas {

/// Semi-axes of the manipulability ellipsoid of grasps (Bicchi and Prattichizzo 2000; Section V of the
/// paper).
///
/// J maps joint velocities to the velocities of the contact points, G maps contact forces to the object's
/// wrench. An object velocity t and the least joint velocity J+ G' t that gives it belong together on the
/// coordinated motions, those with G' t in the range of J. The ellipsoid holds the object velocities of unit
/// joint velocity: its semi-axes are the inverses of the singular values of J+ G' there. Object velocities
/// that the hand cannot give have semi-axis zero.
class Manipulability {
 public:
  /// `length_unit` [m]: the unit of the lengths in the object's velocity, 0.001 for millimetres.
  Manipulability(GraspSystem& system, double length_unit);

  /// Ascending semi-axes at x [object_dof]; all zero when the grasp is indeterminate (G has lost rank, so
  /// that the object can move with the joints locked).
  void semi_axes(const double* x, double* out);

  /// Dimension of the coordinated motions of the object at x: the number of semi-axes that are not zero.
  int connectivity(const double* x);

 private:
  GraspSystem& system_;
  double length_unit_;
  RowMatrix J_, Gt_;
};

}  // namespace graspatlas
