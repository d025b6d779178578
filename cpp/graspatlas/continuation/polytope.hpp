#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "graspatlas/continuation/outer_vertices.hpp"

namespace graspatlas {

/// A bounded convex polytope in R^k around the origin: a box that half-spaces cut smaller (paper, Fig. 6).
///
/// It is kept simple in the sense of combinatorics: every vertex lies on exactly k facets, so two vertices
/// share an edge exactly when they share k - 1 facets. A half-space through a vertex counts the vertex as
/// inside, which keeps it so.
///
/// In many dimensions it has many more vertices than half-spaces, of which an atlas needs those outside a ball only:
/// then it may list these alone, and find them when it is asked for them.
///
/// An atlas holds millions of them: all arrays of one lie in one piece of memory, hardly larger than they need.
class Polytope {
 public:
  /// Tag of the facets of the initial box; neighbours are tagged by their index, bounds by bound_tag.
  static constexpr int kBoxTag = -1;
  static constexpr int bound_tag(int bound) { return -2 - bound; }
  static constexpr int bound_of(int tag) { return -2 - tag; }
  static constexpr bool is_bound(int tag) { return tag <= bound_tag(0); }

  /// Which vertices are listed: all of them, up to date after each cut, or those outside the ball that
  /// `expandable_vertex` was asked for last.
  enum class Listed : std::uint8_t { all, outer };

  /// Work space, one for each thread.
  struct Scratch {
    std::vector<double> signed_distance, vertices;
    std::vector<std::uint64_t> masks;
    std::vector<std::uint16_t> facets;
    std::vector<int> inside, outside;
    int inside_count = 0, outside_count = 0;
    // The outer vertices of one polytope, as long as that is of this version, and the offsets of its facets for them.
    OuterVertices outer;
    std::vector<double> offsets;
    const Polytope* outer_of = nullptr;
    int outer_version = 0;
  };

  Polytope() = default;
  /// The box [-half_width, half_width]^dimension.
  Polytope(int dimension, double half_width, Listed listed = Listed::all);
  /// A copy takes no more memory than it needs.
  Polytope(const Polytope& other);
  Polytope& operator=(const Polytope& other);
  Polytope(Polytope&&) = default;
  Polytope& operator=(Polytope&&) = default;

  /// Becomes that box again, and keeps its memory.
  void reset(int dimension, double half_width);

  /// Keep the points u with normal . u <= offset, for offset >= 0. False when that removes no vertex, where all are
  /// listed; where they are not every half-space becomes a facet, though it may cut nothing off.
  bool cut(const double* normal, double offset, int tag, Scratch& scratch);

  int dimension() const { return k_; }
  int vertex_count() const { return vertex_count_; }
  const double* vertex(int i) const { return vertices() + static_cast<std::ptrdiff_t>(i) * k_; }

  /// 0 for a vertex that may still be expanded, else the reason (one the atlas gave) that it cannot be.
  std::uint8_t state(int i) const { return states()[i]; }
  void close(int i, std::uint8_t reason) { states()[i] = reason; }

  Listed listed() const { return listed_; }
  /// Lists all vertices outside the ball, where not all are listed.
  void list_outer(double radius, Scratch& scratch);

  /// Farthest vertex outside the ball of this radius that is not closed; -1 if there is none. Where not all
  /// are listed, lists vertices outside the ball first: all of them if some are closed, and there is no other.
  int expandable_vertex(double radius, Scratch& scratch);

  /// Facets are numbered 0 .. facet_slots()-1; a slot whose facet was cut away entirely is not active.
  int facet_slots() const { return facet_count_; }
  bool facet_active(int f) const { return listed_ == Listed::outer || uses()[f] > 0; }
  const double* normal(int f) const { return normals() + static_cast<std::ptrdiff_t>(f) * k_; }
  double offset(int f) const { return offsets()[f]; }
  int tag(int f) const { return tags()[f]; }

  bool contains(const double* u, double tolerance) const;

  /// Memory that it holds besides itself.
  std::int64_t bytes() const { return bytes(k_, vertex_capacity_, facet_capacity_); }

 private:
  using FacetIndex = std::uint16_t;
  static constexpr int kMaskBits = 64;

  // The arrays, one after another in storage_: positions of the vertices [vertices x k], normals [facets x k] and
  // offsets of the facets; their tags and numbers of vertices (1 for a facet that counts, where vertices are listed
  // when asked for, else 0); the facets of each vertex, ascending [vertices x k];
  // the states of the vertices.
  double* vertices() const { return reinterpret_cast<double*>(storage_.get()); }
  double* normals() const { return vertices() + static_cast<std::ptrdiff_t>(vertex_capacity_) * k_; }
  double* offsets() const { return normals() + static_cast<std::ptrdiff_t>(facet_capacity_) * k_; }
  std::int32_t* tags() const { return reinterpret_cast<std::int32_t*>(offsets() + facet_capacity_); }
  std::int32_t* uses() const { return tags() + facet_capacity_; }
  FacetIndex* facets() const { return reinterpret_cast<FacetIndex*>(uses() + facet_capacity_); }
  std::uint8_t* states() const {
    return reinterpret_cast<std::uint8_t*>(facets() + static_cast<std::ptrdiff_t>(vertex_capacity_) * k_);
  }
  static std::int64_t bytes(std::int64_t k, std::int64_t vertices, std::int64_t facets) {
    return vertices * (k * 8 + k * 2 + 1) + facets * (k * 8 + 8 + 4 + 4);
  }

  int find_outer(double radius, bool all, Scratch& scratch);
  void begin_outer(double radius, Scratch& scratch);
  int next_to_enter(const double* u, double tolerance, const std::vector<double>& offsets) const;
  void store_outer(Scratch& scratch);
  void resize(int vertex_capacity, int facet_capacity);
  int new_facet(const double* normal, double offset, int tag);
  template <int K>
  bool cut_in(const double* normal, double offset, int tag, Scratch& scratch);
  template <int K>
  int find_new_vertices(int facet, Scratch& scratch);
  template <int K>
  void replace(int new_count, const Scratch& scratch);

  std::unique_ptr<std::byte[]> storage_;
  std::int32_t k_ = 0, vertex_count_ = 0, vertex_capacity_ = 0, facet_count_ = 0, facet_capacity_ = 0;
  Listed listed_ = Listed::all;
  bool began_ = false;         // to list outer vertices
  std::uint16_t version_ = 0;  // counts the lists of outer vertices
};

}  // namespace graspatlas
