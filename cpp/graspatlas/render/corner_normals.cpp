#include "graspatlas/render/corner_normals.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>

namespace graspatlas {

using Eigen::Vector3d;

std::vector<Vector3d> corner_normals(const std::vector<Vector3d>& points,
                                     const std::vector<std::array<int, 3>>& triangles, double crease) {
  const std::size_t corners = 3 * triangles.size();
  std::vector<Vector3d> normals(triangles.size()), out(corners);
  std::vector<double> angles(corners);
  std::vector<std::size_t> first(points.size() + 1, 0), around(corners);  // corners by their vertex
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    const auto& triangle = triangles[t];
    std::array<Vector3d, 3> sides;
    for (int k = 0; k < 3; ++k) sides[k] = points[triangle[(k + 1) % 3]] - points[triangle[k]];
    normals[t] = sides[0].cross(sides[1]).normalized();
    for (int k = 0; k < 3; ++k) {
      const double cosine = -sides[k].normalized().dot(sides[(k + 2) % 3].normalized());
      angles[3 * t + k] = std::acos(std::clamp(cosine, -1.0, 1.0));
      ++first[triangle[k] + 1];
    }
  }
  std::partial_sum(first.begin(), first.end(), first.begin());
  std::vector<std::size_t> next(first.begin(), first.end() - 1);
  for (std::size_t c = 0; c < corners; ++c) around[next[triangles[c / 3][c % 3]]++] = c;
  const double least = std::cos(crease);
  for (std::size_t c = 0; c < corners; ++c) {
    const int vertex = triangles[c / 3][c % 3];
    Vector3d sum = Vector3d::Zero();
    for (std::size_t i = first[vertex]; i < first[vertex + 1]; ++i) {
      const Vector3d& other = normals[around[i] / 3];
      if (other.dot(normals[c / 3]) > least) sum += angles[around[i]] * other;
    }
    out[c] = sum.normalized();
  }
  return out;
}

}  // namespace graspatlas
