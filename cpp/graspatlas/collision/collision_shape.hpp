#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

#include "graspatlas/grasp/placement.hpp"

namespace graspatlas {

/// What collides: a primitive about the origin with its axis along z, a convex solid, the triangles of a mesh, or all
/// that lies at z <= 0.
enum class ShapeKind { sphere, capsule, cylinder, box, convex, mesh, half_space };

/// A collision shape and what carries it.
struct CollisionShape {
  std::string name;
  ShapeKind kind = ShapeKind::sphere;
  /// sphere: radius; capsule: radius and distance of the ends' centres; cylinder: radius and length; box: edges [m].
  Eigen::Vector3d sizes = Eigen::Vector3d::Zero();
  std::vector<Eigen::Vector3d> points;        ///< of a convex solid or mesh [m]
  std::vector<std::array<int, 3>> triangles;  ///< of a mesh
  int joint = 0;                              ///< joint that carries the shape; 0 is the fixed base
  Placement placement;                        ///< of the shape in the joint
};

/// A collision shape as a URDF states it.
struct LinkShape : CollisionShape {
  std::string link;
  int parent_joint = 0;  ///< the joint before `joint` in the tree
};

/// Reads the collision shapes of a URDF.
///
/// `tree` is the URDF text whose joints are counted, `urdf` that whose shapes are read, `package_dirs` where
/// package:// paths of meshes are looked up. Throws Error when something cannot be read, or a shape is of a kind that
/// a ShapeKind does not name.
std::vector<LinkShape> read_collision_shapes(const std::string& tree, const std::string& urdf,
                                             const std::vector<std::string>& package_dirs);

/// A shape to look at, as a URDF states it.
struct VisualShape : LinkShape {
  Eigen::Vector4d colour = Eigen::Vector4d::Ones();  ///< red, green, blue, opacity, each 0 to 1
  Placement in_link;                                 ///< of the shape in its link
  Placement at_rest;                                 ///< in the root, all joints at 0
  std::string file;                                  ///< of a mesh
  Eigen::Vector3d scale = Eigen::Vector3d::Ones();   ///< of the mesh in it
};

/// Reads the shapes of a URDF that are to be seen, or its collision shapes where it has none; see above.
std::vector<VisualShape> read_visual_shapes(const std::string& tree, const std::string& urdf,
                                            const std::vector<std::string>& package_dirs);

}  // namespace graspatlas
