#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "graspatlas/continuation/polytope.hpp"

// Where not all vertices are listed: those outside the ball, found as they are asked for.

namespace graspatlas {

namespace {

// A vertex this little beyond a half-space is still inside it, where not all vertices are listed, as a share of the
// radius; and by so much at least are facets moved outwards there, those of bounds less, by which points are bounded
// more exactly.
constexpr double kBeyond = 1e-11, kSmallMove = 1e-9, kSmallestMove = 1e-11;

// A number from 0 to 1 that looks random, as those of no two facets are in any relation; the finalizer of MurmurHash3.
inline double fraction_of(int f) {
  auto bits = static_cast<std::uint32_t>(f) + 1;
  bits = (bits ^ bits >> 16) * 0x85ebca6bU;
  bits = (bits ^ bits >> 13) * 0xc2b2ae35U;
  return (bits ^ bits >> 16) / 4294967296.0;
}

}  // namespace

void Polytope::list_outer(double radius, Scratch& scratch) {
  if (listed_ == Listed::outer) find_outer(radius, true, scratch);
}

// Lists the vertices outside the ball that there are when all half-spaces have entered, or as many as it takes for the
// farthest vertex that is not closed to be one of the polytope; it is returned.
int Polytope::find_outer(double radius, bool all, Scratch& scratch) {
  if (began_ && vertex_count_ == 0) return -1;
  begin_outer(radius, scratch);
  OuterVertices& outer = scratch.outer;
  int farthest = -1;
  while (outer.count() > 0) {
    farthest = outer.farthest_open();
    const double* beside = farthest < 0 || all ? nullptr : outer.vertex(farthest);
    const int next = next_to_enter(beside, kBeyond * radius, scratch.offsets);
    if (next < 0) break;
    outer.cut(next);
    uses()[next] = 1;
  }
  if (outer.count() == 0) farthest = -1;
  for (int i = 0; i < outer.count(); ++i)
    if (all || i == farthest) outer.settle(i);
  store_outer(scratch);
  return farthest;
}

// A half-space that does not count yet: the one through which the way from the origin to a point leaves the polytope,
// if the point is beyond it, or the first if there is no point; -1 when there is none.
int Polytope::next_to_enter(const double* u, double tolerance, const std::vector<double>& offsets) const {
  int next = -1;
  double farthest = 0.0;
  for (int f = 0; f < facet_count_; ++f) {
    if (uses()[f] > 0) continue;
    if (!u) return f;
    double beyond = -offsets[f];
    for (int c = 0; c < k_; ++c) beyond += normal(f)[c] * u[c];
    // Offsets are moved outwards, so none is zero.
    if (beyond > tolerance && beyond > farthest * offsets[f]) {
      farthest = beyond / offsets[f];
      next = f;
    }
  }
  return next;
}

// Makes the work space hold what is stored, unless it does. Facets are moved outwards by tiny amounts, each by its own,
// so that no vertex lies on more than k of them.
void Polytope::begin_outer(double radius, Scratch& scratch) {
  const bool held = began_ && scratch.outer_of == this && scratch.outer_version == version_;
  std::vector<double>& offsets = scratch.offsets;
  if (!held) offsets.clear();
  for (int f = static_cast<int>(offsets.size()); f < facet_count_; ++f)
    offsets.push_back(offset(f) + radius * (is_bound(tag(f)) ? kSmallestMove : kSmallMove) * (1.0 + fraction_of(f)));
  const OuterVertices::HalfSpaces half_spaces{normals(), offsets.data()};
  OuterVertices& outer = scratch.outer;
  if (held) {
    outer.move_to(half_spaces);
    for (int i = 0; i < vertex_count_; ++i) outer.set_state(i, state(i));
  } else if (!began_) {
    outer.begin_with_box(k_, radius, half_spaces);
  } else {
    outer.begin(k_, radius, half_spaces);
    for (int f = 0; f < facet_count_; ++f)
      if (uses()[f] > 0) outer.enter(f);
    for (int i = 0; i < vertex_count_; ++i) outer.add(facets() + static_cast<std::ptrdiff_t>(i) * k_, state(i));
  }
}

void Polytope::store_outer(Scratch& scratch) {
  const OuterVertices& outer = scratch.outer;
  began_ = true;
  scratch.outer_of = this;
  scratch.outer_version = ++version_;
  vertex_count_ = 0;
  if (outer.count() > vertex_capacity_)
    resize(outer.count(), facet_capacity_);
  else if (outer.count() == 0 && vertex_capacity_ > 0)
    resize(0, facet_count_);
  vertex_count_ = outer.count();
  std::copy_n(outer.vertex(0), vertex_count_ * k_, vertices());
  std::copy_n(outer.facets(0), vertex_count_ * k_, facets());
  for (int i = 0; i < vertex_count_; ++i) states()[i] = outer.state(i);
}

}  // namespace graspatlas
