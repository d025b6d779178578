#include "graspatlas/climb/index_measures.hpp"

#include <algorithm>
#include <cmath>

#include "graspatlas/errors.hpp"

namespace graspatlas {

void NumberMeasure::linearize(const Surroundings& at, double, Rows& rows) {
  double* slopes = rows.add(0, value(at.x()));
  for (int i = 0; i < at.dimension(); ++i) slopes[i] = at.slope(value(at.ahead(i)), value(at.behind(i)));
}

bool NumberMeasure::revisit(const double* x, double* values) {
  *values = value(x);
  return true;
}

AxesMeasure::AxesMeasure(GraspSystem& system, AxesIndex index, int connectivity, double length_unit)
    : manipulability_(system, length_unit), index_(index), connectivity_(connectivity), axes_(system.object_dof()) {
  if (connectivity < 0 || connectivity > system.object_dof())
    throw Error("an object with " + std::to_string(system.object_dof()) + " degrees of freedom has no connectivity " +
                std::to_string(connectivity));
}

double AxesMeasure::value(const double* x) {
  if (connectivity_ == 0) return 0.0;
  manipulability_.semi_axes(x, axes_.data());
  const auto axes = axes_.tail(connectivity_);
  if (index_ == AxesIndex::volume) return axes.prod();
  if (index_ == AxesIndex::smallest) return axes(0);
  return axes(connectivity_ - 1) > 0.0 ? axes(0) / axes(connectivity_ - 1) : 0.0;
}

CentralityMeasure::CentralityMeasure(const GraspSystem& system, int joints) : joints_(std::max(joints, 1)) {
  for (std::size_t i = 0; i < system.lower_limits().size(); ++i) {
    const double lower = system.lower_limits()[i], upper = system.upper_limits()[i], half = 0.5 * (upper - lower);
    if (std::isfinite(half) && half > 0.0) ranges_.push_back({i, 0.5 * (lower + upper), half});
  }
}

double CentralityMeasure::value(const double* x) {
  double sum = 0.0;
  for (const Range& range : ranges_) {
    const double away = (x[range.at] - range.middle) / range.half;
    sum += away * away;
  }
  return 1.0 - sum / joints_;
}

BatchMeasure::BatchMeasure(const GraspSystem& system, std::function<RowsFunction(const RowMatrix& x)> near)
    : near_(std::move(near)), X_(2 * system.dimension() + 1, system.configuration_size()) {}

void BatchMeasure::linearize(const Surroundings& at, double, Rows& rows) {
  const int k = at.dimension();
  const auto row_of = [&](const double* x) { return Eigen::Map<const Eigen::RowVectorXd>(x, X_.cols()); };
  X_.row(2 * k) = row_of(at.x());
  for (int i = 0; i < k; ++i) {
    X_.row(2 * i) = row_of(at.ahead(i));
    X_.row(2 * i + 1) = row_of(at.behind(i));
  }
  values_ = near_(X_.bottomRows(1));
  const RowMatrix values = values_(X_);
  for (int c = 0; c < values.cols(); ++c) {
    double* slopes = rows.add(c, values(2 * k, c));
    for (int i = 0; i < k; ++i) slopes[i] = at.slope(values(2 * i, c), values(2 * i + 1, c));
  }
}

bool BatchMeasure::revisit(const double* x, double* values) {
  const RowMatrix found = values_(Eigen::Map<const Eigen::RowVectorXd>(x, X_.cols()));
  Eigen::Map<Eigen::RowVectorXd>(values, found.cols()) = found.row(0);
  return true;
}

}  // namespace graspatlas
