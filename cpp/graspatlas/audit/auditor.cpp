#include "graspatlas/audit/auditor.hpp"

#include <algorithm>
#include <cmath>

namespace graspatlas {

namespace {

// How far outside a polytope a covered point may lie, as a share of the radius: flat charts of a curved manifold leave
// slivers between them.
constexpr double kSliver = 0.15;
// Of the charts that may cover a point, as far as `kFarthest`, those as near as `kNearest` are looked at first, of
// which mostly one does [radii].
constexpr double kNearest = 0.8, kFarthest = 2.0;
// Random walks: steps of one, and the least and the greatest length of a step as shares of the radius.
constexpr int kWalkSteps = 6;
constexpr double kShortestStep = 0.05, kLongestWalkStep = 1.5;
// How often a step that fails is halved, in a walk.
constexpr int kWalkHalvings = 3;
// Part of the random direction of a step beside the one that the walk has.
constexpr double kRandomPart = 0.3;
// How often a facet of a bound is chosen before one is not empty.
constexpr int kFacetTries = 4;
// A point of a bound's facet is this far inside the bound, as a share of the radius, where the facet hides something.
constexpr double kHidden = 0.1;
// Steps past a facet or beyond a vertex, as shares of the radius: the first, and the shortest before it is given up.
constexpr double kMarchStep = 0.25, kShortestMarch = 1.0 / 4096.0;
constexpr int kMarchSteps = 400;
// How far beyond a closed vertex is looked, as a share of the radius.
constexpr double kBeyondVertex = 0.5;

}  // namespace

Auditor::Auditor(System& system, const AtlasOptions& options, const Charts& charts)
    : system_(system),
      options_(options),
      charts_(charts),
      n_(system.tangent_size()),
      k_(system.dimension()),
      walker_(system, system, options),
      rank_search_(system, walker_, options.radius),
      bounds_(system),
      displacement_(n_),
      u_(k_),
      embedding_(system.embedding_size()),
      x_(system.configuration_size()),
      Phi_across_(static_cast<std::size_t>(k_ - 1) * n_),
      step_(n_),
      direction_(k_) {
  walker_.newton().set_scales(&charts.scales());
}

bool Auditor::covers(const double* x, const double* Phi) {
  system_.embed(x, embedding_.data());
  charts_.near(embedding_.data(), kNearest * options_.radius, nearest_, near_scratch_);
  for (const int slot : nearest_)
    if (covers(slot, x, Phi)) return true;
  charts_.near(embedding_.data(), kFarthest * options_.radius, near_, near_scratch_);
  return std::any_of(near_.begin(), near_.end(), [&](int slot) {
    return std::find(nearest_.begin(), nearest_.end(), slot) == nearest_.end() && covers(slot, x, Phi);
  });
}

bool Auditor::covers(int slot, const double* x, const double* Phi) {
  const double *center = charts_.center(slot), *basis = charts_.basis(slot);
  system_.difference(center, x, displacement_.data());
  const double off = project_on_tangent_space(basis, displacement_.data(), k_, n_, u_.data());
  return off <= options_.epsilon * options_.epsilon &&
         charts_[slot].polytope.contains(u_.data(), kSliver * options_.radius) &&
         walker_.test().leads_to(center, basis, u_.data(), x, Phi);
}

// False when no chart covers the point, which then is a hole.
bool Auditor::look_up(const double* x, const double* Phi, std::vector<Hole>& holes) {
  if (covers(x, Phi)) return true;
  const auto basis_size = static_cast<std::ptrdiff_t>(k_) * n_;
  holes.push_back(
      {std::vector<double>(x, x + system_.configuration_size()), std::vector<double>(Phi, Phi + basis_size)});
  return false;
}

int Auditor::walk(int slot, std::uint64_t seed, std::vector<Hole>& holes) {
  SplitMix64 random(seed);
  walker_.put(charts_.center(slot), charts_.basis(slot));
  return random_steps(walker_, random, holes);
}

// Steps that keep their direction, more or less; what cannot be stepped to is left out. Ends at the first hole. Another
// walker than walker_ has a basis of the bound that it walks along: the whole one comes along beside it.
int Auditor::random_steps(Walker& walker, SplitMix64& random, std::vector<Hole>& holes) {
  std::vector<double>& heading = walker.heading();
  std::fill(heading.begin(), heading.end(), 0.0);
  int points = 0;
  for (int i = 0; i < kWalkSteps; ++i) {
    random_direction(walker, random);
    double length = options_.radius * kLongestWalkStep *
                    std::pow(kShortestStep / kLongestWalkStep, random.uniform() * random.uniform());
    if (walker.step_halving(direction_.data(), length, kWalkHalvings) != Walker::Step::taken) {
      std::fill(heading.begin(), heading.end(), 0.0);
      continue;
    }
    if (&walker != &walker_ && !walker_.follow(walker.x())) break;
    ++points;
    if (!look_up(walker_.x(), walker_.Phi(), holes)) break;
  }
  return points;
}

// Into direction_: near the heading of a walker, if it has any.
void Auditor::random_direction(Walker& walker, SplitMix64& random) {
  walker.heading_coordinates(direction_.data());
  const int k = walker.dimension();
  const double old = std::sqrt(squared_length(direction_.data(), k));
  for (int a = 0; a < k; ++a) direction_[a] = (old > 0.0 ? direction_[a] / old / kRandomPart : 0.0) + random.normal();
}

Walker& Auditor::bound_walker(int bound) {
  std::unique_ptr<BoundWalker>& found = bound_walkers_[bound];
  if (!found) found = std::make_unique<BoundWalker>(system_, bound, options_);
  return found->walker;
}

// Any of the facets that bounds make, each as likely as the others; -1 if there is none.
int Auditor::random_bound_facet(const Polytope& polytope, SplitMix64& random) const {
  int facets = 0, chosen = -1;
  for (int f = 0; f < polytope.facet_slots(); ++f)
    if (polytope.facet_active(f) && Polytope::is_bound(polytope.tag(f)) &&
        random.uniform() * static_cast<double>(++facets) < 1.0)
      chosen = f;
  return chosen;
}

int Auditor::walk_along_bound(int slot, std::uint64_t seed, std::vector<Hole>& holes) {
  if (k_ < 2) return 0;
  SplitMix64 random(seed);
  const Polytope& polytope = charts_[slot].polytope;
  int facet = -1;
  for (int tries = 0; tries < kFacetTries; ++tries) {
    facet = random_bound_facet(polytope, random);
    if (facet < 0) return 0;
    samples_.take(polytope, facet, options_.radius);
    if (samples_.count() > 0) break;
  }
  if (samples_.count() == 0) return 0;
  const int sample = static_cast<int>(random.uniform() * static_cast<double>(samples_.count() * k_) / k_);
  tangent_vector(charts_.basis(slot), samples_[sample], k_, n_, step_.data());
  system_.integrate(charts_.center(slot), step_.data(), x_.data());
  Walker& walker = bound_walker(Polytope::bound_of(polytope.tag(facet)));
  tangent_vectors_across(polytope.normal(facet), charts_.basis(slot));
  if (!walker.put_above(x_.data(), Phi_across_.data())) return 0;
  walker_.put(x_.data(), charts_.basis(slot));
  return random_steps(walker, random, holes);
}

// Into Phi_across_: an orthonormal basis [k - 1 x n] of the tangent vectors at right angles to that with coordinates
// `normal`, a unit vector: the reflection that moves an axis onto the normal moves the other axes there.
void Auditor::tangent_vectors_across(const double* normal, const double* basis) {
  int axis = 0;
  for (int c = 1; c < k_; ++c)
    if (std::abs(normal[c]) > std::abs(normal[axis])) axis = c;
  const double sign = normal[axis] < 0.0 ? -1.0 : 1.0;
  for (int i = 0, row = 0; i < k_; ++i) {
    if (i == axis) continue;
    for (int c = 0; c < k_; ++c) {
      const double w = normal[c] + (c == axis ? sign : 0.0);
      u_[c] = (c == i ? 1.0 : 0.0) - w * normal[i] / (1.0 + std::abs(normal[axis]));
    }
    tangent_vector(basis, u_.data(), k_, n_, &Phi_across_[static_cast<std::size_t>(row++) * n_]);
  }
}

void Auditor::look_behind_bounds(int slot, std::vector<Hole>& holes) {
  const Polytope& polytope = charts_[slot].polytope;
  const double *center = charts_.center(slot), *basis = charts_.basis(slot);
  const RowMatrix& B = system_.bound_normals();
  bool held = false;  // the walker's Newton holds the factorisation at the centre
  for (int f = 0; f < polytope.facet_slots(); ++f) {
    if (!polytope.facet_active(f) || !Polytope::is_bound(polytope.tag(f))) continue;
    const int bound = Polytope::bound_of(polytope.tag(f));
    tangent_vector(basis, polytope.normal(f), k_, n_, step_.data());
    double slope = 0.0;  // of the bound along the facet's normal
    for (int c = 0; c < n_; ++c) slope += B(bound, c) * step_[c];
    samples_.take(polytope, f, options_.radius);
    for (int s = 0; s < samples_.count(); ++s) {
      if (!held && !walker_.newton().hold(center, basis)) return;
      held = true;
      if (!is_hidden(slot, bound, samples_[s], slope)) continue;
      held = false;
      if (finds_hole_beyond(slot, f, samples_[s], holes)) return;
    }
  }
}

// Whether the manifold above a point of a bound's facet is well inside that bound, and inside all.
bool Auditor::is_hidden(int slot, int bound, const double* sample, double slope) {
  tangent_vector(charts_.basis(slot), sample, k_, n_, step_.data());
  system_.integrate(charts_.center(slot), step_.data(), x_.data());
  if (!walker_.newton().approach(x_.data())) return false;
  const std::vector<double>& slacks = bounds_.slacks(x_.data());
  return slacks[static_cast<std::size_t>(bound)] > kHidden * options_.radius * slope &&
         !(*std::min_element(slacks.begin(), slacks.end()) < 0.0);
}

// Marches from a point of a facet along the facet's normal.
bool Auditor::finds_hole_beyond(int slot, int facet, const double* sample, std::vector<Hole>& holes) {
  const double* basis = charts_.basis(slot);
  walker_.put(charts_.center(slot), basis);
  const double length = std::sqrt(squared_length(sample, k_));
  if (length > 0.0 && walker_.step(sample, length) != Walker::Step::taken) return false;
  tangent_vector(basis, charts_[slot].polytope.normal(facet), k_, n_, step_.data());
  return march(step_.data(), options_.radius, holes) == March::hole;
}

// Goes on along a tangent vector [n] by short steps until it has come as far as `reach`. Every point is looked up.
Auditor::March Auditor::march(const double* direction, double reach, std::vector<Hole>& holes) {
  std::copy_n(direction, n_, walker_.heading().begin());
  double length = kMarchStep * options_.radius, travelled = 0.0;
  for (int i = 0; i < kMarchSteps && travelled < reach; ++i) {
    walker_.heading_coordinates(direction_.data());
    auto taken = walker_.step(direction_.data(), length);
    bool bounded = taken == Walker::Step::out_of_bounds;
    while (taken != Walker::Step::taken && length > kShortestMarch * options_.radius) {
      taken = walker_.step(direction_.data(), length *= 0.5);
      bounded = bounded || taken == Walker::Step::out_of_bounds;
    }
    if (taken != Walker::Step::taken) return bounded ? March::bounds : March::failed;
    travelled += length;
    length = std::min(2.0 * length, kMarchStep * options_.radius);
    if (!look_up(walker_.x(), walker_.Phi(), holes)) return March::hole;
  }
  return travelled >= reach ? March::arrived : March::failed;
}

Closed Auditor::look_beyond(int slot, int vertex, std::vector<Hole>& holes) {
  const Polytope& polytope = charts_[slot].polytope;
  const double* u = polytope.vertex(vertex);
  walker_.put(charts_.center(slot), charts_.basis(slot));
  tangent_vector(charts_.basis(slot), u, k_, n_, step_.data());
  const double reach = std::sqrt(squared_length(u, k_)) + kBeyondVertex * options_.radius;
  switch (march(step_.data(), reach, holes)) {
    case March::arrived:
      return Closed::covered;
    case March::bounds:
      return Closed::bounds;
    default:
      return static_cast<Closed>(polytope.state(vertex));
  }
}

}  // namespace graspatlas
