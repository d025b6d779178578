#include "graspatlas/continuation/polytope.hpp"
#include "strain.hpp"

namespace strain {

namespace {

using graspatlas::Polytope;

struct HalfSpace {
  std::vector<double> normal;
  double offset;
};

double dot(const double* a, const double* b, int k) {
  double sum = 0.0;
  for (int c = 0; c < k; ++c) sum += a[c] * b[c];
  return sum;
}

// Half-spaces that give trouble: through vertices, hardly beside one that is there, through the origin, far away.
HalfSpace troublesome(const Polytope& polytope, const std::vector<HalfSpace>& made, Random& random) {
  const int k = polytope.dimension();
  HalfSpace next{random.direction(k), random.uniform(0.2, 1.5)};
  const int kind = random.below(8);
  if (kind < 3) {  // through a vertex, or a hair beside it
    const double* v = polytope.vertex(random.below(polytope.vertex_count()));
    const double through = dot(next.normal.data(), v, k);
    if (through < 0.0)
      for (double& c : next.normal) c = -c;
    const double off[] = {0.0, 1e-13, -1e-13};
    next.offset = std::max(std::abs(through) + off[kind], 0.0);
  } else if (kind == 3 && !made.empty()) {  // the same again, or nearly parallel
    next = made[random.below(static_cast<int>(made.size()))];
    next.normal[random.below(k)] += random.uniform(-1e-14, 1e-14);
  } else if (kind == 4) {  // parallel to an axis, as the box is
    next.normal.assign(k, 0.0);
    next.normal[random.below(k)] = random.below(2) ? 1.0 : -1.0;
  } else if (kind == 5 && random.below(20) == 0) {
    next.offset = random.below(2) ? 0.0 : 1e-15;
  }
  return next;
}

// Every vertex lies in all half-spaces, and nothing inside all of them sticks out beyond the vertices.
void check(const Polytope& polytope, const std::vector<HalfSpace>& made, double half_width, Random& random) {
  const int k = polytope.dimension();
  require(polytope.vertex_count() >= k + 1, "a polytope has at least k + 1 vertices");
  for (int v = 0; v < polytope.vertex_count(); ++v) {
    for (int c = 0; c < k; ++c)
      require(std::abs(polytope.vertex(v)[c]) <= half_width + 1e-9, "vertices lie in the box");
    for (const HalfSpace& h : made)
      require(dot(h.normal.data(), polytope.vertex(v), k) <= h.offset + 1e-9, "vertices lie in every half-space");
    require(polytope.contains(polytope.vertex(v), 1e-9), "vertices lie in every facet's half-space");
    int on = 0;
    for (int f = 0; f < polytope.facet_slots(); ++f)
      on += polytope.facet_active(f) && polytope.offset(f) - dot(polytope.normal(f), polytope.vertex(v), k) < 1e-9;
    require(on >= k, "vertices lie on k facets");
  }
  const std::vector<double> towards = random.direction(k);
  double reach = 0.0;
  for (int v = 0; v < polytope.vertex_count(); ++v) reach = std::max(reach, dot(towards.data(), polytope.vertex(v), k));
  std::vector<double> u(k);
  for (int sample = 0; sample < 20; ++sample) {
    for (double& c : u) c = random.uniform(-half_width, half_width);
    bool inside = true;
    for (const HalfSpace& h : made) inside = inside && dot(h.normal.data(), u.data(), k) <= h.offset;
    require(!inside || polytope.contains(u.data(), 1e-9), "a point of all half-spaces lies in the polytope");
    require(!inside || dot(towards.data(), u.data(), k) <= reach + 1e-9, "no point lies beyond all vertices");
  }
}

void cut_at_random(int k, int polytopes, int cuts, unsigned seed) {
  Random random(seed);
  const double half_width = 1.0;
  for (int p = 0; p < polytopes; ++p) {
    Polytope polytope(k, half_width);
    Polytope::Scratch scratch;
    std::vector<HalfSpace> made;
    for (int c = 0; c < cuts; ++c) {
      const HalfSpace next = troublesome(polytope, made, random);
      polytope.cut(next.normal.data(), next.offset, c, scratch);
      made.push_back(next);
      if (next.offset < 1e-9) break;  // it may have become flat: cutting goes on, what is inside is not defined
    }
    if (made.back().offset >= 1e-9) check(polytope, made, half_width, random);
    for (int c = 0; c < 5; ++c) polytope.cut(random.direction(k).data(), 0.0, c, scratch);
    const int vertex = polytope.expandable_vertex(0.1, scratch);
    if (vertex >= 0) polytope.close(vertex, 1);
  }
}

// Tangent planes of a ball: every cut adds a facet, more than fit the bits of a mask.
void cut_round(int k, int cuts) {
  Random random(7);
  Polytope polytope(k, 1.0);
  Polytope::Scratch scratch;
  std::vector<HalfSpace> made;
  for (int c = 0; c < cuts; ++c) {
    made.push_back({random.direction(k), 0.5});
    polytope.cut(made.back().normal.data(), 0.5, c, scratch);
  }
  check(polytope, made, 1.0, random);
  require(polytope.expandable_vertex(0.5, scratch) >= 0, "a polytope round a ball has vertices outside it");
}

// A polytope that lists the vertices outside the ball only, against one that lists all; asked for them now and then.
void list_outer_at_random(int k, int polytopes, int cuts, unsigned seed) {
  Random random(seed);
  for (int p = 0; p < polytopes; ++p) {
    Polytope all(k, 1.0), outer(k, 1.0, Polytope::Listed::outer);
    Polytope::Scratch scratch;
    std::vector<HalfSpace> made;
    for (int c = 0; c < cuts; ++c) {
      const HalfSpace next = troublesome(all, made, random);
      if (next.offset < 1e-9) continue;
      all.cut(next.normal.data(), next.offset, c, scratch);
      outer.cut(next.normal.data(), next.offset, c, scratch);
      made.push_back(next);
      if (random.below(4) > 0) continue;
      const int vertex = outer.expandable_vertex(1.0, scratch);
      if (vertex >= 0 && random.below(2)) outer.close(vertex, 1);
    }
    double farthest = 0.0;
    for (int v = 0; v < all.vertex_count(); ++v)
      farthest = std::max(farthest, std::sqrt(dot(all.vertex(v), all.vertex(v), k)));
    outer.list_outer(1.0, scratch);
    double found = 0.0;
    for (int v = 0; v < outer.vertex_count(); ++v) {
      found = std::max(found, std::sqrt(dot(outer.vertex(v), outer.vertex(v), k)));
      require(all.contains(outer.vertex(v), 1e-6), "outer vertices lie in every half-space");
    }
    require(std::abs(std::max(found, 1.0) - std::max(farthest, 1.0)) < 1e-6, "the farthest vertex is found");
  }
}

}  // namespace

void polytopes() {
  cut_at_random(1, 300, 20, 1);
  cut_at_random(2, 300, 60, 2);
  cut_at_random(3, 150, 60, 3);
  cut_at_random(4, 40, 40, 4);
  cut_at_random(5, 6, 25, 5);
  list_outer_at_random(2, 100, 30, 6);
  list_outer_at_random(4, 40, 30, 7);
  list_outer_at_random(5, 10, 25, 8);
  cut_round(2, 400);
  cut_round(3, 250);
  cut_round(4, 90);
}

}  // namespace strain
