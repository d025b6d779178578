#include "graspatlas/continuation/auditor.hpp"

#include <algorithm>
#include <cmath>

namespace graspatlas {

namespace {

// How far outside a polytope a covered point may lie, as a share of the radius: flat charts of a curved manifold leave
// slivers between them.
constexpr double kSliver = 0.15;
// Random walks: steps of one, and the least and the greatest length of a step as shares of the radius.
constexpr int kWalkSteps = 6;
constexpr double kShortest = 0.05, kLongest = 1.5;
// How often a step that fails is halved, in a walk.
constexpr int kHalvings = 3;
// Part of the random direction of a step beside the one that the walk has.
constexpr double kTurn = 0.3;
// A point of a bound's facet is this far inside the bound, as a share of the radius, where the facet hides something.
constexpr double kHidden = 0.1;
// Vertices of a facet towards which it is looked at.
constexpr int kMostCorners = 3;
// Steps past a facet or beyond a vertex, as shares of the radius: the first, and the shortest before it is given up.
constexpr double kMarchStep = 0.25, kShortestMarch = 1.0 / 4096.0;
constexpr int kMarchSteps = 400;
// Regularity, as a share of that at the centre, at which a chart loses rank; how far away, in radii; steps of the
// search.
constexpr double kRankLost = 0.1, kRankReach = 1.5;
constexpr int kRankSteps = 5, kRankIterations = 4;
// A step of the differences that regularity is derived by, as a share of the radius.
constexpr double kDifference = 1e-3;
// A centre may miss a bound by rounding only.
constexpr double kBoundTolerance = 1e-10;

// The part of a manifold on which one bound is met exactly.
class OnBound : public System {
 public:
  OnBound(System& system, int bound)
      : System(system.configuration_size(), system.tangent_size(), system.equation_count() + 1,
               system.embedding_size()),
        system_(system),
        bound_(bound),
        slack_(static_cast<std::size_t>(system.bound_count())) {}
  void residual(const double* x, double* R) override {
    system_.residual(x, R);
    R[equation_count() - 1] = missed(x);
  }
  void linearize(const double* x, double* R, double* J) override {
    system_.linearize(x, R, J);
    R[equation_count() - 1] = missed(x);
    const RowMatrix& B = system_.bound_normals();
    for (int c = 0; c < tangent_size(); ++c)
      J[static_cast<std::size_t>(equation_count() - 1) * tangent_size() + c] = -B(bound_, c);
  }
  void integrate(const double* x, const double* v, double* out) const override { system_.integrate(x, v, out); }
  void difference(const double* x0, const double* x1, double* out) const override { system_.difference(x0, x1, out); }
  void embed(const double* x, double* out) const override { system_.embed(x, out); }

 private:
  double missed(const double* x) {
    system_.slack(x, slack_.data());
    return slack_[static_cast<std::size_t>(bound_)];
  }

  System& system_;
  int bound_;
  std::vector<double> slack_;
};

}  // namespace

std::uint64_t Dice::bits() {
  std::uint64_t z = (state_ += 0x9e3779b97f4a7c15u);
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
  return z ^ (z >> 31);
}

// Box and Muller's method.
double Dice::normal() {
  const double length = std::sqrt(-2.0 * std::log(1.0 - uniform()));
  return length * std::cos(2.0 * M_PI * uniform());
}

class Auditor::Walker {
 public:
  /// Moves on the manifold of a system whose bounds are those of `bounded`; one bound may be left out.
  Walker(System& system, System& bounded, const AtlasOptions& options, int left_out)
      : system_(system),
        bounded_(bounded),
        left_out_(left_out),
        n_(system.tangent_size()),
        k_(system.dimension()),
        newton(system, options.newton),
        test(system, newton, options.radius, options.epsilon),
        x(system.configuration_size()),
        Phi(static_cast<std::size_t>(k_) * n_),
        heading(n_),
        x_new_(x.size()),
        Phi_new_(Phi.size()),
        step_(n_),
        p_(k_),
        p_back_(k_),
        slack_(static_cast<std::size_t>(bounded.bound_count())) {}

  void put(const double* point, const double* basis) {
    std::copy_n(point, x.size(), x.begin());
    std::copy_n(basis, Phi.size(), Phi.begin());
  }

  /// To the point of the manifold above a point, where about this is the tangent basis. False when there is none, or it
  /// is outside the bounds.
  bool put_above(const double* point, const double* basis) {
    put(point, basis);
    return newton.project(x.data(), basis) == Projection::converged && inside(x.data()) &&
           newton.tangent_basis(Phi.data());
  }

  enum class Step { taken, out_of_bounds, failed };

  /// A step of a length along a direction [k] of the tangent space, to where the two points' charts could be
  /// neighbours.
  Step step(const double* direction, double length) {
    const double norm = std::sqrt(squared_length(direction, k_));
    if (!(norm > 0.0)) return Step::failed;
    tangent_vector(Phi.data(), direction, k_, n_, step_.data());
    for (double& s : step_) s *= length / norm;
    system_.integrate(x.data(), step_.data(), x_new_.data());
    if (newton.project(x_new_.data(), Phi.data()) != Projection::converged) return Step::failed;
    if (!inside(x_new_.data())) return Step::out_of_bounds;
    if (!newton.tangent_basis(Phi_new_.data())) return Step::failed;
    if (!test.passes(x.data(), Phi.data(), x_new_.data(), Phi_new_.data(), p_.data(), p_back_.data()))
      return Step::failed;
    std::copy_n(test.displacement(), n_, heading.begin());
    std::swap(x, x_new_);
    std::swap(Phi, Phi_new_);
    return Step::taken;
  }

  /// Coordinates [k] of a tangent vector [n] here.
  void coordinates(const double* v, double* u) const {
    for (int a = 0; a < k_; ++a) {
      u[a] = 0.0;
      for (int c = 0; c < n_; ++c) u[a] += Phi[static_cast<std::size_t>(a) * n_ + c] * v[c];
    }
  }

  bool inside(const double* point) {
    if (slack_.empty()) return true;
    bounded_.slack(point, slack_.data());
    for (std::size_t b = 0; b < slack_.size(); ++b)
      if (!(slack_[b] >= -kBoundTolerance) && static_cast<int>(b) != left_out_) return false;
    return true;
  }

  int dimension() const { return k_; }

 private:
  System &system_, &bounded_;
  int left_out_, n_, k_;

 public:
  Newton newton;
  NeighbourTest test;
  std::vector<double> x, Phi;   ///< where it is, and the tangent basis there
  std::vector<double> heading;  ///< the last step, as a tangent vector [n]

 private:
  std::vector<double> x_new_, Phi_new_, step_, p_, p_back_, slack_;
};

Auditor::Auditor(System& system, const AtlasOptions& options, const Charts& charts)
    : system_(system),
      options_(options),
      charts_(charts),
      x_size_(system.configuration_size()),
      n_(system.tangent_size()),
      k_(system.dimension()),
      walker_(std::make_unique<Walker>(system, system, options, -1)),
      displacement_(n_),
      u_(k_),
      embedding_(system.embedding_size()),
      x_(x_size_),
      Phi_(static_cast<std::size_t>(k_) * n_),
      slack_(static_cast<std::size_t>(system.bound_count())),
      step_(n_),
      direction_(k_) {
  walker_->newton.set_scales(&charts.scales());
}

Auditor::~Auditor() = default;

bool Auditor::covers(const double* x, const double* Phi) {
  system_.embed(x, embedding_.data());
  // Mostly it is one of the nearest.
  for (const double reach : {0.8 * options_.radius, 2.0 * options_.radius}) {
    charts_.near(embedding_.data(), reach, near_, near_scratch_);
    for (const int slot : near_)
      if (covers(slot, x, Phi)) return true;
  }
  return false;
}

bool Auditor::covers(int slot, const double* x, const double* Phi) {
  const double *center = charts_.center(slot), *basis = charts_.basis(slot);
  system_.difference(center, x, displacement_.data());
  const double off = project_displacement(basis, displacement_.data(), k_, n_, u_.data());
  return off <= options_.epsilon * options_.epsilon &&
         charts_[slot].polytope.contains(u_.data(), kSliver * options_.radius) &&
         walker_->test.leads_to(center, basis, u_.data(), x, Phi);
}

// False when no chart covers the point, which then is a hole.
bool Auditor::look_up(const double* x, const double* Phi, std::vector<Hole>& holes) {
  if (covers(x, Phi)) return true;
  holes.push_back({std::vector<double>(x, x + x_size_), std::vector<double>(Phi, Phi + Phi_.size())});
  return false;
}

int Auditor::walk(int slot, std::uint64_t seed, std::vector<Hole>& holes) {
  Dice dice(seed);
  walker_->put(charts_.center(slot), charts_.basis(slot));
  return random_steps(*walker_, dice, false, holes);
}

// Steps that keep their direction, more or less; what cannot be stepped to is left out. Ends at the first hole.
int Auditor::random_steps(Walker& walker, Dice& dice, bool on_bound, std::vector<Hole>& holes) {
  const int k = walker.dimension();
  std::fill(walker.heading.begin(), walker.heading.end(), 0.0);
  int points = 0;
  for (int i = 0; i < kWalkSteps; ++i) {
    walker.coordinates(walker.heading.data(), direction_.data());
    const double old = std::sqrt(squared_length(direction_.data(), k));
    for (int a = 0; a < k; ++a) direction_[a] = (old > 0.0 ? direction_[a] / old / kTurn : 0.0) + dice.normal();
    double length = options_.radius * kLongest * std::pow(kShortest / kLongest, dice.uniform() * dice.uniform());
    auto taken = walker.step(direction_.data(), length);
    for (int halving = 0; taken != Walker::Step::taken && halving < kHalvings; ++halving)
      taken = walker.step(direction_.data(), length *= 0.5);
    if (taken != Walker::Step::taken) {
      std::fill(walker.heading.begin(), walker.heading.end(), 0.0);
      continue;
    }
    if (on_bound) {  // the walker's basis is that of the bound: the whole one comes along beside it
      walker_->x = walker.x;
      if (walker_->newton.project(walker_->x.data(), walker_->Phi.data()) != Projection::converged ||
          !walker_->newton.tangent_basis(walker_->Phi.data()))
        break;
    }
    ++points;
    if (!look_up(walker_->x.data(), walker_->Phi.data(), holes)) break;
  }
  return points;
}

Auditor::Walker& Auditor::bound_walker(int bound) {
  std::unique_ptr<Walker>& walker = bound_walkers_[bound];
  if (!walker) {
    auto system = std::make_unique<OnBound>(system_, bound);
    walker = std::make_unique<Walker>(*system, system_, options_, bound);
    bound_systems_.push_back(std::move(system));
  }
  return *walker;
}

int Auditor::walk_along_bound(int slot, std::uint64_t seed, std::vector<Hole>& holes) {
  if (k_ < 2) return 0;
  Dice dice(seed);
  const Polytope& polytope = charts_[slot].polytope;
  int facets = 0, chosen = -1;
  for (int f = 0; f < polytope.facet_slots(); ++f)
    if (polytope.facet_active(f) && polytope.tag(f) <= Polytope::bound_tag(0) &&
        dice.uniform() * static_cast<double>(++facets) < 1.0)
      chosen = f;
  if (chosen < 0) return 0;
  facet_samples(polytope, chosen);
  const int sample = static_cast<int>(dice.uniform() * static_cast<double>(samples_.size()) / k_);
  tangent_vector(charts_.basis(slot), &samples_[static_cast<std::size_t>(sample) * k_], k_, n_, step_.data());
  system_.integrate(charts_.center(slot), step_.data(), x_.data());
  Walker& walker = bound_walker(Polytope::bound_of(polytope.tag(chosen)));
  tangent_vectors_across(polytope.normal(chosen), charts_.basis(slot));
  if (!walker.put_above(x_.data(), Phi_.data())) return 0;
  walker_->put(x_.data(), charts_.basis(slot));
  return random_steps(walker, dice, true, holes);
}

// Into Phi_: an orthonormal basis [k - 1 x n] of the tangent vectors at right angles to that with coordinates `normal`,
// a unit vector: the reflection that moves an axis onto the normal moves the other axes there.
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
    tangent_vector(basis, u_.data(), k_, n_, &Phi_[static_cast<std::size_t>(row++) * n_]);
  }
}

// Into samples_: the centre of a facet's vertices, and points between it and some of them.
void Auditor::facet_samples(const Polytope& polytope, int facet) {
  samples_.assign(static_cast<std::size_t>(k_), 0.0);
  const double tolerance = 1e-9 * options_.radius;
  int count = 0;
  for (int v = 0; v < polytope.vertex_count(); ++v) {
    const double* u = polytope.vertex(v);
    double off = -polytope.offset(facet);
    for (int c = 0; c < k_; ++c) off += polytope.normal(facet)[c] * u[c];
    if (std::abs(off) > tolerance) continue;
    ++count;
    samples_.insert(samples_.end(), u, u + k_);
    for (int c = 0; c < k_; ++c) samples_[c] += u[c];
  }
  for (int c = 0; c < k_; ++c) samples_[c] /= std::max(count, 1);
  corners_.assign(samples_.begin() + k_, samples_.end());
  samples_.resize(static_cast<std::size_t>(k_));
  const int kept = std::min(count, kMostCorners);  // of many some, evenly
  for (int i = 0; i < kept; ++i) {
    const double* corner = &corners_[static_cast<std::size_t>(i * count / kept) * k_];
    for (const double share : {1.0 / 3.0, 2.0 / 3.0})
      for (int c = 0; c < k_; ++c) samples_.push_back(samples_[c] + share * (corner[c] - samples_[c]));
  }
}

int Auditor::look_behind_bounds(int slot, std::vector<Hole>& holes) {
  const Chart& chart = charts_[slot];
  const double *center = charts_.center(slot), *basis = charts_.basis(slot);
  const RowMatrix& B = system_.bound_normals();
  bool held = false;
  int points = 0;
  for (int f = 0; f < chart.polytope.facet_slots(); ++f) {
    if (!chart.polytope.facet_active(f) || chart.polytope.tag(f) > Polytope::bound_tag(0)) continue;
    const int bound = Polytope::bound_of(chart.polytope.tag(f));
    tangent_vector(basis, chart.polytope.normal(f), k_, n_, step_.data());
    double slope = 0.0;  // of the bound along the facet's normal
    for (int c = 0; c < n_; ++c) slope += B(bound, c) * step_[c];
    facet_samples(chart.polytope, f);
    for (std::size_t s = 0; s < samples_.size(); s += static_cast<std::size_t>(k_)) {
      ++points;
      if (!held && !walker_->newton.hold(center, basis)) return points;
      held = true;
      tangent_vector(basis, &samples_[s], k_, n_, step_.data());
      system_.integrate(center, step_.data(), x_.data());
      if (!walker_->newton.approach(x_.data())) continue;
      system_.slack(x_.data(), slack_.data());
      if (!(slack_[static_cast<std::size_t>(bound)] > kHidden * options_.radius * slope)) continue;
      if (*std::min_element(slack_.begin(), slack_.end()) < 0.0) continue;
      // Further out from there.
      held = false;
      walker_->put(center, basis);
      u_.assign(&samples_[s], &samples_[s] + k_);
      const double length = std::sqrt(squared_length(u_.data(), k_));
      if (length > 0.0 && walker_->step(u_.data(), length) != Walker::Step::taken) continue;
      tangent_vector(basis, chart.polytope.normal(f), k_, n_, step_.data());
      const std::size_t before = holes.size();
      march(*walker_, step_.data(), options_.radius, holes);
      if (holes.size() > before) return points;
    }
  }
  return points;
}

// Goes on along a tangent vector [n] by short steps until it has come as far as `reach`: then true. Every point is
// looked up; false at the first hole, and where it cannot go on.
bool Auditor::march(Walker& walker, const double* direction, double reach, std::vector<Hole>& holes) {
  march_ended_by_bounds_ = false;
  std::copy_n(direction, n_, walker.heading.begin());
  double length = kMarchStep * options_.radius, come = 0.0;
  for (int i = 0; i < kMarchSteps && come < reach; ++i) {
    walker.coordinates(walker.heading.data(), direction_.data());
    auto taken = walker.step(direction_.data(), length);
    bool bounded = taken == Walker::Step::out_of_bounds;
    while (taken != Walker::Step::taken && length > kShortestMarch * options_.radius) {
      taken = walker.step(direction_.data(), length *= 0.5);
      bounded = bounded || taken == Walker::Step::out_of_bounds;
    }
    if (taken != Walker::Step::taken) {
      march_ended_by_bounds_ = bounded;
      return false;
    }
    come += length;
    length = std::min(2.0 * length, kMarchStep * options_.radius);
    if (!look_up(walker.x.data(), walker.Phi.data(), holes)) return false;
  }
  return come >= reach;
}

Closed Auditor::look_beyond(int slot, int vertex, std::vector<Hole>& holes) {
  const Polytope& polytope = charts_[slot].polytope;
  const auto reason = static_cast<Closed>(polytope.state(vertex));
  const double* u = polytope.vertex(vertex);
  walker_->put(charts_.center(slot), charts_.basis(slot));
  tangent_vector(charts_.basis(slot), u, k_, n_, step_.data());
  const double reach = std::sqrt(squared_length(u, k_)) + 0.5 * options_.radius;
  const std::size_t before = holes.size();
  if (march(*walker_, step_.data(), reach, holes)) return Closed::covered;
  return holes.size() == before && march_ended_by_bounds_ ? Closed::bounds : reason;
}

double Auditor::regularity_at(const double* x, const double* Phi) {
  return walker_->newton.hold(x, Phi) ? std::abs(walker_->newton.regularity(kRankIterations)) : 0.0;
}

// Steps of Newton's method down to where the regularity is zero, while it falls.
bool Auditor::loses_rank(int slot) {
  walker_->put(charts_.center(slot), charts_.basis(slot));
  double value = regularity_at(walker_->x.data(), walker_->Phi.data()), come = 0.0;
  const double goal = kRankLost * value, h = kDifference * options_.radius;
  for (int i = 0; i < kRankSteps; ++i) {
    if (value <= goal && i > 0) return true;
    for (int a = 0; a < k_; ++a) {
      std::fill(u_.begin(), u_.end(), 0.0);
      u_[a] = h;
      tangent_vector(walker_->Phi.data(), u_.data(), k_, n_, step_.data());
      system_.integrate(walker_->x.data(), step_.data(), x_.data());
      direction_[a] = (value - regularity_at(x_.data(), walker_->Phi.data())) / h;
    }
    const double slope = std::sqrt(squared_length(direction_.data(), k_));
    double length = value / std::max(slope, 1e-300);
    if (!(length > 0.0) || come + length > kRankReach * options_.radius) return false;
    auto taken = walker_->step(direction_.data(), length);
    for (int halving = 0; taken != Walker::Step::taken && halving < kHalvings; ++halving)
      taken = walker_->step(direction_.data(), length *= 0.5);
    if (taken != Walker::Step::taken) return false;
    come += length;
    const double next = regularity_at(walker_->x.data(), walker_->Phi.data());
    if (next >= value && next > goal) return false;
    value = next;
  }
  return value <= goal;
}

}  // namespace graspatlas
