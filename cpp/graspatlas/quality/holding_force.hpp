#pragma once

#include <vector>

#include "graspatlas/grasp/grasp_system.hpp"
#include "graspatlas/quality/contact_program.hpp"
#include "graspatlas/quality/force_closure.hpp"
#include "graspatlas/quality/wrench_hull.hpp"
#include "graspatlas/types.hpp"

namespace graspatlas {

/// What holds the object: friction, a budget of normal force, and the joints.
struct HoldingLimits {
  double friction;                 ///< mu > 0
  double torsional;                ///< gamma >= 0 [m]; see ForceClosure
  double normal_force;             ///< most that the normal forces may add up to [N]; infinite where the joints decide
  Vector efforts;                  ///< most that each actuated joint exerts [N m or N]; infinite for any, or empty
  Eigen::Vector3d center_of_mass;  ///< in the object's frame [m]
  double torque_length;            ///< that divides torques of disturbances [m]; 0 for forces alone
  double gap;                      ///< relative, by which the force found may be less than the largest
};

/// The largest disturbance at the object's centre of mass that a grasp withstands from whatever side [N].
///
///   H = max r  so that for each w, |w| <= r, there are f_i in the friction cones with  G f + w = 0,
///              sum_i n_i . f_i <= budget,  |J' f| <= efforts
///
/// w = (force, torque / length), or forces alone, with no torque about the centre of mass. The disturbances withstood
/// are a convex body about the origin, and H is the radius of the largest ball in it. Contact programmes say how far it
/// reaches in a direction, with points of it; their hull is refined where it is nearest to the origin.
///
/// The result is a ball in that hull, so never more than the grasp withstands, and at most by the relative `gap` less,
/// unless the hull comes to its largest number of facets first; 0 without force closure.
class HoldingForce {
 public:
  HoldingForce(GraspSystem& system, HoldingLimits limits);

  /// H at x [N].
  double largest(const double* x);

  /// A facet of the hull that `largest` has refined, and forces that reach to its point nearest to the origin.
  struct Side {
    double distance;   ///< of its plane [units]
    Vector direction;  ///< its unit normal
    Vector z;          ///< coordinates of the forces, strictly inside the cones and the budget
  };
  /// Those of the last hull that are at most so far from the origin [units], the nearest first.
  std::vector<Side> sides_within(double distance) const;

  double unit() const { return unit_; }                    ///< of forces [N]
  const RowMatrix& wrenches() const { return wrenches_; }  ///< [object_dof x z] about the centre of mass
  const Eigen::Matrix3d& object_rotation() const { return rotation_; }
  const std::vector<ContactPoint>& points() const { return closure_.points(); }
  int directions() const { return directions_; }  ///< of a force: three, in the plane two
  int cone_size() const { return cone_size_; }    ///< coordinates of a contact's force

  /// The largest force along a unit vector [space_dimension] in the object's frame, at its centre of mass, that the
  /// grasp withstands [N], to one part in a million; NaN where rounding leaves it less certain.
  double along(const double* x, const double* direction);

 private:
  bool prepare(const double* x);
  void set_contact(int c, const Eigen::Vector3d& center);
  void set_program(const RowMatrix& equations);
  template <int D>
  double ball_radius(WrenchHull<D>& hull);
  template <int D>
  std::vector<Side> sides_within(const WrenchHull<D>& hull, double distance) const;

  GraspSystem& system_;
  HoldingLimits limits_;
  ForceClosure closure_;
  int directions_, cone_size_;
  std::vector<int> limited_;  // joints that have an effort
  ForceClosure::Forces inner_;
  double unit_ = 1.0;            // of forces [N]: the budget, or where the first joint comes to its effort
  RowMatrix wrenches_;           // [dof x contacts cone_size]: of the unit coordinates z, about the centre of mass
  RowMatrix spins_;              // see GraspSystem::normal_spins
  RowMatrix efforts_;            // [limited joints x contacts cone_size]: shares of the efforts
  Eigen::Matrix3d rotation_;     // of the object
  Vector z_, y_;                 // inner forces as z, and as y of the programme
  RowMatrix basis_, reach_map_;  // z = basis y; disturbance = reach_map y
  ContactProgram program_;
  Matrix optima_;  // y of the hull's points
  WrenchHull<2> hull2_;
  WrenchHull<3> hull3_;
  WrenchHull<6> hull6_;
};

}  // namespace graspatlas
