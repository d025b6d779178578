#include <algorithm>
#include <cmath>

#include "graspatlas/climb/climber.hpp"
#include "graspatlas/random.hpp"

// Climber where slopes jump: what refused steps tell, and whether a maximum is one.

namespace graspatlas {

namespace {

constexpr double kSameSlope = 1e-3;  // relative difference of slopes up to which there is no kink between
constexpr double kKinkStep = 1e-7;   // of differences near a kink, so that they do not reach across it
constexpr std::size_t kMostCuts = 60;
constexpr double kSampled = 1e-5;        // how far around slopes are sampled [units of the tangent space]
constexpr double kSharp = 1e-3;          // relative fall of the index within a step of the differences
constexpr int kChallenges = 3;           // times that a maximum may prove to be none
constexpr double kChallengeGain = 1e-8;  // of the index, relative, that shows it

}  // namespace

void Climber::refuse() {
  const double size = w_.lpNorm<Eigen::Infinity>();
  const bool seen = !trial_.x.empty();
  if (seen && !repairing_ && size < kShort) {
    if (cuts_.empty()) {
      B_ = Matrix::Identity(k_, k_);
      has_curvature_ = false;
      here_.set_step(kKinkStep);
    }
    const auto before = cuts_.size();
    add_cuts(w_);
    if (cuts_.size() > before && cuts_.size() % static_cast<std::size_t>(2 * k_ + 2) != 0) return;
  }
  trust_radius_ = (seen ? 0.5 : 0.3) * std::min(trust_radius_, size);
}

void Climber::shift_cuts(const Vector& w, double gained) {
  for (Cut& cut : cuts_) {
    cut.value += cut.slopes.dot(w) - (cut.of_index ? gained : 0.0);
    if (cut.of_index || current_.missed <= kMet) cut.value = std::max(cut.value, 0.0);
    cut.at -= w;
  }
  const double farthest = kCutReach * trust_radius_;
  cuts_.erase(std::remove_if(cuts_.begin(), cuts_.end(),
                             [&](const Cut& cut) { return cut.at.lpNorm<Eigen::Infinity>() > farthest; }),
              cuts_.end());
}

// Slopes at the grasp of a refused step, as cuts; those that tell nothing new are left out.
void Climber::add_cuts(const Vector& w) {
  const double gained = gain(trial_.value);
  Rows kept = rows_;
  linearize(trial_.x, trial_Phi_, true);
  Vector slopes = Eigen::Map<const Vector>(index_row_.slopes(0), k_) / (logarithmic_ ? index_row_.value(0) : scale_);
  if (slopes.allFinite() && std::isfinite(gained) && (slopes - g_).norm() > kSameSlope * g_.norm())
    cuts_.push_back({true, std::max(gained - slopes.dot(w), 0.0), slopes, w});
  for (int row = 0; row < rows_.size(); ++row) {
    slopes = Eigen::Map<const Vector>(rows_.slopes(row), k_);
    const int here = kept.find(rows_.id(row));
    double value = rows_.value(row) - slopes.dot(w);
    value = std::max(value, here >= 0 ? std::min(kept.value(here), value + kShort) : 0.0);
    if (here >= 0 && (slopes - Eigen::Map<const Vector>(kept.slopes(here), k_)).norm() < kSameSlope * slopes.norm())
      continue;
    if (value < trust_radius_ * slopes.lpNorm<1>()) cuts_.push_back({false, value, slopes, w});
  }
  if (cuts_.size() > kMostCuts) cuts_.erase(cuts_.begin(), cuts_.end() - kMostCuts);
  linearize_current();  // so that measures remember the rows of the current grasp
}

// Slopes at random grasps around, where steps have become tiny: on a kink they tell what lies on its sides.
void Climber::sample_cuts() {
  const double radius = kSampled * std::pow(0.3, samplings_++);
  cuts_.clear();
  B_ = Matrix::Identity(k_, k_);
  has_curvature_ = false;
  here_.set_step(kKinkStep);
  linearize_current();
  SplitMix64 random(static_cast<std::uint64_t>(samplings_));
  for (int i = 0; i < 2 * k_; ++i) {
    Vector w(k_);
    for (int a = 0; a < k_; ++a) w(a) = random.normal();
    w *= radius / w.norm();
    if (try_step(w)) add_cuts(w);
  }
  trust_radius_ = radius;
}

// Whether the index falls within the reach of the differences by more than a kink lets it: beside a pole differences
// from both sides cancel, and what they give is no slope.
bool Climber::falls_at_once() {
  double value;
  for (int i = 0; i < k_; ++i)
    for (const double* x : {here_.ahead(i), here_.behind(i)}) {
      index_.revisit(x, &value);
      if (!(std::abs(gain(value)) < kSharp)) return true;
    }
  return false;
}

// Whether a grasp near a maximum is better after all; then the climb goes on from there.
bool Climber::challenged() {
  if (challenges_ >= kChallenges) return false;
  SplitMix64 random(0);
  for (const double share : {0.1, 0.01})
    for (int i = 0; i < 2 * k_ + 2; ++i) {
      Vector w(k_);
      for (int a = 0; a < k_; ++a) w(a) = random.normal();
      w *= share * options_.trust_radius / w.norm();
      for (const double sign : {1.0, -1.0}) {
        if (!try_step(sign * w)) continue;
        if (trial_.blocked || trial_.missed > 0.0 || !(gain(trial_.value) > kChallengeGain)) continue;
        ++challenges_;
        w_ = sign * w;
        cuts_.clear();
        trust_radius_ = share * options_.trust_radius;
        take();
        B_ = Matrix::Identity(k_, k_);
        has_curvature_ = false;
        return true;
      }
    }
  return false;
}

}  // namespace graspatlas
