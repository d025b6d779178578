#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace graspatlas {

/// The vertices outside a ball of a polytope round the origin in R^k, found without those inside it, of which there are
/// many more as k grows; work space for one polytope after another.
///
/// The ball is convex: where a half-space cuts an edge outside it, an end of the edge is outside it too. So to cut, the
/// edges at the outer vertices are all that must be known. Half-spaces enter one by one, and need not all: what some of
/// them leave outside the ball encloses what all of them do.
///
/// No vertex may lie on more than k facets: their planes are in general position.
class OuterVertices {
 public:
  using FacetIndex = std::uint16_t;

  /// Half-spaces normal . u <= offset by their numbers: unit normals [m x k], offsets [m].
  struct HalfSpaces {
    const double *normals, *offsets;
  };

  /// Begins with no half-space and no vertex: `enter` and `add` them.
  void begin(int k, double radius, const HalfSpaces& half_spaces);
  /// Enters the half-spaces 0 to 2 k - 1, which are those of a box: -u_0 <= .., u_0 <= .., -u_1 <= .., ..
  void begin_with_box(int k, double radius, const HalfSpaces& half_spaces);

  /// The same half-spaces, and others behind them, at another place in memory.
  void move_to(const HalfSpaces& half_spaces) { half_spaces_ = half_spaces; }

  /// A half-space that cuts off none of the vertices that there are, or that are added.
  void enter(int half_space);
  /// The vertex where k facets meet, by the numbers of their half-spaces [k].
  void add(const FacetIndex* facets, std::uint8_t state);
  /// A half-space that may cut vertices off. New vertices have state 0.
  void cut(int half_space);
  /// Computes vertex i anew from its facets, so that its rounding does not depend on how it was found.
  void settle(int i);
  /// Farthest vertex of state 0; -1 if there is none.
  int farthest_open() const;
  void set_state(int i, std::uint8_t state) { states_[static_cast<std::size_t>(i)] = state; }

  int count() const { return static_cast<int>(states_.size()); }
  const double* vertex(int i) const { return &positions_[at(i)]; }
  /// Its facets [k], ascending.
  const FacetIndex* facets(int i) const { return &facets_[at(i)]; }
  std::uint8_t state(int i) const { return states_[static_cast<std::size_t>(i)]; }

 private:
  std::size_t at(int i) const { return static_cast<std::size_t>(i) * static_cast<std::size_t>(k_); }
  static constexpr int kBlock = 4;  // half-spaces that are looked at side by side

  double* edges(int i) { return &edges_[at(i) * static_cast<std::size_t>(k_)]; }
  int add_vertex();
  void invert(const FacetIndex* facets, double* u, double* edges);
  template <int K>
  void cut_in(int half_space);
  template <int K>
  void go_along_edges(int i, int half_space);
  template <int K>
  bool is_inside(const double* u) const;
  template <int K>
  void branch(int i, int edge, int half_space);
  bool is_known(const FacetIndex* facets) const;
  int room_for_vertex();
  template <int K>
  void measure(int i);
  void drop(int i);

  int k_ = 0, entered_count_ = 0;
  double radius_ = 0.0, tolerance_ = 0.0;
  HalfSpaces half_spaces_{};
  // The half-spaces that were entered, in blocks: normals [k x kBlock] and offsets [kBlock].
  std::vector<double> entered_;
  // Of each vertex: its place [k] and facets [k]; a column for each facet, the edge that leaves it, as long as it takes
  // to come a unit away [k x k]; and how far along each edge the ball begins, 0 where the edge ends before it as far as
  // is known [k];
  // and whether there is any such.
  std::vector<double> positions_, squared_norms_, edges_, to_ball_;
  std::vector<FacetIndex> facets_;
  std::vector<std::uint8_t> states_, meets_ball_;
  std::vector<double> beyond_, slopes_, corner_, matrix_;
  // Vertices that a half-space cuts off, of which so many are not needed any more, and so many places are taken again;
  // and those that were added with it.
  std::vector<int> gone_, added_;
  int free_ = 0, reused_ = 0;
};

}  // namespace graspatlas
