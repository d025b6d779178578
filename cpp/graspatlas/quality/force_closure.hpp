#pragma once

#include "graspatlas/grasp/grasp_system.hpp"

namespace graspatlas {

/// Force closure of grasps with hard fingers: contact forces f_i within friction cones, G mapping them to the wrench.
///
/// A grasp is force-closed when G has full rank and some internal forces, G f = 0, lie strictly inside all cones. The
/// margin says how strictly: with normal forces that add up to one,
///
///   margin = max over f of  min over i of  (mu n_i . f_i - |f_i - (n_i . f_i) n_i|) / sqrt(1 + mu^2),
///
/// the distance from the nearest cone's surface. It is a small second-order cone programme in the null space of G,
/// which a barrier method solves with the cones as they are, not as pyramids.
class ForceClosure {
 public:
  /// `friction` is mu > 0.
  ForceClosure(GraspSystem& system, double friction);

  /// The margin at x; zero when the grasp is not force-closed.
  double margin(const double* x);

 private:
  bool internal_forces();
  double widest_margin();

  GraspSystem& system_;
  double friction_;
  int force_size_;  // components of a contact force: three, in the plane two
  RowMatrix J_, Gt_;
  Matrix normals_;     // force_size x contacts: into the object
  Matrix basis_;       // of the internal forces with no total normal force, one a column
  Vector particular_;  // internal forces with total normal force one
  std::vector<ContactPoint> points_;
};

}  // namespace graspatlas
