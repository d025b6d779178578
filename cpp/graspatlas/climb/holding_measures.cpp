#include "graspatlas/climb/holding_measures.hpp"

#include <algorithm>
#include <cmath>

#include "graspatlas/climb/requirement_measures.hpp"
#include "graspatlas/errors.hpp"

namespace graspatlas {

namespace {

constexpr double kShare = 0.1;  // above the least force up to which touches have rows
constexpr int kRowWhileOpen = 1 << 19;
constexpr double kCellsOfRows = 3.0;  // from the middle of a cube to its side: touches in one cell have one number
constexpr int kCells = 343;

/// A number that a touch keeps while it moves a little.
int cell_of(const Eigen::Vector3d& direction) {
  int cell = 0;
  for (int k = 0; k < 3; ++k) cell = 7 * cell + static_cast<int>(std::lround(kCellsOfRows * direction(k))) + 3;
  return cell;
}

/// Slopes of the forces of touches, each written to the row that `slopes(t)` points to.
template <class Slopes>
void write_slopes(HoldingTouches& measure, const std::vector<HoldingTouches::Touch>& touches, const Surroundings& at,
                  double factor, const Slopes& slopes) {
  std::vector<double> ahead(touches.size()), behind(touches.size());
  for (int i = 0; i < at.dimension(); ++i) {
    measure.lagrangians(at.ahead(i), touches, ahead.data());
    measure.lagrangians(at.behind(i), touches, behind.data());
    for (std::size_t t = 0; t < touches.size(); ++t) slopes(t)[i] = factor * at.slope(ahead[t], behind[t]);
  }
}

}  // namespace

void HoldingIndex::linearize(const Surroundings& at, double, Rows& rows) {
  const auto& touches = touches_.find(at.x(), 0.0);
  double* slopes = rows.add(0, touches.empty() ? 0.0 : touches.front().force);
  std::fill_n(slopes, at.dimension(), 0.0);
  if (!touches.empty()) write_slopes(touches_, {touches.front()}, at, 1.0, [slopes](std::size_t) { return slopes; });
}

bool HoldingIndex::revisit(const double* x, double* values) {
  const auto& touches = touches_.find(x, 0.0);
  *values = touches.empty() ? 0.0 : touches.front().force;
  return true;
}

HoldingMeasure::HoldingMeasure(GraspSystem& system, const HoldingLimits& limits, double at_least)
    : touches_(system, limits),
      closure_(system, limits.friction, limits.torsional),
      at_least_(at_least),
      torque_length_(limits.torque_length) {
  if (!(at_least > 0.0) || !std::isfinite(at_least))
    throw Error("the holding force asked for must be positive, got " + to_text(at_least));
}

double HoldingMeasure::excess(double force) const { return force / at_least_ - 1.0 - kInside; }

HoldingMeasure::Place HoldingMeasure::place_of(const HoldingTouches::Touch& touch) const {
  Place place;
  place << touch.direction, torque_length_ * touch.about;
  return place;
}

void HoldingMeasure::linearize(const Surroundings& at, double, Rows& rows) {
  seen_.clear();
  const auto& touches = touches_.find(at.x(), kShare);
  if (touches.empty()) return linearize_open(at, rows);
  const int first = rows.size();
  std::vector<int> ids;
  for (const auto& touch : touches) {
    int id = cell_of(touch.direction);
    while (std::find(ids.begin(), ids.end(), id) != ids.end()) id += kCells;
    ids.push_back(id);
    rows.add(id, excess(touch.force));
    seen_.push_back(place_of(touch));
  }
  write_slopes(touches_, touches, at, 1.0 / at_least_,
               [&rows, first](std::size_t t) { return rows.slopes(first + static_cast<int>(t)); });
}

void HoldingMeasure::linearize_open(const Surroundings& at, Rows& rows) {
  const double slack = closure_.slack(at.x());
  double* slopes = rows.add(kRowWhileOpen, open_excess(slack));
  write_closure_slopes(closure_, slack, at, slopes);
}

double HoldingMeasure::open_excess(double slack) const { return excess(0.0) + std::min(bounded_closure(slack), 0.0); }

// Each touch counts for the row that it is nearest to; a row that has none is beyond what has been looked at.
bool HoldingMeasure::revisit(const double* x, double* values) {
  const std::size_t count = std::max<std::size_t>(seen_.size(), 1);
  const auto& touches = touches_.find(x, kShare);
  if (touches.empty()) {
    std::fill_n(values, count, open_excess(closure_.slack(x)));
    return true;
  }
  if (seen_.empty()) {
    *values = excess(touches.front().force);
    return true;
  }
  std::fill_n(values, count, excess((1.0 + kShare) * touches.front().force));
  for (const auto& touch : touches) {
    const Place place = place_of(touch);
    const auto nearest = std::min_element(seen_.begin(), seen_.end(), [&](const Place& a, const Place& b) {
      return (a - place).squaredNorm() < (b - place).squaredNorm();
    });
    double& value = values[nearest - seen_.begin()];
    value = std::min(value, excess(touch.force));
  }
  return true;
}

}  // namespace graspatlas
