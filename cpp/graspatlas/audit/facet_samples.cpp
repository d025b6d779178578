#include "graspatlas/audit/facet_samples.hpp"

#include <algorithm>
#include <cmath>

namespace graspatlas {

void FacetSamples::take(const Polytope& polytope, int facet, double radius) {
  k_ = polytope.dimension();
  points_.assign(static_cast<std::size_t>(k_), 0.0);
  corners_.clear();
  int count = 0;
  for (int v = 0; v < polytope.vertex_count(); ++v) {
    const double* u = polytope.vertex(v);
    double off = -polytope.offset(facet);
    for (int c = 0; c < k_; ++c) off += polytope.normal(facet)[c] * u[c];
    if (std::abs(off) > kOnFacet * radius) continue;
    ++count;
    corners_.insert(corners_.end(), u, u + k_);
    for (int c = 0; c < k_; ++c) points_[c] += u[c];
  }
  for (int c = 0; c < k_; ++c) points_[c] /= std::max(count, 1);
  const int kept = std::min(count, kMostCorners);
  for (int i = 0; i < kept; ++i) {
    const double* corner = &corners_[static_cast<std::size_t>(i * count / kept) * k_];
    for (const double share : {1.0 / 3.0, 2.0 / 3.0})
      for (int c = 0; c < k_; ++c) points_.push_back(points_[c] + share * (corner[c] - points_[c]));
  }
}

}  // namespace graspatlas
