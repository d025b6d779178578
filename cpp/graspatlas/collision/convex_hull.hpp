#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

namespace graspatlas {

/// The convex hull of points in space: its corners, its surface in triangles, and its faces as planes.
struct ConvexHull {
  std::vector<int> corners;                   ///< numbers of the points that are corners, ascending
  std::vector<std::array<int, 3>> triangles;  ///< numbers of the points
  std::vector<Eigen::Vector4d> planes;        ///< n and b of n x + b <= 0, unit outward normals; some more than once
};

/// Computes a convex hull by Qhull. Throws Error when the points, finite numbers, have no volume.
ConvexHull convex_hull_of(const std::vector<Eigen::Vector3d>& points);

}  // namespace graspatlas
