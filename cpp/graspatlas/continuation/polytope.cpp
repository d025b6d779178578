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
    } else if (a[i] > b[j]) {
      ++j;
    } else {
      if (++missed > 1) return false;
      ++i;
    }
  }
  return count == k - 1;
}

// The same from the bits of the facets that both vertices have.
inline bool share_edge(std::uint64_t common, int k, std::uint16_t* shared) {
  for (int i = 0; i < k - 1; ++i) {
    if (common == 0) return false;
    shared[i] = static_cast<std::uint16_t>(__builtin_ctzll(common));
    common &= common - 1;
  }
  return true;
}

// Scratch of `cut`, one for each thread: no allocation once it has grown.
struct Scratch {
  std::vector<double> signed_distance;
  std::vector<std::uint16_t> shared_facets;
  std::vector<int> inside, outside;
};
thread_local Scratch thread_scratch;

}  // namespace

Polytope::Polytope(int dimension, double half_width) : k_(dimension) {
  if (dimension < 1 || dimension > 12)
    throw Error("polytopes have 1 to 12 dimensions, not " + std::to_string(dimension));
  normals_.assign(2 * static_cast<std::size_t>(k_) * k_, 0.0);
  for (int f = 0; f < 2 * k_; ++f) normals_[static_cast<std::size_t>(f) * k_ + f / 2] = f % 2 ? 1.0 : -1.0;
  offsets_.assign(2 * k_, half_width);
  tags_.assign(2 * k_, kBox);
  const int corners = 1 << k_;
  uses_.assign(2 * k_, corners / 2);
  state_.assign(corners, 0);
  for (int corner = 0; corner < corners; ++corner) {
    std::uint64_t mask = 0;
    for (int axis = 0; axis < k_; ++axis) {
      const int side = corner >> axis & 1, facet = 2 * axis + side;
      vertices_.push_back(side ? half_width : -half_width);
      facets_.push_back(static_cast<FacetIndex>(facet));
      mask |= std::uint64_t{1} << facet;
    }
    masks_.push_back(mask);
  }
}

int Polytope::new_facet(const double* normal, double offset, int tag) {
  int slot = 0;
  while (slot < facet_slots() && uses_[slot] > 0) ++slot;
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
  Scratch& scratch = thread_scratch;
  const int count = vertex_count();
  scratch.signed_distance.resize(count);
  scratch.shared_facets.resize(k_);
  double* signed_distance = scratch.signed_distance.data();
  std::uint16_t* shared = scratch.shared_facets.data();
  const double tolerance = kOnPlane * (offset + 1.0);
  int outside_count = 0;
  for (int i = 0; i < count; ++i) {
    double s = -offset;
    for (int c = 0; c < k_; ++c) s += normal[c] * vertex(i)[c];
    signed_distance[i] = s > tolerance ? s : std::min(s, 0.0);
    outside_count += s > tolerance;
  }
  if (outside_count == 0 || outside_count == count) return false;

  scratch.inside.clear();
  scratch.outside.clear();
  for (int i = 0; i < count; ++i) (signed_distance[i] > 0.0 ? scratch.outside : scratch.inside).push_back(i);
  const int facet = new_facet(normal, offset, tag);
  const bool masks_hold = facet_slots() <= kMaskBits;
  for (const int out : scratch.outside)
    for (const int in : scratch.inside) {
      const bool edge = masks_hold ? share_edge(masks_[in] & masks_[out], k_, shared)
                                   : share_edge(facets_at(in), facets_at(out), k_, shared);
      if (!edge) continue;
      const double fraction = signed_distance[in] / (signed_distance[in] - signed_distance[out]);
      add_vertex_on_edge(in, out, fraction, shared, facet);
    }
  for (const int out : scratch.outside)
    for (int c = 0; c < k_; ++c) --uses_[facets_at(out)[c]];
  fill_gaps(scratch.outside);
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
  std::uint64_t mask = 0;
  for (int c = 0; c < k_; ++c) {
    ++uses_[row[c]];
    mask |= std::uint64_t{1} << (row[c] % kMaskBits);
  }
  masks_.push_back(mask);
  state_.push_back(0);
}

// Removes the vertices `gone` (ascending) by moving the last ones into their places.
void Polytope::fill_gaps(const std::vector<int>& gone) {
  int last = vertex_count() - 1, final_count = vertex_count() - static_cast<int>(gone.size());
  std::size_t end = gone.size();
  for (const int gap : gone) {
    if (gap >= final_count) break;
    while (end > 0 && gone[end - 1] == last) {
      --end;
      --last;
    }
    std::copy_n(vertex(last), k_, &vertices_[static_cast<std::size_t>(gap) * k_]);
    std::copy_n(facets_at(last), k_, &facets_[static_cast<std::size_t>(gap) * k_]);
    masks_[gap] = masks_[last];
    state_[gap] = state_[last];
    --last;
  }
  vertices_.resize(static_cast<std::size_t>(final_count) * k_);
  facets_.resize(static_cast<std::size_t>(final_count) * k_);
  masks_.resize(final_count);
  state_.resize(final_count);
}

int Polytope::expandable_vertex(double radius) const {
  double farthest = radius * radius;
  int found = -1;
  for (int i = 0; i < vertex_count(); ++i) {
    if (state_[i]) continue;
    double squared = 0.0;
    for (int c = 0; c < k_; ++c) squared += vertex(i)[c] * vertex(i)[c];
    if (squared > farthest) {
      farthest = squared;
      found = i;
    }
  }
  return found;
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
