#include "graspatlas/climb/step_program.hpp"

#include <algorithm>
#include <cmath>

namespace graspatlas {

namespace {

// Curvatures that make the programme strictly convex in t, beside the penalty, and in v.
constexpr double kMissedCurvature = 1e-2, kGainCurvature = 1e-4;
constexpr double kLeastCurvature = 1e-7;  // beside the others, which keeps rounding small
constexpr int kMostIterations = 500;

}  // namespace

StepProgram::StepProgram(int dimension) : k_(dimension), no_rows_(0, 0) { solver_.setMaxIter(kMostIterations); }

bool StepProgram::solve(const Matrix& B, const Vector& g, const Rows& slacks, const std::vector<Cut>& cuts,
                        double trust_radius, double penalty) {
  const bool cut_index = std::any_of(cuts.begin(), cuts.end(), [](const Cut& cut) { return cut.of_index; });
  const bool may_miss = penalty > 0.0;
  const int v = k_, t = k_ + cut_index, n = t + may_miss;
  const int most = slacks.size() + static_cast<int>(cuts.size()) + 2 + 2 * k_;
  rows_.setZero(most, n);
  right_.setZero(most);
  source_.clear();
  int count = 0;
  const auto slopes_of = [this, &slacks](int row) { return Eigen::Map<const Vector>(slacks.slopes(row), k_); };
  for (int row = 0; row < slacks.size(); ++row) {
    const auto slopes = slopes_of(row);
    if (slacks.value(row) > trust_radius * slopes.lpNorm<1>()) continue;  // out of the step's reach
    rows_.row(count).head(k_) = slopes.transpose();
    if (may_miss) rows_(count, t) = 1.0;
    right_(count++) = may_miss ? slacks.value(row) : std::max(slacks.value(row), 0.0);
    source_.push_back(row);
  }
  for (std::size_t c = 0; c < cuts.size(); ++c) {
    rows_.row(count).head(k_) = cuts[c].slopes.transpose();
    if (cuts[c].of_index)
      rows_(count, v) = -1.0;
    else if (may_miss)
      rows_(count, t) = 1.0;
    right_(count++) = cuts[c].value;
    source_.push_back(-1 - static_cast<int>(c));
  }
  const int general = count;
  if (cut_index) {
    rows_.row(count).head(k_) = g.transpose();
    rows_(count++, v) = -1.0;
  }
  if (may_miss) rows_(count++, t) = 1.0;
  for (int i = 0; i < k_; ++i)
    for (const double sign : {1.0, -1.0}) {
      rows_(count, i) = sign;
      right_(count++) = trust_radius;
    }
  rows_.conservativeResize(count, Eigen::NoChange);
  right_.conservativeResize(count);

  hessian_.setZero(n, n);
  hessian_.topLeftCorner(k_, k_) = B;
  hessian_.diagonal().head(k_).array() += kLeastCurvature * B.trace();
  linear_.setZero(n);
  if (may_miss) {
    hessian_(t, t) = kMissedCurvature * penalty;
    linear_(t) = penalty;
  }
  if (cut_index) {
    hessian_(v, v) = kGainCurvature;
    linear_(v) = -1.0;
  } else {
    linear_.head(k_) = -g;
  }
  no_rows_.resize(0, n);
  no_right_.resize(0);
  solver_.reset(static_cast<std::size_t>(n), 0, static_cast<std::size_t>(count));
  const auto status = solver_.solve_quadprog(hessian_, linear_, no_rows_, no_right_, rows_, right_, solution_);
  if (status != eiquadprog::solvers::EIQUADPROG_FAST_OPTIMAL || !solution_.allFinite()) return false;

  w_ = solution_.head(k_).cwiseMax(-trust_radius).cwiseMin(trust_radius);
  missed_ = may_miss ? std::max(solution_(t), 0.0) : 0.0;
  lambda_.setZero(slacks.size());
  left_over_ = cut_index ? Vector::Zero(k_).eval() : g;
  const auto active = static_cast<Eigen::Index>(solver_.getActiveSetSize());
  for (Eigen::Index a = 0; a < active; ++a) {
    const int row = solver_.getActiveSet()(a);
    const double multiplier = solver_.getLagrangeMultipliers()(a);
    if (row < 0 || row >= general + (cut_index ? 1 : 0)) continue;
    left_over_ += multiplier * rows_.row(row).head(k_).transpose();
    if (row < general && source_[static_cast<std::size_t>(row)] >= 0)
      lambda_(source_[static_cast<std::size_t>(row)]) = multiplier;
  }
  gain_ = (cut_index ? solution_(v) : g.dot(w_)) - 0.5 * w_.dot(B * w_);
  return true;
}

}  // namespace graspatlas
