#include "graspatlas/quality/min_weight.hpp"

#include <algorithm>
#include <cmath>

namespace graspatlas {

namespace {

constexpr double kZero = 1e-10;  // no slope, no gain, no weight: relative to the largest entry of c - w_i, which is 1
constexpr int kMaxPivots = 10000;

}  // namespace

// The column that gains most, or the first that gains at all (Bland's rule, which cannot cycle); components of z come
// before all others. None: -1.
int MinWeight::entering(bool first_of_all) const {
  int best = -1;
  double most = kZero;
  for (int j = 0; j < static_cast<int>(in_column_.size()); ++j) {
    if (in_column_[j] < 0) return j;
    if (!(gain_(j) > (first_of_all ? kZero : most))) continue;
    if (first_of_all && best >= 0 && in_column_[j] > in_column_[best]) continue;
    best = j;
    most = gain_(j);
  }
  return best;
}

// The slack that first comes to zero when the column's variable grows (or falls, with sign -1); -1 when none does.
int MinWeight::leaving(int column, double sign) const {
  int best = -1;
  double least = HUGE_VAL;
  for (int i = 0; i < static_cast<int>(in_row_.size()); ++i) {
    const double slope = sign * table_(i, column);
    if (in_row_[i] < 0 || !(slope > kZero)) continue;
    const double ratio = right_(i) / slope;
    if (ratio > least || (ratio == least && in_row_[i] > in_row_[best])) continue;
    best = i;
    least = ratio;
  }
  return best;
}

void MinWeight::pivot(int row, int column) {
  const double inverse = 1.0 / table_(row, column);
  table_.row(row) *= inverse;
  table_(row, column) = inverse;
  right_(row) *= inverse;
  for (int i = 0; i < table_.rows(); ++i) {
    const double factor = table_(i, column);
    if (i == row || factor == 0.0) continue;
    table_(i, column) = 0.0;
    table_.row(i) -= factor * table_.row(row);
    right_(i) -= factor * right_(row);
    if (in_row_[i] >= 0) right_(i) = std::max(right_(i), 0.0);
  }
  const double factor = gain_(column);
  gain_(column) = 0.0;
  gain_ -= factor * table_.row(row).transpose();
  value_ += factor * right_(row);
  std::swap(in_row_[row], in_column_[column]);
}

double MinWeight::normalized(const Eigen::Ref<const RowMatrix>& wrenches) {
  const int n = static_cast<int>(wrenches.rows()), components = static_cast<int>(wrenches.cols());
  gain_ = wrenches.colwise().mean().transpose();
  table_ = (-wrenches).rowwise() + gain_.transpose();
  const double size = table_.cwiseAbs().maxCoeff();
  if (!(size > 0.0)) return 0.0;
  table_ /= size;
  gain_ /= size;
  right_.setOnes(n);
  value_ = 0.0;
  in_row_.resize(n);
  in_column_.resize(components);
  for (int i = 0; i < n; ++i) in_row_[i] = i;
  for (int j = 0; j < components; ++j) in_column_[j] = -1 - j;
  for (int pivots = 0; pivots < kMaxPivots; ++pivots) {
    const int column = entering(pivots > 2 * (n + components));
    if (column < 0) return 1.0 - value_ > kZero ? 1.0 - value_ : 0.0;
    const int row = leaving(column, gain_(column) < 0.0 ? -1.0 : 1.0);
    if (row < 0) return 0.0;  // z may grow for ever: the wrenches lie in one plane
    pivot(row, column);
  }
  return 0.0;
}

}  // namespace graspatlas
