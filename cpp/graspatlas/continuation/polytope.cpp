#include "graspatlas/continuation/polytope.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "graspatlas/continuation/system.hpp"

namespace graspatlas {

namespace {

// A vertex this little beyond a half-space (in units of offset + 1) is still inside it.
constexpr double kOnPlane = 1e-12;

// Facets that two vertices have in common, if exactly k - 1 (an edge); both lists ascend.
bool share_edge(const std::uint16_t* a, const std::uint16_t* b, int k, std::uint16_t* shared) {
  int i = 0, j = 0, count = 0, missed = 0;
  while (i < k && j < k) {
    if (a[i] == b[j]) {
      shared[count++] = a[i];
      ++i;
      ++j;
    } else {
      if (a[i] < b[j]) {
        if (++missed > 1) return false;
        ++i;
      } else {
        ++j;
      }
    }
  }
  return count == k - 1;
}

// Scratch of `cut`, one for each thread: no allocation once it has grown.
thread_local std::vector<double> signed_distance;
thread_local std::vector<std::uint16_t> shared_facets;

}  // namespace

Polytope::Polytope(int dimension, double half_width) : k_(dimension) {
  if (dimension < 1 || dimension > 12) throw Error("polytopes have 1 to 12 dimensions, not " + std::to_string(dimension));
  std::vector<double> normal(k_, 0.0);
  for (int f = 0; f < 2 * k_; ++f) {
    normal[f / 2] = f % 2 ? 1.0 : -1.0;
    new_facet(normal.data(), half_width, kBox);
    normal[f / 2] = 0.0;
  }
  const int corners = 1 << k_;
  state_.assign(corners, 0);
  vertices_.reserve(static_cast<std::size_t>(corners) * k_);
  facets_.reserve(static_cast<std::size_t>(corners) * k_);
  for (int corner = 0; corner < corners; ++corner)
    for (int axis = 0; axis < k_; ++axis) {
      const int side = corner >> axis & 1;
      vertices_.push_back(side ? half_width : -half_width);
      facets_.push_back(static_cast<FacetIndex>(2 * axis + side));
      ++uses_[2 * axis + side];
    }
}

int Polytope::new_facet(const double* normal, double offset, int tag) {
  int slot = 0;
  while (slot < facet_slots() && (uses_[slot] > 0)) ++slot;
  // The box is made before its vertices: its facets are not in use yet.
  if (vertices_.empty()) slot = facet_slots();
  if (slot == facet_slots()) {
    if (slot > std::numeric_limits<FacetIndex>::max()) throw Error("a polytope has too many facets");
    normals_.insert(normals_.end(), normal, normal + k_);
    offsets_.push_back(offset);
    tags_.push_back(tag);
    uses_.push_back(0);
  } else {
    std::copy_n(normal, k_, &normals_[static_cast<std::size_t>(slot) * k_]);
    offsets_[slot] = offset;
    tags_[slot] = tag;
  }
  return slot;
}

bool Polytope::cut(const double* normal, double offset, int tag) {
  const int count = vertex_count();
  signed_distance.resize(count);
  shared_facets.resize(k_);
  bool any_outside = false, any_inside = false;
  for (int i = 0; i < count; ++i) {
    double s = -offset - kOnPlane * (offset + 1.0);
    for (int c = 0; c < k_; ++c) s += normal[c] * vertices_[static_cast<std::size_t>(i) * k_ + c];
    signed_distance[i] = s;
    (s > 0.0 ? any_outside : any_inside) = true;
  }
  if (!any_outside || !any_inside) return false;

  const int facet = new_facet(normal, offset, tag);
  for (int out = 0; out < count; ++out) {
    if (signed_distance[out] <= 0.0) continue;
    for (int in = 0; in < count; ++in) {
      if (signed_distance[in] > 0.0) continue;
      if (!share_edge(facets_at(in), facets_at(out), k_, shared_facets.data())) continue;
      const double fraction = signed_distance[in] / (signed_distance[in] - signed_distance[out]);
      add_vertex_on_edge(in, out, fraction, shared_facets.data(), facet);
    }
  }
  signed_distance.resize(vertex_count(), -1.0);
  remove_outside();
  return true;
}

void Polytope::add_vertex_on_edge(int inside, int outside, double fraction, const FacetIndex* shared, int facet) {
  const std::size_t start = vertices_.size();
  vertices_.resize(start + k_);
  const double *a = vertex(inside), *b = vertex(outside);
  for (int c = 0; c < k_; ++c) vertices_[start + c] = a[c] + fraction * (b[c] - a[c]);
  facets_.resize(start + k_);
  FacetIndex* row = &facets_[start];
  const auto added = static_cast<FacetIndex>(facet);
  int i = 0;
  for (; i < k_ - 1 && shared[i] < added; ++i) row[i] = shared[i];
  row[i] = added;
  for (; i < k_ - 1; ++i) row[i + 1] = shared[i];
  for (int c = 0; c < k_; ++c) ++uses_[row[c]];
  state_.push_back(0);
}

void Polytope::remove_outside() {
  int kept = 0;
  for (int i = 0; i < vertex_count(); ++i) {
    const FacetIndex* row = facets_at(i);
    if (signed_distance[i] > 0.0) {
      for (int c = 0; c < k_; ++c) --uses_[row[c]];
      continue;
    }
    if (kept != i) {
      std::copy_n(vertex(i), k_, &vertices_[static_cast<std::size_t>(kept) * k_]);
      std::copy_n(row, k_, &facets_[static_cast<std::size_t>(kept) * k_]);
      state_[kept] = state_[i];
    }
    ++kept;
  }
  vertices_.resize(static_cast<std::size_t>(kept) * k_);
  facets_.resize(static_cast<std::size_t>(kept) * k_);
  state_.resize(kept);
}

int Polytope::expandable_vertex(double radius) const {
  const double limit = radius * radius;
  for (int i = 0; i < vertex_count(); ++i) {
    if (state_[i]) continue;
    double squared = 0.0;
    for (int c = 0; c < k_; ++c) squared += vertex(i)[c] * vertex(i)[c];
    if (squared > limit) return i;
  }
  return -1;
}

bool Polytope::contains(const double* u, double tolerance) const {
  for (int f = 0; f < facet_slots(); ++f) {
    if (!facet_active(f)) continue;
    double s = -offsets_[f];
    for (int c = 0; c < k_; ++c) s += normal(f)[c] * u[c];
    if (s > tolerance) return false;
  }
  return true;
}

}  // namespace graspatlas
