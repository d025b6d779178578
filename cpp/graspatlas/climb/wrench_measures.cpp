#include "graspatlas/climb/wrench_measures.hpp"

#include <Eigen/LU>
#include <algorithm>

namespace graspatlas {

template <int D>
void EpsilonMeasure<D>::linearize(const Surroundings& at, double, Rows& rows) {
  const Matrix& wrenches = wrenches_.at(at.x());
  const double radius = hull_.ball_radius(wrenches);
  double* slopes = rows.add(0, radius);
  std::fill_n(slopes, at.dimension(), 0.0);
  if (!(radius > 0.0)) return;
  const auto side = hull_.sides_within(radius).front();
  Eigen::Matrix<double, D, D> corners;
  for (int k = 0; k < D; ++k) corners.col(k) = wrenches.col(side.corners[k]);
  const Eigen::Matrix<double, D, 1> weights = corners.partialPivLu().solve(radius * side.normal);
  const auto foot_along_normal = [&](const double* x) {
    const Matrix& moved = wrenches_.at(x);
    double along = 0.0;
    for (int k = 0; k < D; ++k) along += weights(k) * side.normal.dot(moved.col(side.corners[k]));
    return along;
  };
  for (int i = 0; i < at.dimension(); ++i)
    slopes[i] = at.slope(foot_along_normal(at.ahead(i)), foot_along_normal(at.behind(i)));
}

template <int D>
bool EpsilonMeasure<D>::revisit(const double* x, double* values) {
  *values = hull_.ball_radius(wrenches_.at(x));
  return true;
}

template class EpsilonMeasure<3>;
template class EpsilonMeasure<6>;

}  // namespace graspatlas
