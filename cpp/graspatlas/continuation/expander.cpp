#include "graspatlas/continuation/expander.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "graspatlas/errors.hpp"
#include "graspatlas/manifold/tangent.hpp"

namespace graspatlas {

namespace {

// The step alpha is multiplied by this after each failed attempt (Algorithm 1, line 11).
constexpr double kShrink = 0.9;
// Several such steps at once, which are foreseen to break a bound, may multiply it by this at least.
constexpr double kMostShrink = 0.4;
// A vertex is closed when alpha falls below this share of the radius.
constexpr double kSmallestStep = 0.05;
// A third chart tells that two are on one sheet when its mismatch with each is at most this share of theirs.
constexpr double kShare = 0.25;
// Entries in a block of lists of neighbours.
constexpr std::size_t kListBlock = 1 << 16;

}  // namespace

Expander::Expander(System& system, const AtlasOptions& options, Charts& charts)
    : system_(system),
      options_(options),
      charts_(charts),
      x_size_(system.configuration_size()),
      n_(system.tangent_size()),
      k_(system.dimension()),
      newton_(system),
      test_(system, newton_, options.radius, options.epsilon),
      bounds_(system),
      x_new_(x_size_),
      Phi_new_(static_cast<std::size_t>(k_) * n_),
      step_(n_),
      bound_in_chart_(k_),
      direction_(k_),
      vertex_(k_),
      embedding_(system.embedding_size()),
      polytope_(k_, box_half_width(k_, options.radius), listed_vertices(k_)),
      beside_(n_, k_) {
  newton_.set_scales(&charts.scales());
  const RowMatrix& B = system.bound_normals();
  for (Eigen::Index b = 0; b < B.rows(); ++b) bound_reach_.push_back(std::sqrt(k_) * options.radius * B.row(b).norm());
}

void Expander::start(const double* x0) {
  x_new_.assign(x0, x0 + x_size_);
  ++projections_;
  switch (newton_.project_freely(x_new_.data(), Phi_new_.data())) {
    case Projection::converged:
      break;
    case Projection::singular:
      throw Error(
          "the Jacobian at x0 has lost rank: the equations are redundant there, so the solutions near x0 are "
          "not a manifold of dimension " +
          std::to_string(k_) + "; drop redundant equations or move x0");
    case Projection::not_converged:
      throw Error("x0 is not on the manifold and could not be projected onto it: residual " +
                  to_text(newton_.residual()));
  }
  newton_.project(x_new_.data(), Phi_new_.data());  // for its factorisation
  charts_.scales() = newton_.row_sizes();
  residual_new_ = newton_.residual();
  regularity_new_ = newton_.regularity();
  if (!bounds_.inside(x_new_.data())) {
    const std::vector<double>& slacks = bounds_.slacks(x_new_.data());
    const auto worst = std::min_element(slacks.begin(), slacks.end()) - slacks.begin();
    throw Error("x0, projected onto the manifold, breaks the " + system_.bound_name(static_cast<int>(worst)) + " by " +
                to_text(-slacks[static_cast<std::size_t>(worst)]));
  }
  add_chart(0);
}

void Expander::put_back(const double* center, const double* basis, double residual, double regularity, ChartKey key) {
  if (charts_.count() == 0) {
    x_new_.assign(center, center + x_size_);
    newton_.project(x_new_.data(), basis);
    charts_.scales() = newton_.row_sizes();
  }
  x_new_.assign(center, center + x_size_);
  Phi_new_.assign(basis, basis + static_cast<std::ptrdiff_t>(k_) * n_);
  residual_new_ = residual;
  regularity_new_ = regularity;
  add_chart(key);
}

void Expander::start_at(const double* x, const double* Phi, ChartKey key) {
  x_new_.assign(x, x + x_size_);
  Phi_new_.assign(Phi, Phi + static_cast<std::ptrdiff_t>(k_) * n_);
  newton_.project(x_new_.data(), Phi_new_.data());  // for its factorisation
  residual_new_ = newton_.residual();
  regularity_new_ = newton_.regularity();
  add_chart(key);
}

bool Expander::expand(int i, ChartKey key, int most, int& made, Clock::time_point deadline) {
  while (made < most) {
    const int vertex = charts_[i].polytope.expandable_vertex(options_.radius, cut_scratch_);
    if (vertex < 0) {
      charts_[i].done = true;
      return true;
    }
    if (expand_vertex(i, vertex, key + static_cast<ChartKey>(made))) ++made;
    if (Clock::now() > deadline) break;
  }
  return false;
}

bool Expander::expand_vertex(int i, int vertex, ChartKey key) {
  Polytope& polytope = charts_[i].polytope;
  vertex_.assign(polytope.vertex(vertex), polytope.vertex(vertex) + k_);
  const double norm = std::sqrt(squared_length(vertex_.data(), k_));
  for (int c = 0; c < k_; ++c) direction_[c] = vertex_[c] / norm;

  const double shortest = kSmallestStep * options_.radius;
  Closed reason = Closed::open;
  for (double alpha = options_.radius; alpha >= shortest;) {
    reason = attempt(i, direction_.data(), alpha);
    if (reason == Closed::open) {
      add_chart(key);
      // The new neighbour cuts the vertex off; should rounding keep it, it must not be expanded again.
      polytope.expandable_vertex(options_.radius, cut_scratch_);
      for (int u = 0; u < polytope.vertex_count(); ++u)
        if (std::equal(vertex_.begin(), vertex_.end(), polytope.vertex(u))) close(i, u, Closed::curvature);
      return true;
    }
    const double longest = reason == Closed::bounds ? std::max(within_bounds(i, alpha), kMostShrink * alpha) : alpha;
    // The last length is tried whatever is foreseen.
    do alpha *= kShrink;
    while (alpha > longest && alpha * kShrink >= shortest);
  }
  close(i, vertex, reason);
  return false;
}

void Expander::close(int i, int vertex, Closed reason) {
  charts_[i].polytope.close(vertex, static_cast<std::uint8_t>(reason));
  charts_[i].closed = true;
}

// How far from the centre of chart i, along the step of length alpha that broke bounds, these are met: where the
// parabola through a bound's slack at the centre, with its slope there, and at x_new_ falls below zero.
double Expander::within_bounds(int i, double alpha) {
  const RowMatrix& B = system_.bound_normals();
  slacks_new_ = bounds_.slacks(x_new_.data());
  const std::vector<double>& slacks = bounds_.slacks(charts_.center(i));
  double longest = alpha;
  for (std::size_t b = 0; b < slacks.size(); ++b) {
    if (slacks_new_[b] >= 0.0) continue;
    double along = 0.0;
    for (int c = 0; c < n_; ++c) along += B(static_cast<Eigen::Index>(b), c) * step_[c];
    const double slack = std::max(slacks[b], 0.0), slope = -along / alpha;
    const double bend = ((slacks_new_[b] - slack) / alpha - slope) / alpha;
    const double root = std::sqrt(std::max(slope * slope - 4.0 * bend * slack, 0.0));
    const double met = slope > 0.0 ? -(slope + root) / (2.0 * bend) : slack > 0.0 ? 2.0 * slack / (root - slope) : 0.0;
    longest = std::min(longest, met);
  }
  return longest;
}

// Projects a step of length alpha from chart i into x_new_, Phi_new_: eqs (14) to (18).
Closed Expander::attempt(int i, const double* direction, double alpha) {
  const double* Phi = charts_.basis(i);
  tangent_vector(Phi, direction, k_, n_, step_.data());
  for (double& s : step_) s *= alpha;
  system_.integrate(charts_.center(i), step_.data(), x_new_.data());
  ++projections_;
  if (newton_.project(x_new_.data(), Phi) != Projection::converged) return Closed::not_converged;
  if (!bounds_.inside(x_new_.data())) return Closed::bounds;
  if (!newton_.tangent_basis(Phi_new_.data())) return Closed::not_converged;
  residual_new_ = newton_.residual();
  test_.put(x_new_.data(), Phi_new_.data());
  const double *x = charts_.center(i), longest = kLongestStep * options_.radius;
  if (!test_.fits(x, Phi, beside_) || beside_.squared > longest * longest) return Closed::curvature;
  regularity_new_ = newton_.regularity();  // while Newton has the factorisation there
  if (!test_.leads_back(x, Phi, beside_)) return Closed::curvature;
  reached_from_ = i;
  return Closed::open;
}

// Whether the candidate fits chart i.
bool Expander::fits(int i) { return test_.fits(charts_.center(i), charts_.basis(i), beside_); }

// Whether the candidate is on one sheet with chart i, which it fits, where that is in doubt: by a chart that both are
// neighbours of, or else by projections.
bool Expander::on_one_sheet(int i) {
  return i == reached_from_ || share_neighbour(i) || test_.leads_back(charts_.center(i), charts_.basis(i), beside_);
}

// Whether a third chart is a neighbour of both with so small mismatches that no other sheet, as far away as the
// mismatch of the two would have it, can lie between.
bool Expander::share_neighbour(int i) const {
  const double most = kShare * kShare * beside_.squared_mismatch;
  const auto are = [&](int younger, int older) {
    const Chart& chart = charts_[younger];
    return std::any_of(chart.neighbours, chart.neighbours + chart.neighbour_count,
                       [&](const Neighbour& other) { return other.slot == older && other.squared_mismatch <= most; });
  };
  return std::any_of(neighbours_.begin(), neighbours_.end(), [&](const Neighbour& third) {
    return third.squared_mismatch <= most && (are(third.slot, i) || are(i, third.slot));
  });
}

// Marks charts within which the Jacobian loses rank: between two it does where its determinant beside their bases
// changes sign; it may where its regularity falls to zero within a radius, at the rate at which it falls between the
// two.
void Expander::compare_regularity(int i, int j) {
  const double distance = std::sqrt(beside_.squared);
  Chart &one = charts_[i], &other = charts_[j];
  const double a = std::abs(one.regularity), b = std::abs(other.regularity);
  const bool turned = test_.turned(beside_);
  Chart& less = a < b ? one : other;
  if (((one.regularity < 0.0) != (other.regularity < 0.0)) != turned)
    less.rank = Rank::lost;
  else if (less.rank == Rank::full && std::min(a, b) * distance < std::abs(a - b) * options_.radius)
    less.rank = Rank::doubtful;
}

// The chart at x_new_: its own polytope first, which is stored when it has its size, then it is shown to others.
void Expander::add_chart(ChartKey key) {
  const int j = charts_.add();
  Chart& chart = charts_[j];
  std::copy(x_new_.begin(), x_new_.end(), charts_.center(j));
  std::copy(Phi_new_.begin(), Phi_new_.end(), charts_.basis(j));
  chart.residual = residual_new_;
  chart.regularity = regularity_new_;
  chart.key = key;
  polytope_.reset(k_, box_half_width(k_, options_.radius));
  cut_by_bounds(j);
  meet_neighbours(j);
  chart.polytope = polytope_;
  chart.neighbours = keep(neighbours_);
  chart.neighbour_count = static_cast<int>(neighbours_.size());
  polytope_bytes_ += chart.polytope.bytes();
  list_bytes_ += static_cast<std::int64_t>(neighbours_.size() * sizeof(Neighbour));
  charts_.publish(j, embedding_.data());
}

void Expander::cut_by_bounds(int j) {
  const RowMatrix& B = system_.bound_normals();
  const std::vector<double>& slacks = bounds_.slacks(charts_.center(j));
  for (int b = 0; b < system_.bound_count(); ++b) {
    const double slack = std::max(slacks[static_cast<std::size_t>(b)], 0.0);
    // The box reaches sqrt(k) r from the centre: a bound farther away cuts nothing, however the chart lies.
    if (slack >= bound_reach_[static_cast<std::size_t>(b)]) continue;
    tangent_coordinates(charts_.basis(j), B.row(b).data(), k_, n_, bound_in_chart_.data());
    const double squared = squared_length(bound_in_chart_.data(), k_);
    if (slack * slack >= squared * k_ * options_.radius * options_.radius) continue;
    const double norm = std::sqrt(squared);
    for (int a = 0; a < k_; ++a) bound_in_chart_[a] /= norm;
    polytope_.cut(bound_in_chart_.data(), slack / norm, Polytope::bound_tag(b), cut_scratch_);
  }
}

// Charts within two radii of x_new_ in the order of the algorithm, into near_.
void Expander::find_near() {
  system_.embed(x_new_.data(), embedding_.data());
  charts_.near(embedding_.data(), 2.0 * options_.radius, near_, near_scratch_);
  sorted_.clear();
  for (const int i : near_) sorted_.emplace_back(charts_[i].key, i);
  std::sort(sorted_.begin(), sorted_.end());
  for (std::size_t a = 0; a < near_.size(); ++a) near_[a] = sorted_[a].second;
}

// Charts that the candidate is on one sheet with beyond doubt come first, since they tell of others.
void Expander::meet_neighbours(int j) {
  test_.put(x_new_.data(), Phi_new_.data());
  find_near();
  neighbours_.clear();
  std::size_t doubtful = 0;
  for (const int i : near_) {
    if (!fits(i)) continue;
    if (test_.beyond_doubt(beside_)) {
      meet(i, j);
      continue;
    }
    if (doubtful == doubtful_.size()) doubtful_.emplace_back(i, Beside(n_, k_));
    doubtful_[doubtful].first = i;
    std::swap(doubtful_[doubtful++].second, beside_);
  }
  for (std::size_t d = 0; d < doubtful; ++d) {
    std::swap(doubtful_[d].second, beside_);
    if (on_one_sheet(doubtful_[d].first)) meet(doubtful_[d].first, j);
  }
  reached_from_ = -1;
}

// Eq (16) and Fig. 6b: two charts of equal radius cut each other at the bisector of the centre and the other's image.
void Expander::meet(int i, int j) {
  double *const p_ij = beside_.p_ij.data(), *const p_ji = beside_.p_ji.data();
  const double norm_ij = std::sqrt(squared_length(p_ij, k_)), norm_ji = std::sqrt(squared_length(p_ji, k_));
  if (!(norm_ij > 0.0) || !(norm_ji > 0.0)) return;
  compare_regularity(i, j);
  for (int a = 0; a < k_; ++a) {
    p_ij[a] /= norm_ij;
    p_ji[a] /= norm_ji;
  }
  Polytope& other = charts_[i].polytope;
  polytope_bytes_ -= other.bytes();
  other.cut(p_ij, 0.5 * norm_ij, j, cut_scratch_);
  polytope_bytes_ += other.bytes();
  if (charts_[i].closed && other.expandable_vertex(options_.radius, cut_scratch_) >= 0 && charts_[i].done) {
    charts_[i].done = false;
    reopened_.push_back(i);
  }
  polytope_.cut(p_ji, 0.5 * norm_ji, i, cut_scratch_);
  neighbours_.push_back({i, static_cast<float>(std::max(beside_.squared_mismatch, 0.0))});
}

// A copy of the list that stays where it is.
const Neighbour* Expander::keep(const std::vector<Neighbour>& list) {
  if (list.size() > list_room_) {
    list_room_ = std::max(kListBlock, list.size());
    lists_.emplace_back(new Neighbour[list_room_]);
    next_list_ = lists_.back().get();
  }
  Neighbour* const copy = next_list_;
  std::copy(list.begin(), list.end(), copy);
  next_list_ += list.size();
  list_room_ -= list.size();
  return copy;
}

}  // namespace graspatlas
