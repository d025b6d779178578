#include "graspatlas/climb/requirement_measures.hpp"

#include <algorithm>
#include <cmath>

namespace graspatlas {

namespace {

constexpr double kFarOpen = -1.0;     // below this the slack of closure counts by its logarithm
constexpr double kLeastSlack = -1e6;  // where internal forces cannot press at all
// Kept beyond the distance asked for [m]: shapes that are just apart have no normal, and are said to collide; of those
// that may sink in what depths are known to.
constexpr double kApart = 2e-6, kNotTooDeep = 5e-7;
constexpr double kTouching = 1e-5;  // a fingertip this near the object touches it where it should [m]

}  // namespace

BoundsMeasure::BoundsMeasure(const System& system)
    : system_(system), slacks_(static_cast<std::size_t>(system.bound_count())) {}

void BoundsMeasure::linearize(const Surroundings& at, double reach, Rows& rows) {
  seen_.clear();
  if (slacks_.empty()) return;
  system_.slack(at.x(), slacks_.data());
  const RowMatrix& B = system_.bound_normals();
  for (int b = 0; b < B.rows(); ++b) {
    const double slack = slacks_[static_cast<std::size_t>(b)];
    if (slack > reach * B.row(b).norm()) continue;
    seen_.push_back(b);
    double* slopes = rows.add(b, slack - kInside);
    for (int i = 0; i < at.dimension(); ++i) slopes[i] = -B.row(b).dot(at.Phi().row(i));
  }
}

bool BoundsMeasure::revisit(const double* x, double* values) {
  if (slacks_.empty()) return true;
  system_.slack(x, slacks_.data());
  for (const int b : seen_) *values++ = slacks_[static_cast<std::size_t>(b)] - kInside;
  std::size_t next = 0;
  for (int b = 0; b < system_.bound_count(); ++b) {
    if (next < seen_.size() && seen_[next] == b)
      ++next;
    else if (slacks_[static_cast<std::size_t>(b)] < 0.0)
      return false;
  }
  return true;
}

JointMarginMeasure::JointMarginMeasure(GraspSystem& system, double distance) : distance_(distance + kInside) {
  for (std::size_t i = 0; i < system.lower_limits().size(); ++i) {
    const double lower = system.lower_limits()[i], upper = system.upper_limits()[i];
    if (std::isfinite(lower)) limits_.push_back({static_cast<int>(i), 1.0, lower});
    if (std::isfinite(upper)) limits_.push_back({static_cast<int>(i), -1.0, upper});
  }
}

void JointMarginMeasure::linearize(const Surroundings& at, double, Rows& rows) {
  for (std::size_t l = 0; l < limits_.size(); ++l) {
    double* slopes = rows.add(static_cast<int>(l), slack(limits_[l], at.x()));
    for (int i = 0; i < at.dimension(); ++i)
      slopes[i] = at.slope(slack(limits_[l], at.ahead(i)), slack(limits_[l], at.behind(i)));
  }
}

bool JointMarginMeasure::revisit(const double* x, double* values) {
  for (const Limit& limit : limits_) *values++ = slack(limit, x);
  return true;
}

double bounded_closure(double slack) {
  const double bounded = std::max(slack, kLeastSlack);
  return bounded >= kFarOpen ? bounded : kFarOpen - std::log(-bounded);
}

void write_closure_slopes(ForceClosure& closure, double slack, const Surroundings& at, double* slopes) {
  std::fill_n(slopes, at.dimension(), 0.0);
  if (!(slack > kLeastSlack)) return;
  closure.keep_multipliers();
  const double factor = slack >= kFarOpen ? 1.0 : -1.0 / slack;
  for (int i = 0; i < at.dimension(); ++i)
    slopes[i] = factor * at.slope(closure.lagrangian(at.ahead(i)), closure.lagrangian(at.behind(i)));
}

ClosureMeasure::ClosureMeasure(GraspSystem& system, double friction, double torsional, double margin)
    : closure_(system, friction, torsional), margin_(margin + kInside) {}

double ClosureMeasure::excess(double slack) const { return bounded_closure(slack) - margin_; }

void ClosureMeasure::linearize(const Surroundings& at, double, Rows& rows) {
  const double slack = closure_.slack(at.x());
  write_closure_slopes(closure_, slack, at, rows.add(0, excess(slack)));
}

bool ClosureMeasure::revisit(const double* x, double* values) {
  *values = excess(closure_.slack(x));
  return true;
}

DistancesMeasure::DistancesMeasure(std::shared_ptr<const CollisionScene> scene, double length_scale)
    : space_(scene),
      scene_(*scene),
      model_(scene->model()),
      length_scale_(length_scale),
      seen_(scene->pairs().size()) {}

double DistancesMeasure::slack(int pair, double distance) const {
  const double required = scene_.pairs()[static_cast<std::size_t>(pair)].required;
  return (distance - required - (required < 0.0 ? kNotTooDeep : kApart)) / length_scale_;
}

// Distance of the watched points along their normal, where the model is.
double DistancesMeasure::along_normal(const Watched& watched) const {
  const Placement &first = model_.placement(watched.first_joint), &second = model_.placement(watched.second_joint);
  return watched.normal.dot(second.rotation * watched.on_second + second.translation -
                            first.rotation * watched.on_first - first.translation);
}

void DistancesMeasure::linearize(const Surroundings& at, double reach, Rows& rows) {
  watched_.clear();
  space_.place(at.x());
  model_.update(at.x(), false);
  const int pairs = static_cast<int>(scene_.pairs().size()), first_row = rows.size(), k = at.dimension();
  for (int pair = 0; pair < pairs; ++pair) {
    seen_[static_cast<std::size_t>(pair)] = false;
    const CollisionPair& stated = scene_.pairs()[static_cast<std::size_t>(pair)];
    if (!space_.may_be_within(pair, stated.required + kApart + reach * length_scale_)) continue;
    const NearestPoints nearest = space_.nearest(pair);
    // A fingertip that touches has no normal of its own, and the contact is an equation already.
    if (stated.required < 0.0 && std::abs(nearest.distance) < kTouching) continue;
    if (!nearest.normal.allFinite()) continue;
    seen_[static_cast<std::size_t>(pair)] = true;
    const int first = scene_.joint(stated.first), second = scene_.joint(stated.second);
    const Placement &a = model_.placement(first), &b = model_.placement(second);
    watched_.push_back({pair, first, second, a.rotation.transpose() * (nearest.on_first - a.translation),
                        b.rotation.transpose() * (nearest.on_second - b.translation), nearest.normal});
    rows.add(pair, slack(pair, nearest.distance));
  }
  const auto add_side = [&](int i, double sign) {
    for (std::size_t w = 0; w < watched_.size(); ++w) {
      const double distance = along_normal(watched_[w]) / length_scale_;
      double& slope = rows.slopes(first_row + static_cast<int>(w))[i];
      slope = sign > 0.0 ? distance : at.slope(slope, distance);
    }
  };
  if (watched_.empty()) return;
  for (int i = 0; i < k; ++i) {
    model_.update(at.ahead(i), false);
    add_side(i, 1.0);
    model_.update(at.behind(i), false);
    add_side(i, -1.0);
  }
}

bool DistancesMeasure::revisit(const double* x, double* values) {
  space_.place(x);
  for (const Watched& watched : watched_) *values++ = slack(watched.pair, space_.nearest(watched.pair).distance);
  const int pairs = static_cast<int>(scene_.pairs().size());
  for (int pair = 0; pair < pairs; ++pair)
    if (!seen_[static_cast<std::size_t>(pair)] && space_.hit(pair)) return false;
  return true;
}

}  // namespace graspatlas
