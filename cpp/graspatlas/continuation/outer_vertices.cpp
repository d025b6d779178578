#include "graspatlas/continuation/outer_vertices.hpp"

#include <algorithm>
#include <cmath>

#include "graspatlas/continuation/options.hpp"

namespace graspatlas {

namespace {

// A point is inside a half-space when it is this little beyond, as a share of the radius: more than rounding.
constexpr double kOnPlane = 1e-11;

}  // namespace

void OuterVertices::begin(int k, double radius, const HalfSpaces& half_spaces) {
  if (k != k_) {
    positions_.clear();
    edges_.clear();
    to_ball_.clear();
    facets_.clear();
  }
  k_ = k;
  radius_ = radius;
  tolerance_ = kOnPlane * radius;
  half_spaces_ = half_spaces;
  entered_count_ = 0;
  entered_.clear();
  squared_norms_.clear();
  meets_ball_.clear();
  states_.clear();
  slopes_.resize(static_cast<std::size_t>(k));
  corner_.resize(static_cast<std::size_t>(k));
  matrix_.resize(2 * static_cast<std::size_t>(k) * static_cast<std::size_t>(k));
}

void OuterVertices::begin_with_box(int k, double radius, const HalfSpaces& half_spaces) {
  begin(k, radius, half_spaces);
  for (int f = 0; f < 2 * k; ++f) enter(f);
  for (int corner = 0; corner < 1 << k; ++corner) {
    const int i = add_vertex();
    std::fill_n(edges(i), k * k, 0.0);
    for (int axis = 0; axis < k; ++axis) {
      const int side = corner >> axis & 1, facet = 2 * axis + side;
      facets_[at(i) + axis] = static_cast<FacetIndex>(facet);
      positions_[at(i) + axis] = side != 0 ? half_spaces.offsets[facet] : -half_spaces.offsets[facet];
      edges(i)[axis * k + axis] = side != 0 ? -1.0 : 1.0;
    }
    measure<0>(i);
  }
}

void OuterVertices::enter(int half_space) {
  const int place = entered_count_++ % kBlock, block_size = (k_ + 1) * kBlock;
  if (place == 0) {
    entered_.resize(entered_.size() + static_cast<std::size_t>(block_size), 0.0);
    std::fill(entered_.end() - kBlock, entered_.end(), HUGE_VAL);
  }
  double* const block = entered_.data() + entered_.size() - block_size;
  for (int c = 0; c < k_; ++c)
    block[c * kBlock + place] = half_spaces_.normals[static_cast<std::ptrdiff_t>(half_space) * k_ + c];
  block[k_ * kBlock + place] = half_spaces_.offsets[half_space] + tolerance_;
}

void OuterVertices::add(const FacetIndex* facets, std::uint8_t state) {
  const int i = add_vertex();
  std::copy_n(facets, k_, &facets_[at(i)]);
  states_[i] = state;
  invert(facets, &positions_[at(i)], edges(i));
  measure<0>(i);
}

void OuterVertices::settle(int i) { invert(facets(i), &positions_[at(i)], nullptr); }

// The point where facets meet and, unless null, the edges: the inverse of the normals, with a minus. Gauss-Jordan
// elimination with partial pivoting.
void OuterVertices::invert(const FacetIndex* facets, double* u, double* edges) {
  const int k = k_, width = edges ? 2 * k : k;
  double* rows[kMostDimensions];
  for (int i = 0; i < k; ++i) {
    rows[i] = &matrix_[static_cast<std::size_t>(i) * 2 * k];
    std::copy_n(half_spaces_.normals + static_cast<std::ptrdiff_t>(facets[i]) * k, k, rows[i]);
    std::fill_n(rows[i] + k, k, 0.0);
    rows[i][k + i] = -1.0;
    u[i] = half_spaces_.offsets[facets[i]];
  }
  for (int c = 0; c < k; ++c) {
    int pivot = c;
    for (int i = c + 1; i < k; ++i)
      if (std::abs(rows[i][c]) > std::abs(rows[pivot][c])) pivot = i;
    std::swap(rows[c], rows[pivot]);
    std::swap(u[c], u[pivot]);
    const double inverse = 1.0 / rows[c][c];
    for (int j = c; j < width; ++j) rows[c][j] *= inverse;
    u[c] *= inverse;
    for (int i = 0; i < k; ++i) {
      if (i == c) continue;
      const double factor = rows[i][c];
      for (int j = c; j < width; ++j) rows[i][j] -= factor * rows[c][j];
      u[i] -= factor * u[c];
    }
  }
  if (!edges) return;
  for (int c = 0; c < k; ++c) std::copy_n(rows[c] + k, k, edges + c * k);
}

int OuterVertices::farthest_open() const {
  int farthest = -1;
  for (int i = 0; i < count(); ++i)
    if (states_[i] == 0 && (farthest < 0 || squared_norms_[i] > squared_norms_[farthest])) farthest = i;
  return farthest;
}

void OuterVertices::cut(int half_space) {
  switch (k_) {
    case 4:
      return cut_in<4>(half_space);
    case 5:
      return cut_in<5>(half_space);
    case 6:
      return cut_in<6>(half_space);
    default:
      return cut_in<0>(half_space);
  }
}

// K is the dimension where the compiler may know it, else 0.
template <int K>
void OuterVertices::cut_in(int half_space) {
  const int k = K > 0 ? K : k_, count = this->count();
  const double* normal = half_spaces_.normals + static_cast<std::ptrdiff_t>(half_space) * k;
  const double offset = half_spaces_.offsets[half_space];
  beyond_.resize(static_cast<std::size_t>(count));
  gone_.clear();
  added_.clear();
  free_ = reused_ = 0;
  for (int i = 0; i < count; ++i) {
    const double* u = vertex(i);
    double beyond = -offset;
    for (int c = 0; c < k; ++c) beyond += normal[c] * u[c];
    beyond_[i] = beyond;
    if (beyond > 0.0) gone_.push_back(i);
  }
  // From the vertices that go, edges lead back inside. An edge of one that stays may end beyond now; if it did so
  // outside the ball, it has been gone along from there.
  for (const int i : gone_) {
    go_along_edges<K>(i, half_space);
    ++free_;
  }
  for (int i = 0; i < count; ++i)
    if (!(beyond_[i] > 0.0) && meets_ball_[i] != 0) go_along_edges<K>(i, half_space);
  for (; free_ > reused_; --free_) drop(gone_[free_ - 1]);
  enter(half_space);
}

// Finds new vertices on the edges of vertex i, where they meet the facet of a half-space.
template <int K>
void OuterVertices::go_along_edges(int i, int half_space) {
  const int k = K > 0 ? K : k_;
  const double* normal = half_spaces_.normals + static_cast<std::ptrdiff_t>(half_space) * k;
  const double beyond = beyond_[i];
  const bool goes = beyond > 0.0;
  double slopes[K > 0 ? K : kMostDimensions], u[K > 0 ? K : kMostDimensions];
  std::fill_n(slopes, k, 0.0);
  for (int c = 0; c < k; ++c)
    for (int e = 0; e < k; ++e) slopes[e] += normal[c] * edges(i)[c * k + e];
  for (int e = 0; e < k; ++e) {
    if (goes ? !(slopes[e] < 0.0) : !(beyond + slopes[e] * to_ball_[at(i) + e] > 0.0)) continue;
    const double step = -beyond / slopes[e];
    double squared = 0.0;
    for (int c = 0; c < k; ++c) {
      u[c] = vertex(i)[c] + step * edges(i)[c * k + e];
      squared += u[c] * u[c];
    }
    if (!goes) to_ball_[at(i) + e] = 0.0;
    if (!(squared > radius_ * radius_) || !is_inside<K>(u)) continue;
    std::copy_n(u, k, corner_.data());
    std::copy_n(slopes, k, slopes_.data());
    branch<K>(i, e, half_space);
  }
}

template <int K>
bool OuterVertices::is_inside(const double* u) const {
  const int k = K > 0 ? K : k_, block_size = (k + 1) * kBlock;
  for (std::size_t end = entered_.size(); end > 0; end -= static_cast<std::size_t>(block_size)) {
    const double* block = entered_.data() + end - block_size;
    double sums[kBlock] = {};
    for (int c = 0; c < k; ++c)
      for (int f = 0; f < kBlock; ++f) sums[f] += block[c * kBlock + f] * u[c];
    const double* offsets = block + k * kBlock;
    if ((sums[0] > offsets[0]) | (sums[1] > offsets[1]) | (sums[2] > offsets[2]) | (sums[3] > offsets[3])) return false;
  }
  return true;
}

// Adds the vertex at corner_ on an edge of vertex i, where the half-space's facet takes the place of the one that the
// edge leaves, unless it is known. Facets ascend.
template <int K>
void OuterVertices::branch(int i, int edge, int half_space) {
  const int k = K > 0 ? K : k_;
  int place = 0;
  while (place < k && (place == edge || facets(i)[place] < half_space)) ++place;
  if (place > edge) --place;
  // Column e of vertex i becomes column e, or one to the left or right of it, between the old facet and the new one.
  const double inverse = 1.0 / slopes_[edge];
  double shares[K > 0 ? K : kMostDimensions];
  int source[K > 0 ? K : kMostDimensions];
  FacetIndex new_facets[K > 0 ? K : kMostDimensions];
  for (int e = 0; e < k; ++e) source[e] = e;
  for (int e = edge; e < place; ++e) source[e] = e + 1;
  for (int e = edge; e > place; --e) source[e] = e - 1;
  source[place] = edge;
  for (int e = 0; e < k; ++e) {
    shares[e] = slopes_[source[e]] * inverse;
    new_facets[e] = facets(i)[source[e]];
  }
  new_facets[place] = static_cast<FacetIndex>(half_space);
  // Two vertices that stay may have an edge, and find the same.
  if (!(beyond_[i] > 0.0) && is_known(new_facets)) return;
  const int added = room_for_vertex();
  std::copy_n(corner_.data(), k, &positions_[at(added)]);
  std::copy_n(new_facets, k, &facets_[at(added)]);
  const double* const from = edges(i);
  double* const to = edges(added);
  for (int c = 0; c < k; ++c) {
    const double along = from[c * k + edge];
    for (int e = 0; e < k; ++e) to[c * k + e] = from[c * k + source[e]] - shares[e] * along;
    to[c * k + place] = -inverse * along;
  }
  measure<K>(added);
}

// Whether a vertex that was added with the half-space has these facets.
bool OuterVertices::is_known(const FacetIndex* facets) const {
  return std::any_of(added_.begin(), added_.end(),
                     [&](int other) { return std::equal(facets, facets + k_, this->facets(other)); });
}

// A vertex more while a half-space cuts: in the place of one that goes, and is not needed any more, if there is any.
int OuterVertices::room_for_vertex() {
  int added;
  if (reused_ < free_) {
    added = gone_[reused_++];
    states_[added] = 0;
  } else {
    added = add_vertex();
  }
  added_.push_back(added);
  return added;
}

// Where the edges of vertex i meet the ball.
template <int K>
void OuterVertices::measure(int i) {
  const int k = K > 0 ? K : k_;
  const double *v = vertex(i), *column = edges(i);
  double along[K > 0 ? K : kMostDimensions] = {}, lengths[K > 0 ? K : kMostDimensions] = {}, squared = 0.0;
  for (int c = 0; c < k; ++c, column += k) {
    squared += v[c] * v[c];
    for (int e = 0; e < k; ++e) {
      along[e] += v[c] * column[e];
      lengths[e] += column[e] * column[e];
    }
  }
  squared_norms_[i] = squared;
  const double outside = squared - radius_ * radius_;
  bool any = false;
  for (int e = 0; e < k; ++e) {
    const double discriminant = along[e] * along[e] - lengths[e] * outside;
    const bool meets = along[e] < 0.0 && discriminant > 0.0;
    to_ball_[at(i) + e] = meets ? (-along[e] - std::sqrt(discriminant)) / lengths[e] : 0.0;
    any = any || meets;
  }
  meets_ball_[i] = any;
}

// A vertex more, of which only the state is set.
int OuterVertices::add_vertex() {
  const int i = count();
  states_.push_back(0);
  squared_norms_.push_back(0.0);
  meets_ball_.push_back(0);
  if (positions_.size() < at(i + 1)) {
    const std::size_t capacity = at(2 * i + 64);
    positions_.resize(capacity);
    facets_.resize(capacity);
    to_ball_.resize(capacity);
    edges_.resize(capacity * static_cast<std::size_t>(k_));
  }
  return i;
}

// The last vertex takes the place of vertex i.
void OuterVertices::drop(int i) {
  const int last = count() - 1;
  if (i != last) {
    std::copy_n(vertex(last), k_, &positions_[at(i)]);
    std::copy_n(facets(last), k_, &facets_[at(i)]);
    std::copy_n(&to_ball_[at(last)], k_, &to_ball_[at(i)]);
    std::copy_n(edges(last), k_ * k_, edges(i));
    squared_norms_[i] = squared_norms_[last];
    meets_ball_[i] = meets_ball_[last];
    states_[i] = states_[last];
  }
  states_.pop_back();
  squared_norms_.pop_back();
  meets_ball_.pop_back();
}

}  // namespace graspatlas
