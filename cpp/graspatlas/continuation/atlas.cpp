#include "graspatlas/continuation/atlas.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "graspatlas/continuation/chart.hpp"

namespace graspatlas {

namespace {

// A centre may miss a bound by rounding only.
constexpr double kBoundTolerance = 1e-10;
// Beside smaller charts rounding and the tolerances of points and polytopes are no longer small.
constexpr double kSmallestRadius = 1e-7;

void check_options(const AtlasOptions& options, const System& system) {
  if (!(options.radius > 0.0)) throw Error("radius must be positive, got " + to_text(options.radius));
  if (!(options.radius >= kSmallestRadius))
    throw Error("radius must be at least " + to_text(kSmallestRadius) + ", got " + to_text(options.radius) +
                "; scale the variables of a smaller manifold");
  if (!(options.radius < system.radius_limit()))
    throw Error("radius must be below " + to_text(system.radius_limit()) + " for this system, got " +
                to_text(options.radius));
  if (!(options.epsilon > 0.0) || !(options.epsilon < 1.0))
    throw Error("epsilon must lie between 0 and 1, got " + to_text(options.epsilon));
}

// Half the width of a chart's box. It encloses the ball of the chart's radius, and on a line the box must be wider than
// the ball so that it has ends outside.
double half_width(int dimension, double radius) { return dimension == 1 ? 1.5 * radius : radius; }

}  // namespace

Atlas::Atlas(System& system, const double* x0, const AtlasOptions& options)
    : system_(system),
      options_(options),
      x_size_(system.configuration_size()),
      n_(system.tangent_size()),
      k_(system.dimension()),
      newton_(system, options.newton),
      index_(system.embedding_size()),
      centers_(x_size_),
      bases_(k_ * n_),
      x_new_(x0, x0 + x_size_),
      Phi_new_(static_cast<std::size_t>(k_) * n_),
      step_(n_),
      displacement_(n_),
      p_ij_(k_),
      p_ji_(k_),
      work_(2 * static_cast<std::size_t>(k_) * k_),
      slack_(system.bound_count()),
      bound_in_chart_(k_),
      direction_(k_),
      embedding_(system.embedding_size()) {
  check_options(options, system);
  for (double value : x_new_)
    if (!std::isfinite(value)) throw Error("x0 holds a number that is not finite");
  system.check_point(x0);
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
  if (!inside_bounds(x_new_.data())) {
    const auto worst = std::min_element(slack_.begin(), slack_.end()) - slack_.begin();
    throw Error("x0, projected onto the manifold, breaks the " + system.bound_name(static_cast<int>(worst)) + " by " +
                to_text(-slack_[worst]));
  }
  add_chart();
}

bool Atlas::inside_bounds(const double* x) {
  if (slack_.empty()) return true;
  system_.slack(x, slack_.data());
  for (double s : slack_)
    if (!(s >= -kBoundTolerance)) return false;
  return true;
}

void Atlas::expand(std::int64_t chart_limit, double seconds) {
  const auto start = std::chrono::steady_clock::now();
  while (!open_.empty() && count() < chart_limit) {
    const int i = open_.front();
    const int vertex = polytopes_[i].expandable_vertex(options_.radius);
    if (vertex < 0) {
      open_.pop_front();
      continue;
    }
    expand_vertex(i, vertex);
    if (std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() > seconds) return;
  }
}

void Atlas::expand_vertex(int i, int vertex) {
  const double* v = polytopes_[i].vertex(vertex);
  double norm = 0.0;
  for (int c = 0; c < k_; ++c) norm += v[c] * v[c];
  norm = std::sqrt(norm);
  for (int c = 0; c < k_; ++c) direction_[c] = v[c] / norm;
  vertex_.assign(v, v + k_);

  Closed reason = Closed::open;
  for (double alpha = options_.radius; alpha >= options_.smallest_step * options_.radius; alpha *= options_.shrink) {
    reason = attempt(i, direction_.data(), alpha);
    if (reason == Closed::open) {
      add_chart();
      // The new neighbour cuts the vertex off; should rounding keep it, it must not be expanded again.
      for (int u = 0; u < polytopes_[i].vertex_count(); ++u)
        if (std::equal(vertex_.begin(), vertex_.end(), polytopes_[i].vertex(u)))
          polytopes_[i].close(u, static_cast<std::uint8_t>(Closed::curvature));
      return;
    }
  }
  polytopes_[i].close(vertex, static_cast<std::uint8_t>(reason));
}

// Projects a step of length alpha from chart i into x_new_, Phi_new_: eqs (14) to (18).
Closed Atlas::attempt(int i, const double* direction, double alpha) {
  const double* Phi = basis(i);
  for (int c = 0; c < n_; ++c) {
    double sum = 0.0;
    for (int a = 0; a < k_; ++a) sum += Phi[static_cast<std::size_t>(a) * n_ + c] * direction[a];
    step_[c] = alpha * sum;
  }
  system_.integrate(center(i), step_.data(), x_new_.data());
  ++projections_;
  if (newton_.project(x_new_.data(), Phi) != Projection::converged) return Closed::not_converged;
  if (!inside_bounds(x_new_.data())) return Closed::bounds;
  if (!newton_.tangent_basis(Phi_new_.data())) return Closed::not_converged;
  if (!pass_tests(i, x_new_.data(), Phi_new_.data(), p_ij_.data(), p_ji_.data())) return Closed::curvature;
  return Closed::open;
}

// Eqs (17) and (18) between chart i and a chart at x_j, and the images of each centre in the other's tangent space.
// Eq (17) is a length, which may exceed a chart's own size: then charts on two sides of a fold would cut each other at
// images far from the middle between them, and leave a gap. So the displacement between the centres, too, may differ
// from either tangent space by no larger an angle than eq (18) allows between the spaces.
bool Atlas::pass_tests(int i, const double* x_j, const double* Phi_j, double* p_ij, double* p_ji) {
  system_.difference(center(i), x_j, displacement_.data());
  double squared = 0.0;
  for (int c = 0; c < n_; ++c) squared += displacement_[c] * displacement_[c];
  if (squared > 4.0 * options_.radius * options_.radius) return false;
  const double cosine = 1.0 - options_.epsilon;
  const double limit = std::min(options_.epsilon * options_.epsilon, (1.0 - cosine * cosine) * squared);
  if (project_displacement(basis(i), displacement_.data(), k_, n_, p_ij) > limit) return false;
  if (project_displacement(Phi_j, displacement_.data(), k_, n_, p_ji) > limit) return false;
  for (int a = 0; a < k_; ++a) p_ji[a] = -p_ji[a];
  return tangent_spaces_agree(basis(i), Phi_j, k_, n_, cosine, work_.data());
}

int Atlas::add_chart() {
  const int j = static_cast<int>(count());
  std::copy(x_new_.begin(), x_new_.end(), centers_.add());
  std::copy(Phi_new_.begin(), Phi_new_.end(), bases_.add());
  residuals_.push_back(newton_.residual());
  polytopes_.emplace_back(k_, half_width(k_, options_.radius));
  cut_by_bounds(j);
  meet_neighbours(j);
  open_.push_back(j);
  return j;
}

void Atlas::cut_by_bounds(int i) {
  if (slack_.empty()) return;
  system_.slack(center(i), slack_.data());
  const RowMatrix& B = system_.bound_normals();
  for (int b = 0; b < system_.bound_count(); ++b) {
    double squared = 0.0;
    for (int a = 0; a < k_; ++a) {
      const double* row = basis(i) + static_cast<std::size_t>(a) * n_;
      double dot = 0.0;
      for (int c = 0; c < n_; ++c) dot += B(b, c) * row[c];
      bound_in_chart_[a] = dot;
      squared += dot * dot;
    }
    const double slack = std::max(slack_[b], 0.0);
    // The box reaches sqrt(k) r from the centre: a bound farther away cuts nothing.
    if (slack * slack >= squared * k_ * options_.radius * options_.radius) continue;
    const double norm = std::sqrt(squared);
    for (int a = 0; a < k_; ++a) bound_in_chart_[a] /= norm;
    polytopes_[i].cut(bound_in_chart_.data(), slack / norm, Polytope::bound_tag(b));
  }
}

// Eq (16) and Fig. 6b: two charts of equal radius cut each other at the bisector of the centre and the
// other's image.
void Atlas::meet_neighbours(int j) {
  system_.embed(center(j), embedding_.data());
  index_.within(embedding_.data(), 2.0 * options_.radius, near_);
  index_.insert(embedding_.data());
  for (int i : near_) {
    if (!pass_tests(i, center(j), basis(j), p_ij_.data(), p_ji_.data())) continue;
    double squared_ij = 0.0, squared_ji = 0.0;
    for (int a = 0; a < k_; ++a) {
      squared_ij += p_ij_[a] * p_ij_[a];
      squared_ji += p_ji_[a] * p_ji_[a];
    }
    if (!(squared_ij > 0.0) || !(squared_ji > 0.0)) continue;
    const double norm_ij = std::sqrt(squared_ij), norm_ji = std::sqrt(squared_ji);
    for (int a = 0; a < k_; ++a) {
      p_ij_[a] /= norm_ij;
      p_ji_[a] /= norm_ji;
    }
    polytopes_[i].cut(p_ij_.data(), 0.5 * norm_ij, j);
    polytopes_[j].cut(p_ji_.data(), 0.5 * norm_ji, i);
    pairs_.push_back({i, j});
  }
}

}  // namespace graspatlas
