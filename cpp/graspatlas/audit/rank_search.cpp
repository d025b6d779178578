#include "graspatlas/audit/rank_search.hpp"

#include <algorithm>
#include <cmath>

namespace graspatlas {

namespace {

// Regularity, as a share of that at the centre, at which a chart loses rank; how far away, in radii; steps of the
// search, how often one that fails is halved, and steps of the inverse iteration for the regularity.
constexpr double kRankLost = 0.1, kReach = 1.5;
constexpr int kMostSteps = 5, kHalvings = 3, kIterations = 4;
// A step of the differences that regularity is derived by, as a share of the radius.
constexpr double kDifference = 1e-3;
// Slopes are no smaller, so that lengths are numbers.
constexpr double kLeastSlope = 1e-300;

}  // namespace

RankSearch::RankSearch(const System& system, Walker& walker, double radius)
    : system_(system),
      walker_(walker),
      radius_(radius),
      u_(system.dimension()),
      step_(system.tangent_size()),
      x_(system.configuration_size()),
      direction_(system.dimension()) {}

double RankSearch::regularity_at(const double* x) {
  Newton& newton = walker_.newton();
  return newton.hold(x, walker_.Phi()) ? std::abs(newton.regularity(kIterations)) : 0.0;
}

// Into direction_: how fast the regularity falls along each axis from where the walker is.
void RankSearch::descent(double value, double h) {
  const int k = system_.dimension(), n = system_.tangent_size();
  for (int a = 0; a < k; ++a) {
    std::fill(u_.begin(), u_.end(), 0.0);
    u_[a] = h;
    tangent_vector(walker_.Phi(), u_.data(), k, n, step_.data());
    system_.integrate(walker_.x(), step_.data(), x_.data());
    direction_[a] = (value - regularity_at(x_.data())) / h;
  }
}

// Steps of Newton's method down to where the regularity is zero, while it falls.
bool RankSearch::loses_rank(const double* center, const double* basis) {
  walker_.put(center, basis);
  double value = regularity_at(walker_.x()), travelled = 0.0;
  const double goal = kRankLost * value;
  for (int i = 0; i < kMostSteps; ++i) {
    if (value <= goal && i > 0) return true;
    descent(value, kDifference * radius_);
    const double slope = std::sqrt(squared_length(direction_.data(), system_.dimension()));
    double length = value / std::max(slope, kLeastSlope);
    if (!(length > 0.0) || travelled + length > kReach * radius_) return false;
    if (walker_.step_halving(direction_.data(), length, kHalvings) != Walker::Step::taken) return false;
    travelled += length;
    const double next = regularity_at(walker_.x());
    if (next >= value && next > goal) return false;
    value = next;
  }
  return value <= goal;
}

}  // namespace graspatlas
