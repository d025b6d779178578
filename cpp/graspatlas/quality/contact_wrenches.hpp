#pragma once

#include <vector>

#include "graspatlas/grasp/grasp_system.hpp"
#include "graspatlas/types.hpp"

namespace graspatlas {

/// Friction pyramids of normal force one, with which wrenches of contacts are made.
struct Pyramids {
  double friction;   ///< mu > 0
  int edges;         ///< three or more; in the plane a cone has two
  double torsional;  ///< gamma >= 0 [m]: soft fingers also have the normal force with the largest torque either way
  double length;     ///< that divides torques [m]
};

/// Wrenches of the edges of a grasp's friction pyramids, at the object's origin and in its frame; the same as
/// quality/wrenches.py makes.
class ContactWrenches {
 public:
  ContactWrenches(GraspSystem& system, const Pyramids& pyramids);

  int components() const { return planar_ ? 3 : 6; }
  int count() const { return static_cast<int>(wrenches_.cols()); }

  /// A wrench in each column [components x count], at a grasp x; the next call writes to the same place.
  const Matrix& at(const double* x);

 private:
  void write_planar(const Eigen::Vector3d& arm, const Eigen::Vector3d& normal, Eigen::Index first);
  void write(const Eigen::Vector3d& arm, const Eigen::Vector3d& normal, Eigen::Index first);

  GraspSystem& system_;
  Pyramids pyramids_;
  bool planar_;
  int per_contact_;
  std::vector<ContactPoint> points_;
  Matrix wrenches_;
};

}  // namespace graspatlas
