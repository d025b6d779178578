#include "graspatlas/quality/wrench_hull.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace graspatlas {

namespace {

constexpr double kFlat = 1e-11;          // distance from a plane that is rounding, relative to the size of the hull
constexpr double kRankTolerance = 1e-9;  // thickness of a simplex that is none, relative to its size
constexpr double kRoundGap = 1e-4;       // to which the ball in round cones is found, relative to its radius
constexpr std::size_t kMaxRoundFacets = 300000;
constexpr std::size_t kMaxReachFacets = 20000;
constexpr int kCornerBits = 12;  // of a corner's number: five of them make the key of a ridge

}  // namespace

// The first simplex has the longest point, then those with the largest distances from the space of the earlier ones.
template <int D>
bool WrenchHull<D>::start(const Eigen::Ref<const Points>& points) {
  facets_.clear();
  count_ = static_cast<int>(points.cols());
  if (count_ < D + 1) return false;
  if (points_.cols() < count_) points_.resize(D, count_);
  auto rest = points_.leftCols(count_);
  Eigen::Index corner;
  points.colwise().squaredNorm().maxCoeff(&corner);
  rest = points.colwise() - points.col(corner);
  std::array<std::uint16_t, D + 1> simplex{static_cast<std::uint16_t>(corner)};
  double size = 0.0;
  for (int k = 1; k <= D; ++k) {
    const double distance = std::sqrt(rest.colwise().squaredNorm().maxCoeff(&corner));
    size = std::max(size, distance);
    if (!(distance > kRankTolerance * size)) return false;
    simplex[k] = static_cast<std::uint16_t>(corner);
    const Point direction = rest.col(corner) / distance;
    for (int i = 0; i < count_; ++i) rest.col(i) -= direction * direction.dot(rest.col(i));
  }
  flat_ = kFlat * size;
  std::sort(simplex.begin(), simplex.end());
  origin_.setZero();
  for (const auto i : simplex) origin_ -= points.col(i) / (D + 1.0);
  rest = points.colwise() + origin_;
  for (int without = 0; without <= D; ++without) {
    Corners corners;
    std::copy(simplex.begin(), simplex.begin() + without, corners.begin());
    std::copy(simplex.begin() + without + 1, simplex.end(), corners.begin() + without);
    append_facet(corners, without % 2 == 0 ? 1 : -1);
  }
  return true;
}

// The plane through the corners v_k, seen from the centre: y . v_k = 1 with y = normal / offset.
template <int D>
void WrenchHull<D>::append_facet(const Corners& corners, int sign) {
  Eigen::Matrix<double, D, D> V;
  for (int k = 0; k < D; ++k) V.row(k) = points_.col(corners[k]).transpose();
  const Point y = V.partialPivLu().solve(Point::Ones());
  const double offset = 1.0 / y.norm();
  const Point normal = y * offset;
  facets_.push_back({normal, offset, offset - normal.dot(origin_), corners, sign});
}

// Takes a point p into the hull; nothing happens when it is inside. The facets that p sees, with their signs, are a
// chain V, its boundary is the rim, and p joined to the rim is a chain with the same boundary.
template <int D>
void WrenchHull<D>::add(int point) {
  const Point p = points_.col(point);
  rim_.clear();
  std::size_t kept = 0;
  for (std::size_t i = 0; i < facets_.size(); ++i) {
    const Facet& facet = facets_[i];
    if (facet.normal.dot(p) - facet.offset <= flat_) {
      if (kept != i) facets_[kept] = facet;
      ++kept;
      continue;
    }
    for (int without = 0; without < D; ++without) {
      std::uint64_t key = 0;
      for (int k = 0; k < D; ++k)
        if (k != without) key = key << kCornerBits | facet.corners[k];
      rim_.push_back({key, without % 2 == 0 ? facet.sign : -facet.sign});
    }
  }
  facets_.resize(kept);
  std::sort(rim_.begin(), rim_.end(), [](const Ridge& a, const Ridge& b) { return a.key < b.key; });
  for (std::size_t i = 0; i < rim_.size();) {
    std::uint64_t key = rim_[i].key;
    int sign = 0;
    for (; i < rim_.size() && rim_[i].key == key; ++i) sign += rim_[i].sign;
    if (sign == 0) continue;  // between two facets that p sees
    Corners corners;
    for (int k = D - 1; k > 0; --k, key >>= kCornerBits)
      corners[k] = static_cast<std::uint16_t>(key & ((1u << kCornerBits) - 1u));
    // To its place in the order; every corner that it passes turns the simplex over.
    int k = 0;
    for (; k + 1 < D && corners[k + 1] < point; ++k, sign = -sign) corners[k] = corners[k + 1];
    corners[k] = static_cast<std::uint16_t>(point);
    append_facet(corners, sign);
  }
}

// `furthest` takes a direction and returns the number of a point that is furthest in it. The wrenches' hull reaches at
// least as far as its nearest facet, and at most as far as its furthest point in that facet's direction.
template <int D>
template <class Furthest>
double WrenchHull<D>::grow(double relative_gap, std::size_t max_facets, Furthest furthest) {
  for (int steps = 0;; ++steps) {
    const auto nearest = std::min_element(facets_.begin(), facets_.end(),
                                          [](const Facet& a, const Facet& b) { return a.distance < b.distance; });
    const int point = furthest(nearest->normal);
    const double beyond = nearest->normal.dot(points_.col(point)) - nearest->offset;
    if (nearest->distance + beyond <= flat_) return 0.0;
    const bool found = beyond <= std::max(relative_gap * nearest->distance, flat_);
    if (found || facets_.size() > max_facets || count_ > kMaxPoints || steps > kMaxPoints)
      return std::max(nearest->distance, 0.0);
    add(point);
  }
}

template <int D>
double WrenchHull<D>::ball_radius(const Eigen::Ref<const Points>& points) {
  if (!start(points)) return 0.0;
  return grow(0.0, SIZE_MAX, [this](const Point& direction) {
    Eigen::Index point;
    (direction.transpose() * points_.leftCols(count_)).maxCoeff(&point);
    return static_cast<int>(point);
  });
}

template <int D>
double WrenchHull<D>::ball_radius(const Eigen::Ref<const Points>& axes, double friction) {
  const Eigen::Index contacts = axes.cols() / 3;
  Points corners(D, kRoundCorners * contacts);
  for (Eigen::Index i = 0; i < corners.cols(); ++i) {
    const Eigen::Index c = i / kRoundCorners;
    const double angle = 2.0 * EIGEN_PI * static_cast<double>(i % kRoundCorners) / kRoundCorners;
    const Eigen::Vector3d force(1.0, friction * std::cos(angle), friction * std::sin(angle));
    corners.col(i) = axes.template middleCols<3>(3 * c) * force;
  }
  if (!start(corners)) return 0.0;
  return grow(kRoundGap, kMaxRoundFacets, [&](const Point& direction) {
    double reach = -HUGE_VAL;
    Point point;
    for (Eigen::Index c = 0; c < contacts; ++c) {
      const auto normal = axes.col(3 * c), s = axes.col(3 * c + 1), t = axes.col(3 * c + 2);
      const double along_s = direction.dot(s), along_t = direction.dot(t), slope = std::hypot(along_s, along_t);
      const double here = direction.dot(normal) + friction * slope;
      if (here <= reach) continue;
      reach = here;
      point = normal;
      if (slope > 0.0) point += (friction / slope) * (along_s * s + along_t * t);
    }
    if (points_.cols() == count_) points_.conservativeResize(D, 2 * count_);
    points_.col(count_) = point + origin_;
    return count_++;
  });
}

template <int D>
double WrenchHull<D>::ball_radius(const Eigen::Ref<const Points>& points, double least, double relative_gap,
                                  const Reach& reach) {
  if (!start(points)) return 0.0;
  for (int i = 0; i < count_; ++i) add(i);
  for (;;) {
    const Facet nearest = *std::min_element(facets_.begin(), facets_.end(),
                                            [](const Facet& a, const Facet& b) { return a.distance < b.distance; });
    const double radius = std::max(nearest.distance, 0.0);
    if (least - radius <= relative_gap * least || facets_.size() > kMaxReachFacets || count_ > kMaxPoints)
      return radius;
    Point furthest;
    least = std::min(least, reach(nearest.normal, nearest.corners, least, furthest));
    if (nearest.normal.dot(furthest) - nearest.distance <= flat_) return radius;
    if (points_.cols() == count_) points_.conservativeResize(D, 2 * count_);
    points_.col(count_) = furthest + origin_;
    add(count_++);
  }
}

template <int D>
std::vector<typename WrenchHull<D>::Side> WrenchHull<D>::sides_within(double distance) const {
  std::vector<Side> sides;
  for (const Facet& facet : facets_)
    if (facet.distance <= distance) sides.push_back({facet.normal, facet.distance, facet.corners});
  std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
    return a.distance != b.distance ? a.distance < b.distance : a.corners < b.corners;
  });
  return sides;
}

// The sum over the facets of the simplices with the centre, each with its sign: a fold cancels itself.
template <int D>
double WrenchHull<D>::volume(const Eigen::Ref<const Points>& points) {
  if (!start(points)) return 0.0;
  for (int i = 0; i < count_; ++i) add(i);
  double sum = 0.0;
  Eigen::Matrix<double, D, D> V;
  for (const Facet& facet : facets_) {
    for (int k = 0; k < D; ++k) V.col(k) = points_.col(facet.corners[k]);
    sum += facet.sign * V.partialPivLu().determinant();
  }
  for (int k = 2; k <= D; ++k) sum /= k;
  return std::abs(sum);
}

template class WrenchHull<2>;
template class WrenchHull<3>;
template class WrenchHull<6>;

}  // namespace graspatlas
