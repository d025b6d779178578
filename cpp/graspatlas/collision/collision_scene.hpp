#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "graspatlas/collision/collision_shape.hpp"
#include "graspatlas/grasp/model.hpp"

namespace graspatlas {

/// Two shapes that may collide, and the distance that they must keep [m]; negative is a depth that they may have.
struct CollisionPair {
  int first, second;
  double required;
};

/// Where two shapes are nearest, or deepest in each other. Where two meshes cut each other points and normal are NaN.
struct NearestPoints {
  double distance;                      ///< [m]; negative in collision, but for two meshes
  Eigen::Vector3d on_first, on_second;  ///< in the palm's frame [m]
  Eigen::Vector3d normal;               ///< unit vector from the first shape to the second, of growing distance
};

/// The collision shapes of hand and object, and the pairs that are looked at. It does not change once it is made, so
/// any number of threads may share it; each has a CollisionSpace of its own.
///
/// Its source and that of CollisionSpace is the only one that includes coal, but for the reading of files.
class CollisionScene {
 public:
  /// Throws Error when a shape or pair makes no sense.
  CollisionScene(const Model& model, const std::vector<CollisionShape>& shapes, std::vector<CollisionPair> pairs);
  ~CollisionScene();

  const Model& model() const { return model_; }
  int shape_count() const { return static_cast<int>(carriers_.size()); }
  const std::vector<CollisionPair>& pairs() const { return pairs_; }
  /// Joint that carries a shape.
  int joint(int shape) const { return carriers_[static_cast<std::size_t>(shape)].joint; }

 private:
  friend class CollisionSpace;
  struct Geometries;

  /// A shape's box and ball, which are quick to compare. A half-space has none.
  struct Carrier {
    int joint;
    bool mesh, half_space;
    Placement placement;
    Eigen::Vector3d box_center, box_half;  ///< in the shape's frame [m]
    double radius;                         ///< of the ball about the box's centre [m]
  };

  Model model_;
  std::vector<Carrier> carriers_;
  std::vector<CollisionPair> pairs_;
  std::unique_ptr<const Geometries> geometries_;
};

/// Work space of one thread for the grasps of a scene. What it answers is a function of the scene and the grasp alone,
/// not of what it was asked before.
class CollisionSpace {
 public:
  explicit CollisionSpace(std::shared_ptr<const CollisionScene> scene);
  ~CollisionSpace();

  /// Puts all shapes where a configuration q [model().q_size()] has them; what follows is about it.
  void place(const double* q);

  /// Whether no pair is nearer than it must be.
  bool free();
  /// Number of the first pair that is nearer than it must be, or -1.
  int first_hit();
  /// Whether a pair is nearer than it must be.
  bool hit(int pair);
  /// False when balls or boxes show that a pair is farther apart than `distance` [m]; true says nothing.
  bool may_be_within(int pair, double distance) const;
  /// Nearest points of a pair. Distances of disjoint shapes are exact to kDistanceTolerance, depths to coal's 1e-6 m.
  NearestPoints nearest(int pair);
  /// Distance of a point [palm] from a shape [m]; negative inside, but for meshes.
  double distance_of(const Eigen::Vector3d& point, int shape);

  static constexpr double kDistanceTolerance = 1e-10;

 private:
  struct Solvers;

  bool apart(const CollisionPair& pair) const;
  bool with_half_space(const CollisionPair& pair) const;
  bool ball_above_half_space(const CollisionPair& pair) const;
  NearestPoints nearest_to_half_space(const CollisionPair& pair) const;
  void aim(int pair);

  std::shared_ptr<const CollisionScene> scene_;
  Model model_;
  std::vector<Placement> placements_;     ///< of the shapes
  std::vector<Eigen::Vector3d> centers_;  ///< of their boxes
  std::unique_ptr<Solvers> solvers_;
};

/// Distance of each point from the convex hull of others, 0 inside [m].
std::vector<double> distances_from_hull(const std::vector<Eigen::Vector3d>& points,
                                        const std::vector<Eigen::Vector3d>& corners);

}  // namespace graspatlas
