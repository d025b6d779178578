#include "graspatlas/continuation/polytope.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>

#include "graspatlas/continuation/options.hpp"
#include "graspatlas/errors.hpp"

namespace graspatlas {

namespace {

// A vertex this little beyond a half-space (in units of offset + 1) is still inside it.
constexpr double kOnHalfSpace = 1e-12;

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

// True when at least `count` bits are set.
inline bool has_bits(std::uint64_t bits, int count) {
  for (int i = 1; i < count; ++i) bits &= bits - 1;
  return count == 0 || bits != 0;
}

inline void list_bits(std::uint64_t bits, int count, std::uint16_t* out) {
  for (int i = 0; i < count; ++i) {
    out[i] = static_cast<std::uint16_t>(__builtin_ctzll(bits));
    bits &= bits - 1;
  }
}

// Inserts a number into ascending ones.
inline void insert(const std::uint16_t* ascending, int count, std::uint16_t number, std::uint16_t* out) {
  int i = 0;
  for (; i < count && ascending[i] < number; ++i) *out++ = ascending[i];
  *out++ = number;
  for (; i < count; ++i) *out++ = ascending[i];
}

}  // namespace

Polytope::Polytope(int dimension, double half_width, Listed listed) : listed_(listed) {
  if (dimension < 1 || dimension > kMostDimensions)
    throw Error("polytopes have 1 to " + std::to_string(kMostDimensions) + " dimensions, not " +
                std::to_string(dimension));
  reset(dimension, half_width);
}

void Polytope::reset(int dimension, double half_width) {
  const int corners = listed_ == Listed::all ? 1 << dimension : 0;
  began_ = false;
  if (dimension != k_ || vertex_capacity_ < corners || facet_capacity_ < 2 * dimension) {
    vertex_count_ = facet_count_ = 0;
    k_ = dimension;
    resize(corners, 2 * dimension);
  }
  vertex_count_ = corners;
  facet_count_ = 2 * k_;
  std::fill_n(normals(), 2 * k_ * k_, 0.0);
  for (int f = 0; f < 2 * k_; ++f) normals()[f * k_ + f / 2] = f % 2 ? 1.0 : -1.0;
  std::fill_n(offsets(), 2 * k_, half_width);
  std::fill_n(tags(), 2 * k_, kBoxTag);
  std::fill_n(uses(), 2 * k_, listed_ == Listed::all ? corners / 2 : 1);
  std::fill_n(states(), corners, std::uint8_t{0});
  double* position = vertices();
  FacetIndex* facet = facets();
  for (int corner = 0; corner < corners; ++corner)
    for (int axis = 0; axis < k_; ++axis) {
      const int side = corner >> axis & 1;
      *position++ = side ? half_width : -half_width;
      *facet++ = static_cast<FacetIndex>(2 * axis + side);
    }
}

Polytope::Polytope(const Polytope& other) { *this = other; }

Polytope& Polytope::operator=(const Polytope& other) {
  if (this == &other) return *this;
  storage_.reset();
  k_ = other.k_;
  listed_ = other.listed_;
  began_ = other.began_;
  vertex_count_ = facet_count_ = 0;
  resize(other.vertex_count_, other.facet_count_);
  vertex_count_ = other.vertex_count_;
  facet_count_ = other.facet_count_;
  std::copy_n(other.vertices(), vertex_count_ * k_, vertices());
  std::copy_n(other.normals(), facet_count_ * k_, normals());
  std::copy_n(other.offsets(), facet_count_, offsets());
  std::copy_n(other.tags(), facet_count_, tags());
  std::copy_n(other.uses(), facet_count_, uses());
  std::copy_n(other.facets(), vertex_count_ * k_, facets());
  std::copy_n(other.states(), vertex_count_, states());
  return *this;
}

// Moves the arrays to storage for so many vertices and facets.
void Polytope::resize(int vertex_capacity, int facet_capacity) {
  Polytope old;
  std::swap(old.storage_, storage_);
  old.k_ = k_;
  old.vertex_capacity_ = vertex_capacity_;
  old.facet_capacity_ = facet_capacity_;
  storage_.reset(new std::byte[static_cast<std::size_t>(bytes(k_, vertex_capacity, facet_capacity))]);
  vertex_capacity_ = vertex_capacity;
  facet_capacity_ = facet_capacity;
  if (!old.storage_) return;
  std::copy_n(old.vertices(), vertex_count_ * k_, vertices());
  std::copy_n(old.normals(), facet_count_ * k_, normals());
  std::copy_n(old.offsets(), facet_count_, offsets());
  std::copy_n(old.tags(), facet_count_, tags());
  std::copy_n(old.uses(), facet_count_, uses());
  std::copy_n(old.facets(), vertex_count_ * k_, facets());
  std::copy_n(old.states(), vertex_count_, states());
}

int Polytope::new_facet(const double* normal, double offset, int tag) {
  int slot = listed_ == Listed::all ? 0 : facet_count_;
  while (slot < facet_count_ && uses()[slot] > 0) ++slot;
  if (slot == facet_count_) {
    if (slot > std::numeric_limits<FacetIndex>::max()) throw Error("a polytope has too many facets");
    if (facet_count_ == facet_capacity_) resize(vertex_capacity_, facet_capacity_ + 1 + facet_capacity_ / 8);
    uses()[facet_count_++] = 0;
  }
  std::copy_n(normal, k_, normals() + static_cast<std::ptrdiff_t>(slot) * k_);
  offsets()[slot] = offset;
  tags()[slot] = tag;
  return slot;
}

bool Polytope::cut(const double* normal, double offset, int tag, Scratch& scratch) {
  if (listed_ == Listed::outer) {
    new_facet(normal, offset, tag);
    return true;
  }
  switch (k_) {
    case 2:
      return cut_in<2>(normal, offset, tag, scratch);
    case 3:
      return cut_in<3>(normal, offset, tag, scratch);
    case 4:
      return cut_in<4>(normal, offset, tag, scratch);
    default:
      return cut_in<0>(normal, offset, tag, scratch);
  }
}

// K is the dimension where the compiler may know it, else 0.
template <int K>
bool Polytope::cut_in(const double* normal, double offset, int tag, Scratch& scratch) {
  const int k = K > 0 ? K : k_, count = vertex_count_;
  if (static_cast<int>(scratch.signed_distance.size()) < count) {
    scratch.signed_distance.resize(count);
    scratch.masks.resize(count);
    scratch.inside.resize(count);
    scratch.outside.resize(count);
  }
  double* signed_distance = scratch.signed_distance.data();
  const double tolerance = kOnHalfSpace * (offset + 1.0);
  const double* u = vertices();
  double farthest = -offset;
  for (int i = 0; i < count; ++i, u += k) {
    double s = -offset;
    for (int c = 0; c < k; ++c) s += normal[c] * u[c];
    signed_distance[i] = s;
    farthest = std::max(farthest, s);
  }
  if (!(farthest > tolerance)) return false;
  int &inside_count = scratch.inside_count = 0, &outside_count = scratch.outside_count = 0;
  for (int i = 0; i < count; ++i) {
    const bool out = signed_distance[i] > tolerance;
    scratch.inside[inside_count] = i;
    scratch.outside[outside_count] = i;
    inside_count += !out;
    outside_count += out;
    if (!out) signed_distance[i] = std::min(signed_distance[i], 0.0);
  }
  if (inside_count == 0) return false;
  const int facet = new_facet(normal, offset, tag);
  replace<K>(find_new_vertices<K>(facet, scratch), scratch);
  return true;
}

// Where the half-space cuts edges: positions and facets into scratch; their number.
template <int K>
int Polytope::find_new_vertices(int facet, Scratch& scratch) {
  const int k = K > 0 ? K : k_;
  const FacetIndex* rows = facets();
  const bool masks_hold = facet_count_ <= kMaskBits;
  std::uint64_t* masks = scratch.masks.data();
  if (masks_hold) {
    for (int i = 0; i < vertex_count_; ++i) {
      std::uint64_t mask = 0;
      for (int c = 0; c < k; ++c) mask |= std::uint64_t{1} << rows[i * k + c];
      masks[i] = mask;
    }
    // An inside vertex on an edge to an outside one shares k - 1 facets with the outside ones altogether.
    std::uint64_t all = 0;
    for (int o = 0; o < scratch.outside_count; ++o) all |= masks[scratch.outside[o]];
    int kept = 0;
    for (int i = 0; i < scratch.inside_count; ++i) {
      const int in = scratch.inside[i];
      scratch.inside[kept] = in;
      kept += has_bits(masks[in] & all, k - 1);
    }
    scratch.inside_count = kept;
  }
  // A vertex ends k edges.
  const auto most = static_cast<std::size_t>(scratch.outside_count) * k;
  scratch.vertices.resize(std::max(scratch.vertices.size(), most * k));
  scratch.facets.resize(std::max(scratch.facets.size(), most * k));
  double* vertex = scratch.vertices.data();
  FacetIndex* vertex_facets = scratch.facets.data();
  FacetIndex shared[kMostDimensions];
  int found = 0;
  for (int o = 0; o < scratch.outside_count; ++o)
    for (int n = 0; n < scratch.inside_count; ++n) {
      const int out = scratch.outside[o], in = scratch.inside[n];
      if (masks_hold) {
        const std::uint64_t common = masks[in] & masks[out];
        if (!has_bits(common, k - 1)) continue;
        list_bits(common, k - 1, shared);
      } else if (!share_edge(rows + static_cast<std::ptrdiff_t>(in) * k, rows + static_cast<std::ptrdiff_t>(out) * k, k,
                             shared)) {
        continue;
      }
      const double fraction =
          scratch.signed_distance[in] / (scratch.signed_distance[in] - scratch.signed_distance[out]);
      const double *a = vertices() + static_cast<std::ptrdiff_t>(in) * k,
                   *b = vertices() + static_cast<std::ptrdiff_t>(out) * k;
      for (int c = 0; c < k; ++c) *vertex++ = a[c] + fraction * (b[c] - a[c]);
      insert(shared, k - 1, static_cast<FacetIndex>(facet), vertex_facets);
      vertex_facets += k;
      ++found;
    }
  return found;
}

// Puts the new vertices into the places of the outside ones; what is left over goes to the end, or the end moves into
// the gaps.
template <int K>
void Polytope::replace(int new_count, const Scratch& scratch) {
  const int k = K > 0 ? K : k_;
  const int gone = scratch.outside_count;
  const int final_count = vertex_count_ - gone + new_count;
  if (final_count > vertex_capacity_) resize(final_count + 1 + final_count / 16, facet_capacity_);
  double* const positions = vertices();
  FacetIndex* const rows = facets();
  std::uint8_t* const closed = states();
  std::int32_t* const counts = uses();
  for (int o = 0; o < gone; ++o)
    for (int c = 0; c < k; ++c) --counts[rows[scratch.outside[o] * k + c]];
  const double* vertex = scratch.vertices.data();
  const FacetIndex* vertex_facets = scratch.facets.data();
  for (int i = 0; i < new_count; ++i, vertex += k, vertex_facets += k) {
    const int place = i < gone ? scratch.outside[i] : vertex_count_ + i - gone;
    for (int c = 0; c < k; ++c) {
      positions[place * k + c] = vertex[c];
      rows[place * k + c] = vertex_facets[c];
      ++counts[vertex_facets[c]];
    }
    closed[place] = 0;
  }
  int last = vertex_count_ - 1, last_gone = gone - 1;
  for (int i = new_count; i < gone; ++i) {
    const int gap = scratch.outside[i];
    while (last_gone >= i && scratch.outside[last_gone] == last) {
      --last_gone;
      --last;
    }
    if (gap >= last) break;
    for (int c = 0; c < k; ++c) {
      positions[gap * k + c] = positions[last * k + c];
      rows[gap * k + c] = rows[last * k + c];
    }
    closed[gap] = closed[last];
    --last;
  }
  vertex_count_ = final_count;
}

int Polytope::expandable_vertex(double radius, Scratch& scratch) {
  if (listed_ == Listed::outer) return find_outer(radius, false, scratch);
  double farthest = radius * radius;
  int found = -1;
  const double* u = vertices();
  const std::uint8_t* closed = states();
  for (int i = 0; i < vertex_count_; ++i, u += k_) {
    if (closed[i]) continue;
    double squared = 0.0;
    for (int c = 0; c < k_; ++c) squared += u[c] * u[c];
    if (squared > farthest) {
      farthest = squared;
      found = i;
    }
  }
  return found;
}

bool Polytope::contains(const double* u, double tolerance) const {
  for (int f = 0; f < facet_count_; ++f) {
    if (!facet_active(f)) continue;
    double s = -offsets()[f];
    for (int c = 0; c < k_; ++c) s += normal(f)[c] * u[c];
    if (s > tolerance) return false;
  }
  return true;
}

}  // namespace graspatlas
