#include "graspatlas/climb/climber.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace graspatlas {

namespace {

constexpr int kIdsOfRequirement = 1 << 20;  // more than any requirement has rows
// Of the penalty: where it starts, and the most that it becomes. [relative gain of the index for a unit missed]
constexpr double kFirstPenalty = 10.0, kLargestPenalty = 1e8;
constexpr double kLeastProgress = 0.1;  // share of what is missed that a step must promise to repair
// A repair goes on while each so many steps leave less than this share of what was missed before.
constexpr int kRepairSteps = 10;
constexpr double kRepairShare = 0.8;
// A climb ends where each so many steps, all of them tiny, gain less than this.
constexpr int kTinySteps = 25;
constexpr double kTinyGain = 1e-9;
constexpr double kAccepted = 1e-4;                  // share of the promised gain that a step must give
constexpr double kRounding = 1e-11;                 // of gains
constexpr double kRoundingOfSlacks = 2e-9;          // distances are known to 1e-10 m
constexpr double kSteered = 1e-7;                   // what is missed by less does not make the penalty larger
constexpr double kHardlyMissed = 1e-9;              // what is not made good by the next step
constexpr double kGrowth = 2.5, kMostGrowth = 4.0;  // of the trust radius
constexpr double kShortest = 1e-9;  // trust radius at which a climb has stalled [units of the tangent space]
constexpr double kKinkSize = 1e-5;  // at most so far from a kink its slopes are taken when a climb converges
constexpr double kTiny = 1e-7;      // trust radius at which slopes around are sampled
constexpr int kMostSamplings = 4;
constexpr double kSameEnd = 1e-6;  // relative difference of indices that rounding of requirements makes

double missed_of(double slack) { return std::max(-slack, 0.0); }

}  // namespace

Climber::Climber(System& system, Measure& index, std::vector<Measure*> requirements, ClimbOptions options)
    : system_(system),
      index_(index),
      requirements_(std::move(requirements)),
      options_(options),
      newton_(system),
      program_(system.dimension()),
      here_(system),
      k_(system.dimension()),
      Phi_(static_cast<std::size_t>(k_) * system.tangent_size()),
      trial_Phi_(Phi_),
      step_(system.tangent_size()),
      rows_(k_),
      old_rows_(k_),
      index_row_(k_) {}

ClimbEnd Climber::climb(const double* x, const std::function<bool()>& on) {
  if (begin(x)) {
    status_ = ClimbStatus::given_up;
    for (int steps = 0; steps < options_.max_steps && on(); ++steps)
      if (gets_nowhere(steps) || step() == Outcome::ended) break;
  }
  return end();
}

// Looks back now and then: whether a repair makes too little good, or a climb gains next to nothing in tiny steps.
bool Climber::gets_nowhere(int steps) {
  if (repairing_ && steps % kRepairSteps == 0) {
    status_ = current_.missed > kRepairShare * missed_before_ ? ClimbStatus::not_met : ClimbStatus::given_up;
    missed_before_ = current_.missed;
    return status_ == ClimbStatus::not_met;
  }
  if (!repairing_ && steps % kTinySteps == 0) {
    const bool still =
        trust_radius_ < kShort && has_best_ && best_.value <= best_before_ + kTinyGain * std::abs(best_before_);
    status_ = still ? ClimbStatus::stalled : ClimbStatus::given_up;
    best_before_ = has_best_ ? best_.value : -HUGE_VAL;
    return still;
  }
  return false;
}

double Climber::missed(const double* x) {
  if (!begin(x)) return HUGE_VAL;
  return current_.blocked ? HUGE_VAL : std::max(current_.missed, 0.0);
}

bool Climber::begin(const double* x) {
  current_ = Point();
  current_.x.assign(x, x + system_.configuration_size());
  has_best_ = logarithmic_ = has_curvature_ = false;
  scale_ = 1.0;
  trust_radius_ = options_.trust_radius;
  penalty_ = kFirstPenalty;
  kkt_ = HUGE_VAL;
  missed_before_ = HUGE_VAL;
  best_before_ = -HUGE_VAL;
  cuts_.clear();
  here_.set_step(Surroundings::kStep);
  values_.clear();
  evaluations_ = challenges_ = samplings_ = 0;
  status_ = ClimbStatus::stalled;
  if (newton_.project_freely(current_.x.data(), Phi_.data()) != Projection::converged) return false;
  B_ = Matrix::Identity(k_, k_);
  reach_ = 2.0 * trust_radius_;
  repairing_ = true;
  linearize_current();
  // What has no row is asked for at the start too.
  std::swap(trial_, current_);
  trial_.slacks.resize(static_cast<std::size_t>(rows_.size()));
  look_at_trial();
  std::swap(trial_, current_);
  if (!(current_.missed > kMet) && !current_.blocked) start_climbing();
  return true;
}

// Rows of the requirements, and of the index if asked for, at a point.
void Climber::linearize(const std::vector<double>& x, const std::vector<double>& Phi, bool index) {
  here_.set(x.data(), Phi.data());
  rows_.clear();
  for (std::size_t r = 0; r < requirements_.size(); ++r) {
    rows_.set_base(static_cast<int>(r) * kIdsOfRequirement);
    requirements_[r]->linearize(here_, reach_, rows_);
  }
  index_row_.clear();
  if (index) index_.linearize(here_, reach_, index_row_);
  ++evaluations_;
}

void Climber::linearize_current() {
  linearize(current_.x, Phi_, !repairing_);
  current_.missed = 0.0;
  for (int row = 0; row < rows_.size(); ++row) current_.missed = std::max(current_.missed, missed_of(rows_.value(row)));
  set_slope();
}

void Climber::set_slope() {
  g_.setZero(k_);
  if (repairing_) return;
  current_.value = index_row_.value(0);
  if (current_.value > 0.0 && (!logarithmic_ || current_.value != scale_)) {
    if (!logarithmic_) B_ *= scale_ / current_.value;
    logarithmic_ = true;
    scale_ = current_.value;
  }
  g_ = Eigen::Map<const Vector>(index_row_.slopes(0), k_) / scale_;
  if (!g_.allFinite()) g_.setZero();
}

void Climber::start_climbing() {
  repairing_ = false;
  index_row_.clear();
  index_.linearize(here_, reach_, index_row_);
  scale_ = std::max(std::abs(index_row_.value(0)), 1e-6);
  has_curvature_ = false;
  B_ = Matrix::Identity(k_, k_);
  trust_radius_ = options_.trust_radius;
  cuts_.clear();
  set_slope();
  keep_if_best();
  values_.push_back(current_.value);
}

// By how much better a value of the index is than the current one, relatively.
double Climber::gain(double value) const {
  if (repairing_) return 0.0;
  if (!logarithmic_) return (value - current_.value) / scale_;
  return value > 0.0 ? std::log(value / current_.value) : -HUGE_VAL;
}

double Climber::merit_gain() const {
  if (trial_.blocked && !current_.blocked) return -HUGE_VAL;
  return gain(trial_.value) + penalty_ * (current_.missed - trial_.missed);
}

Climber::Outcome Climber::end_step(ClimbStatus status) {
  status_ = status;
  return Outcome::ended;
}

Climber::Outcome Climber::step() {
  if (!repairing_ && trust_radius_ < kTiny && samplings_ < kMostSamplings) sample_cuts();
  if (!solve()) return end_step(repairing_ ? ClimbStatus::not_met : ClimbStatus::stalled);
  w_ = program_.w();
  const double size = w_.lpNorm<Eigen::Infinity>();
  const double promised = program_.model_gain() + penalty_ * (current_.missed - program_.missed());
  if (!repairing_ && kkt_ < kConverged && current_.missed <= kMet) {
    double farthest = 0.0;
    for (const Cut& cut : cuts_) farthest = std::max(farthest, cut.at.lpNorm<Eigen::Infinity>());
    if (farthest <= kKinkSize) {
      if (falls_at_once()) return end_step(ClimbStatus::stalled);
      return challenged() ? Outcome::taken : end_step(ClimbStatus::converged);
    }
    trust_radius_ = std::max(0.1 * farthest / kCutReach, kShortest);
    shift_cuts(Vector::Zero(k_), 0.0);
    return Outcome::refused;
  }
  if (repairing_ && current_.missed - program_.missed() < 1e-3 * kLeastProgress * current_.missed &&
      size < 0.5 * trust_radius_)
    return end_step(ClimbStatus::not_met);
  if (!(size > 0.0) || !(promised > 0.0) || trust_radius_ < kShortest)
    return end_step(repairing_ ? ClimbStatus::not_met : ClimbStatus::stalled);
  const double rounding = kRounding + penalty_ * kRoundingOfSlacks;
  bool good = try_step(w_) && merit_gain() >= kAccepted * promised - rounding;
  if (!good && !trial_.x.empty() && !trial_.blocked && trial_.missed > current_.missed && cuts_.empty()) {
    const Vector corrected = corrected_step(w_);
    if (corrected.size() > 0 && try_step(corrected) && merit_gain() >= kAccepted * promised - rounding) {
      w_ = corrected;
      good = true;
    }
  }
  if (!good) {
    refuse();
    return Outcome::refused;
  }
  const double ratio = merit_gain() / promised;
  if (ratio > 0.75 && size > 0.8 * trust_radius_)
    trust_radius_ = std::min(kGrowth * trust_radius_, kMostGrowth * options_.trust_radius);
  else if (ratio < 0.25)
    trust_radius_ = std::max(0.5 * size, kShortest);
  take();
  return Outcome::taken;
}

// The programme of the current grasp, with a penalty large enough that its step repairs what is missed; and the
// residual.
bool Climber::solve() {
  for (int tries = 0;; ++tries) {
    if (!program_.solve(B_, g_, rows_, cuts_, trust_radius_, current_.missed > kHardlyMissed ? penalty_ : 0.0)) {
      if (tries > 0 || (!has_curvature_ && cuts_.empty())) return false;
      B_ = Matrix::Identity(k_, k_);
      has_curvature_ = false;
      cuts_.clear();
      continue;
    }
    const bool repairs = program_.missed() <= (1.0 - kLeastProgress) * current_.missed;
    if (repairs || repairing_ || current_.missed < kSteered || penalty_ >= kLargestPenalty) break;
    penalty_ *= 10.0;
  }
  lambda_ = program_.multipliers();
  const double held = lambda_.sum();
  if (held > 0.5 * penalty_ && !repairing_ && !(program_.missed() > 0.0))
    penalty_ = std::min(4.0 * held, kLargestPenalty);
  kkt_ = std::max(program_.left_over().lpNorm<Eigen::Infinity>(), current_.missed > kMet ? current_.missed : 0.0);
  for (int row = 0; row < rows_.size(); ++row) kkt_ = std::max(kkt_, lambda_(row) * std::max(rows_.value(row), 0.0));
  return true;
}

// Projects the step and looks at the grasp there, trial_; false when there is none.
bool Climber::try_step(const Vector& w) {
  trial_.x.clear();
  const int n = system_.tangent_size();
  const Eigen::Map<const RowMatrix> Phi(Phi_.data(), k_, n);
  Eigen::Map<Vector>(step_.data(), n) = Phi.transpose() * w;
  std::vector<double> x = current_.x;
  system_.integrate(x.data(), step_.data(), x.data());
  if (newton_.project(x.data(), Phi_.data()) != Projection::converged || !newton_.tangent_basis(trial_Phi_.data()))
    return false;
  trial_.x = std::move(x);
  look_at_trial();
  return true;
}

void Climber::look_at_trial() {
  trial_.slacks.resize(static_cast<std::size_t>(rows_.size()));
  trial_.blocked = false;
  int row = 0;
  for (std::size_t r = 0; r < requirements_.size(); ++r) {
    if (!requirements_[r]->revisit(trial_.x.data(), trial_.slacks.data() + row)) trial_.blocked = true;
    while (row < rows_.size() && rows_.id(row) / kIdsOfRequirement == static_cast<int>(r)) ++row;
  }
  trial_.missed = 0.0;
  for (const double slack : trial_.slacks) trial_.missed = std::max(trial_.missed, missed_of(slack));
  if (!repairing_) index_.revisit(trial_.x.data(), &trial_.value);
  ++evaluations_;
}

// The step again, where the slacks are those found at its end less what their slopes had told; empty without one.
Vector Climber::corrected_step(const Vector& w) {
  Rows bent(k_);
  for (int row = 0; row < rows_.size(); ++row) {
    const Eigen::Map<const Vector> slopes(rows_.slopes(row), k_);
    Eigen::Map<Vector>(bent.add(rows_.id(row), trial_.slacks[static_cast<std::size_t>(row)] - slopes.dot(w)), k_) =
        slopes;
  }
  if (!program_.solve(B_, g_, bent, cuts_, trust_radius_, penalty_)) return Vector();
  return program_.w();
}

void Climber::take() {
  const double gained = gain(trial_.value);
  const bool was_blocked = trial_.blocked;
  std::swap(current_, trial_);
  std::swap(Phi_, trial_Phi_);
  current_.blocked = was_blocked;
  const double size = w_.lpNorm<Eigen::Infinity>();
  reach_ = 2.0 * std::min(trust_radius_, std::max(10.0 * size, 1e-3));
  std::swap(old_rows_, rows_);
  const Vector old_g = g_;
  linearize_current();
  if (repairing_) {
    if (current_.missed <= kMet && !current_.blocked) start_climbing();
    return;
  }
  if (cuts_.empty()) {
    Vector y = old_g - g_;
    for (int row = 0; row < old_rows_.size(); ++row) {
      if (!(lambda_(row) > 0.0)) continue;
      const int now = rows_.find(old_rows_.id(row));
      if (now < 0) continue;
      y += lambda_(row) *
           (Eigen::Map<const Vector>(old_rows_.slopes(row), k_) - Eigen::Map<const Vector>(rows_.slopes(now), k_));
    }
    update_curvature(y);
  } else {
    shift_cuts(w_, gained);
  }
  values_.push_back(current_.value);
  keep_if_best();
}

// Damped BFGS with y, by how much the slope of the Lagrangian has fallen along the step w_.
void Climber::update_curvature(const Vector& y) {
  const double squared = w_.squaredNorm();
  if (!(squared > 1e-24) || !y.allFinite()) return;
  if (!has_curvature_) {
    const double first = y.dot(w_) / squared;
    B_ = Matrix::Identity(k_, k_) * std::clamp(first, 1e-2, 1e4);
    has_curvature_ = true;
  }
  const Vector Bw = B_ * w_;
  const double wBw = w_.dot(Bw), wy = w_.dot(y);
  const double theta = wy >= 0.2 * wBw ? 1.0 : 0.8 * wBw / (wBw - wy);
  const Vector r = theta * y + (1.0 - theta) * Bw;
  const Matrix updated = B_ - Bw * Bw.transpose() / wBw + r * r.transpose() / w_.dot(r);
  if (updated.allFinite()) B_ = 0.5 * (updated + updated.transpose());
}

void Climber::keep_if_best() {
  if (current_.blocked || current_.missed > kMet || (has_best_ && current_.value < best_.value)) return;
  best_ = current_;
  has_best_ = true;
}

ClimbEnd Climber::end() const {
  const bool current_is_met = !repairing_ && !current_.blocked && current_.missed <= kMet;
  const bool best_is_better =
      has_best_ && (!current_is_met || best_.value > current_.value + kSameEnd * std::abs(best_.value));
  const Point& point = best_is_better ? best_ : current_;
  ClimbEnd found{point.x, point.value, 0.0, kkt_, status_, values_, evaluations_};
  if (!has_best_) {
    found.missed = current_.blocked ? HUGE_VAL : current_.missed;
    found.status = status_ == ClimbStatus::given_up ? status_ : ClimbStatus::not_met;
    found.value = std::nan("");
  } else if (best_is_better && status_ == ClimbStatus::converged) {
    found.status = ClimbStatus::stalled;
  }
  return found;
}

}  // namespace graspatlas
