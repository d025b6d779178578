#pragma once

#include <cstdint>
#include <vector>

namespace graspatlas {

/// A bounded convex polytope in R^k around the origin: a box that half-spaces cut smaller (paper, Fig. 6).
///
/// It is kept simple in the sense of combinatorics: every vertex lies on exactly k facets, so two vertices
/// share an edge exactly when they share k - 1 facets. A half-space through a vertex counts the vertex as
/// inside, which keeps it so.
class Polytope {
 public:
  /// Tag of the facets of the initial box; neighbours are tagged by their index, bounds by bound_tag.
  static constexpr int kBox = -1;
  static constexpr int bound_tag(int bound) { return -2 - bound; }

  /// The box [-half_width, half_width]^dimension.
  Polytope(int dimension, double half_width);

  /// Keep the points u with normal . u <= offset, for offset >= 0. False when that removes no vertex.
  bool cut(const double* normal, double offset, int tag);

  int dimension() const { return k_; }
  int vertex_count() const { return static_cast<int>(state_.size()); }
  const double* vertex(int i) const { return &vertices_[static_cast<std::size_t>(i) * k_]; }

  /// 0 for a vertex that may still be expanded, else the reason (one the atlas gave) that it cannot be.
  std::uint8_t state(int i) const { return state_[i]; }
  void close(int i, std::uint8_t reason) { state_[i] = reason; }

  /// Farthest vertex outside the ball of this radius that is not closed; -1 if there is none.
  int expandable_vertex(double radius) const;

  /// Facets are numbered 0 .. facet_slots()-1; a slot whose facet was cut away entirely is not active.
  int facet_slots() const { return static_cast<int>(tags_.size()); }
  bool facet_active(int f) const { return uses_[f] > 0; }
  const double* normal(int f) const { return &normals_[static_cast<std::size_t>(f) * k_]; }
  double offset(int f) const { return offsets_[f]; }
  int tag(int f) const { return tags_[f]; }

  bool contains(const double* u, double tolerance) const;

 private:
  using FacetIndex = std::uint16_t;
  static constexpr int kMaskBits = 64;

  const FacetIndex* facets_at(int vertex) const { return &facets_[static_cast<std::size_t>(vertex) * k_]; }
  int new_facet(const double* normal, double offset, int tag);
  void add_vertex_on_edge(int inside, int outside, double fraction, const FacetIndex* shared, int facet);
  void fill_gaps(const std::vector<int>& gone);

  int k_;
  std::vector<double> vertices_;      // vertex_count x k
  std::vector<FacetIndex> facets_;    // vertex_count x k, ascending in each row
  std::vector<std::uint64_t> masks_;  // vertex_count: bit f for facet f, useful while there are at most kMaskBits slots
  std::vector<std::uint8_t> state_;   // vertex_count
  std::vector<double> normals_;       // facet_slots x k
  std::vector<double> offsets_;
  std::vector<int> tags_;
  std::vector<int> uses_;  // vertices on each facet
};

}  // namespace graspatlas
