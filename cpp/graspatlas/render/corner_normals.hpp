#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

namespace graspatlas {

/// Unit normals at the corners of each triangle [t x 3], averaged over the triangles round the vertex that meet this
/// one at less than `crease` [rad], weighted by their angles there. Every vertex number must lie below the number of
/// points, and no triangle may have zero area.
std::vector<Eigen::Vector3d> corner_normals(const std::vector<Eigen::Vector3d>& points,
                                            const std::vector<std::array<int, 3>>& triangles, double crease);

}  // namespace graspatlas
