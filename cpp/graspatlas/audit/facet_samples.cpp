#include "graspatlas/audit/facet_samples.hpp"

#include <algorithm>
#include <cmath>

#include "graspatlas/manifold/tangent.hpp"

namespace graspatlas {

void FacetSamples::take(const Polytope& polytope, int facet, double radius) {
  k_ = polytope.dimension();
  points_.clear();
  corners_.clear();
  if (polytope.listed() == Polytope::Listed::all)
    find_corners(polytope, facet, radius);
  else
    find_chord_ends(polytope, facet, radius);
  const int count = static_cast<int>(corners_.size()) / k_;
  if (count == 0) return;
  points_.assign(static_cast<std::size_t>(k_), 0.0);
  for (int i = 0; i < count; ++i)
    for (int c = 0; c < k_; ++c) points_[c] += corners_[static_cast<std::size_t>(i) * k_ + c];
  for (int c = 0; c < k_; ++c) points_[c] /= count;
  const int kept = std::min(count, kMostCorners);
  for (int i = 0; i < kept; ++i) {
    const double* corner = &corners_[static_cast<std::size_t>(i * count / kept) * k_];
    for (const double share : {1.0 / 3.0, 2.0 / 3.0})
      for (int c = 0; c < k_; ++c) points_.push_back(points_[c] + share * (corner[c] - points_[c]));
  }
}

void FacetSamples::find_corners(const Polytope& polytope, int facet, double radius) {
  for (int v = 0; v < polytope.vertex_count(); ++v) {
    const double* u = polytope.vertex(v);
    double off = -polytope.offset(facet);
    for (int c = 0; c < k_; ++c) off += polytope.normal(facet)[c] * u[c];
    if (std::abs(off) <= kOnFacet * radius) corners_.insert(corners_.end(), u, u + k_);
  }
}

// Each chord goes through the middle of the one before it.
void FacetSamples::find_chord_ends(const Polytope& polytope, int facet, double radius) {
  if (!step_onto(polytope, facet, radius)) return;
  across_.resize(static_cast<std::size_t>(k_));
  for (int axis = 0; axis < k_; ++axis) {
    double ends[2];
    if (!find_chord(polytope, facet, axis, ends)) continue;
    for (const double end : ends)
      for (int c = 0; c < k_; ++c) corners_.push_back(u_[c] + end * across_[c]);
    for (int c = 0; c < k_; ++c) u_[c] += 0.5 * (ends[0] + ends[1]) * across_[c];
  }
}

// A point of the facet into u_: from that of its plane nearest the centre by steps within the plane, each at right
// angles into the half-space that the point is farthest beyond. False when there is none, or seems to be none: a step
// makes the squared distance from each point of the facet smaller by its own squared length.
bool FacetSamples::step_onto(const Polytope& polytope, int facet, double radius) {
  const double* normal = polytope.normal(facet);
  double squared_reach = radius * radius;  // of the polytope
  for (int v = 0; v < polytope.vertex_count(); ++v)
    squared_reach = std::max(squared_reach, squared_length(polytope.vertex(v), k_));
  double room = squared_reach - polytope.offset(facet) * polytope.offset(facet);
  u_.resize(static_cast<std::size_t>(k_));
  for (int c = 0; c < k_; ++c) u_[c] = polytope.offset(facet) * normal[c];
  for (int step = 0; step < kMostSteps && room >= 0.0; ++step) {
    int farthest = -1;
    double excess = kOnFacet * radius;
    for (int f = 0; f < polytope.facet_slots(); ++f) {
      if (f == facet) continue;
      double beyond = -polytope.offset(f);
      for (int c = 0; c < k_; ++c) beyond += polytope.normal(f)[c] * u_[c];
      if (beyond > excess) {
        excess = beyond;
        farthest = f;
      }
    }
    if (farthest < 0) return true;
    const double* other = polytope.normal(farthest);
    double cosine = 0.0;
    for (int c = 0; c < k_; ++c) cosine += normal[c] * other[c];
    const double squared = 1.0 - cosine * cosine;
    if (!(squared > kOnFacet)) return false;
    room -= excess * excess / squared;
    for (int c = 0; c < k_; ++c) u_[c] -= excess / squared * (other[c] - cosine * normal[c]);
  }
  return false;
}

// The chord of the facet through u_ along an axis, seen in the facet's plane: u_ + end across_ for its two ends. False
// when the axis is at right angles to the plane.
bool FacetSamples::find_chord(const Polytope& polytope, int facet, int axis, double* ends) {
  const double* normal = polytope.normal(facet);
  for (int c = 0; c < k_; ++c) across_[c] = (c == axis ? 1.0 : 0.0) - normal[axis] * normal[c];
  if (!(1.0 - normal[axis] * normal[axis] > kOnFacet)) return false;
  ends[0] = -HUGE_VAL;
  ends[1] = HUGE_VAL;
  for (int f = 0; f < polytope.facet_slots(); ++f) {
    if (f == facet) continue;
    double room = polytope.offset(f), slope = 0.0;
    for (int c = 0; c < k_; ++c) {
      room -= polytope.normal(f)[c] * u_[c];
      slope += polytope.normal(f)[c] * across_[c];
    }
    room = std::max(room, 0.0);
    if (slope > 0.0) ends[1] = std::min(ends[1], room / slope);
    if (slope < 0.0) ends[0] = std::max(ends[0], room / slope);
  }
  return std::isfinite(ends[0]) && std::isfinite(ends[1]);
}

}  // namespace graspatlas
