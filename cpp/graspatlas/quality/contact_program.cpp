#include "graspatlas/quality/contact_program.hpp"

#include <algorithm>
#include <cmath>
#include <type_traits>

namespace graspatlas {

namespace {

constexpr int kMaxSteps = 120;             // Newton steps of one maximum
constexpr double kDual = 0.9;              // squared Newton decrement below which there is a dual point
constexpr double kShort = 0.09;            // of a step that needs no search
constexpr double kCentred = 0.25;          // of a point that is the centre
constexpr double kLong = 60.0;             // of steps along the path
constexpr double kFar = 2.5;               // of points so far from the path that they go back to it first ...
constexpr double kBack = 0.6;              // ... where its weight is so many times the weight of the nearest point
constexpr int kQuickSteps = 10;            // after which a point ...
constexpr double kClose = 0.8;             // ... must be as close as this to go on: it may have run into a boundary
constexpr double kNearly = 0.9;            // of the way to the boundary from which a step is searched at most ...
constexpr double kAtMost = 0.999;          // ... and where it ends at most, after a search
constexpr int kSearches = 6;               // of a line, by Newton's method
constexpr double kFlatEnough = 0.2;        // of the slope that may be left of it
constexpr double kSmallestPivot = 1e-300;  // of a Hessian

// a2 t^2 + 2 a1 t + a0 with a0 > 0: where it first vanishes for t > 0; infinity when it does not.
double first_root(double a2, double a1, double a0) {
  const double discriminant = a1 * a1 - a2 * a0;
  if (discriminant < 0.0 || (a1 >= 0.0 && a2 >= 0.0)) return HUGE_VAL;
  const double root = a0 / (-a1 + std::sqrt(discriminant));
  return root > 0.0 ? root : HUGE_VAL;
}

// work(N) with n as a constant N, for the sizes of grasps by three or four fingers; else with Eigen::Dynamic.
template <class Work>
auto with_size(Eigen::Index n, const Work& work) {
  switch (n) {
    case 5:
      return work(std::integral_constant<int, 5>());
    case 6:
      return work(std::integral_constant<int, 6>());
    case 9:
      return work(std::integral_constant<int, 9>());
    case 13:
      return work(std::integral_constant<int, 13>());
    default:
      return work(std::integral_constant<int, Eigen::Dynamic>());
  }
}

template <int N>
using Square = Eigen::Map<Eigen::Matrix<double, N, N, Eigen::RowMajor>>;
template <int N>
using Column = Eigen::Map<Eigen::Matrix<double, N, 1>>;
template <int N>
using ConstRow = Eigen::Map<const Eigen::Matrix<double, N, 1>>;

}  // namespace

void ContactProgram::set(const RowMatrix& rows, int cone_size, const RowMatrix& limits, double budget) {
  rows_ = rows;
  limits_ = limits;
  cone_size_ = cone_size;
  contacts_ = static_cast<int>(rows.rows()) / cone_size;
  const Eigen::Index n = rows.cols();
  parameter_ = 2.0 * contacts_ + 1.0 + 2.0 * static_cast<double>(limits.rows());
  budget_row_.setZero(n);
  curvatures_.resize(contacts_, n * n);
  for (int i = 0; i < contacts_; ++i) {
    Eigen::Map<RowMatrix> C(curvatures_.row(i).data(), n, n);
    const auto along = rows_.row(static_cast<Eigen::Index>(i) * cone_size);
    budget_row_ += along.transpose() / budget;
    C.noalias() = -along.transpose() * along;
    for (int k = 1; k < cone_size; ++k) {
      const auto side = rows_.row(static_cast<Eigen::Index>(i) * cone_size + k);
      C.noalias() += side.transpose() * side;
    }
  }
}

bool ContactProgram::start(const Vector& y) {
  y_ = y;
  return inside() > 0.0;
}

// The least of what is left to any constraint at y_; not positive outside.
double ContactProgram::inside() const {
  double least = 1.0 - budget_row_.dot(y_);
  for (int i = 0; i < contacts_; ++i) {
    const Eigen::Index at = static_cast<Eigen::Index>(i) * cone_size_;
    const double along = rows_.row(at).dot(y_);
    double side = 0.0;
    for (int k = 1; k < cone_size_; ++k) side += std::pow(rows_.row(at + k).dot(y_), 2);
    least = std::min(least, along - std::sqrt(side));
  }
  for (Eigen::Index j = 0; j < limits_.rows(); ++j) least = std::min(least, 1.0 - std::abs(limits_.row(j).dot(y_)));
  return least;
}

// Gradient and Hessian of the barrier -sum log(z_0^2 - |z_side|^2) - log(1 - sum z_0) - sum log(1 - v^2) at y_, and the
// Hessian's Cholesky factor.
void ContactProgram::linearize() {
  const Eigen::Index n = y_.size();
  z_.resize(rows_.rows());
  v_.resize(limits_.rows());
  gradient_.resize(n);
  hessian_.resize(n, n);
  factor_.resize(n, n);
  with_size(n, [this](auto size) {
    linearize_sized<size>();
    factorize_sized<size>();
  });
}

template <int N>
void ContactProgram::linearize_sized() {
  const Eigen::Index n = y_.size();
  const auto row = [n](const RowMatrix& A, Eigen::Index i) { return ConstRow<N>(A.data() + i * n, n); };
  const ConstRow<N> y(y_.data(), n), budget(budget_row_.data(), n);
  Column<N> gradient(gradient_.data(), n);
  Square<N> hessian(hessian_.data(), n, n);
  for (Eigen::Index i = 0; i < z_.size(); ++i) z_(i) = row(rows_, i).dot(y);
  budget_left_ = 1.0 - budget.dot(y);
  gradient = budget / budget_left_;
  hessian.noalias() = gradient * gradient.transpose();
  Eigen::Matrix<double, N, 1> normal(n);
  for (int i = 0; i < contacts_; ++i) {
    const Eigen::Index at = static_cast<Eigen::Index>(i) * cone_size_;
    double s = z_(at) * z_(at);
    for (int k = 1; k < cone_size_; ++k) s -= z_(at + k) * z_(at + k);
    const double weight = 2.0 / s;
    normal = (-weight * z_(at)) * row(rows_, at);
    for (int k = 1; k < cone_size_; ++k) normal += (weight * z_(at + k)) * row(rows_, at + k);
    gradient += normal;
    hessian += weight * Eigen::Map<const Eigen::Matrix<double, N, N, Eigen::RowMajor>>(curvatures_.row(i).data(), n, n);
    hessian.noalias() += normal * normal.transpose();
  }
  for (Eigen::Index j = 0; j < limits_.rows(); ++j) {
    const auto limit = row(limits_, j);
    v_(j) = limit.dot(y);
    const double left = 1.0 / (1.0 - v_(j) * v_(j)), slope = 2.0 * v_(j) * left;
    gradient += slope * limit;
    normal = (2.0 * left + slope * slope) * limit;
    hessian.noalias() += normal * limit.transpose();
  }
}

// Row by row; the inverses of the diagonal stand in it.
template <int N>
void ContactProgram::factorize_sized() {
  const Eigen::Index n = N == Eigen::Dynamic ? y_.size() : N;
  Square<N> L(factor_.data(), n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j <= i; ++j) {
      double sum = hessian_.data()[i * n + j];
      for (Eigen::Index k = 0; k < j; ++k) sum -= L(i, k) * L(j, k);
      L(i, j) = i == j ? 1.0 / std::sqrt(std::max(sum, kSmallestPivot)) : sum * L(j, j);
    }
  }
}

void ContactProgram::solve(const Vector& right, Vector& out) {
  out = right;
  with_size(out.size(), [&](auto size) {
    const Eigen::Index n = size == Eigen::Dynamic ? out.size() : Eigen::Index{size};
    const Square<size> L(factor_.data(), n, n);
    double* const x = out.data();
    for (Eigen::Index i = 0; i < n; ++i) {
      for (Eigen::Index k = 0; k < i; ++k) x[i] -= L(i, k) * x[k];
      x[i] *= L(i, i);
    }
    for (Eigen::Index i = n - 1; i >= 0; --i) {
      x[i] *= L(i, i);
      for (Eigen::Index k = 0; k < i; ++k) x[k] -= L(i, k) * x[i];
    }
  });
}

// z^2 - |z_side|^2 of contact i at a way t along step_: a0 + 2 a1 t + a2 t^2.
ContactProgram::Quadratic ContactProgram::along_step(int i) const {
  const Eigen::Index at = static_cast<Eigen::Index>(i) * cone_size_;
  Quadratic q{z_(at) * z_(at), z_(at) * dz_(at), dz_(at) * dz_(at)};
  for (Eigen::Index k = at + 1; k < at + cone_size_; ++k) {
    q.a0 -= z_(k) * z_(k);
    q.a1 -= z_(k) * dz_(k);
    q.a2 -= dz_(k) * dz_(k);
  }
  return q;
}

// How far it is along step_ to the nearest boundary.
double ContactProgram::way_out() const {
  const double budget_step = budget_row_.dot(step_);
  double end = budget_step > 0.0 ? budget_left_ / budget_step : HUGE_VAL;
  for (int i = 0; i < contacts_; ++i) {
    const Quadratic q = along_step(i);
    end = std::min(end, first_root(q.a2, q.a1, q.a0));
    // Through the tip of the cone there is a double root, which rounding may hide.
    const Eigen::Index at = static_cast<Eigen::Index>(i) * cone_size_;
    if (dz_(at) < 0.0) end = std::min(end, -z_(at) / dz_(at));
  }
  for (Eigen::Index j = 0; j < limits_.rows(); ++j)
    if (dv_(j) != 0.0) end = std::min(end, ((dv_(j) > 0.0 ? 1.0 : -1.0) - v_(j)) / dv_(j));
  return end;
}

// How far to go along step_, towards the least of the barrier less slope t: `slope` is the weight times c . step_.
double ContactProgram::line_search(double slope) {
  dz_.noalias() = rows_.lazyProduct(step_);
  dv_.noalias() = limits_.lazyProduct(step_);
  const double budget_step = budget_row_.dot(step_), end = way_out(), first_slope = slope - gradient_.dot(step_);
  double low = 0.0, high = end, t = std::min(1.0, kNearly * end);
  for (int search = 0; search < kSearches; ++search) {
    const double budget_rate = budget_step / (budget_left_ - t * budget_step);
    double first = slope - budget_rate, second = budget_rate * budget_rate;
    for (int i = 0; i < contacts_; ++i) {
      const Quadratic q = along_step(i);
      const double s = 1.0 / (q.a0 + t * (2.0 * q.a1 + t * q.a2)), rate = 2.0 * (q.a1 + t * q.a2) * s;
      first += rate;
      second += rate * rate - 2.0 * q.a2 * s;
    }
    for (Eigen::Index j = 0; j < limits_.rows(); ++j) {
      const double v = v_(j) + t * dv_(j), left = 1.0 / (1.0 - v * v), rate = 2.0 * v * dv_(j) * left;
      first -= rate;
      second += rate * rate + 2.0 * dv_(j) * dv_(j) * left;
    }
    if (std::abs(first) <= kFlatEnough * first_slope) break;
    (first > 0.0 ? low : high) = t;
    t = second > 0.0 ? t + first / second : HUGE_VAL;
    if (!(t > low && t < high)) t = std::isfinite(high) ? 0.5 * (low + high) : 2.0 * low;
  }
  return std::isfinite(end) ? std::min(t, kAtMost * end) : t;
}

// With the Newton step w H^-1 c - H^-1 g for the weight w its squared decrement is a w^2 - 2 b w + d. Each step takes
// the largest weight at which that is no more than kLong, unless the path is far away; and any weight at which it is
// below one gives a dual point, the objective of which is b + (parameter - d) / w above c . y.
ContactProgram::Bounds ContactProgram::maximize(const Vector& c, double relative_gap, double enough) {
  Bounds bounds{c.dot(y_), HUGE_VAL};
  for (int steps = 0; steps < kMaxSteps; ++steps) {
    linearize();
    solve(c, along_);
    solve(gradient_, center_);
    const double a = c.dot(along_), b = gradient_.dot(along_), d = gradient_.dot(center_);
    const double best = b / a, nearest = d - b * best;  // the weight of the shortest step, and its squared decrement
    if (!std::isfinite(nearest) || !(a > 0.0)) break;
    const double reach = nearest < kDual ? std::sqrt((kDual - nearest) / a) : 0.0;
    const double weight = d < parameter_ ? best + reach : best - reach;
    if (nearest < kDual && weight > 0.0)
      bounds.upper = std::min(bounds.upper, bounds.lower + b + (parameter_ - d) / weight);
    if (bounds.lower >= (1.0 - relative_gap) * bounds.upper || bounds.lower >= enough) break;
    const double most = 2.0 * parameter_ / (relative_gap * std::max(bounds.lower, std::sqrt(a)));
    const double far = steps < kQuickSteps ? kFar : kClose;
    const double next =
        std::max(nearest < far ? std::min(best + std::sqrt((kLong - nearest) / a), most) : kBack * best, 0.0);
    step_ = next * along_ - center_;
    const double decrement = next * (a * next - 2.0 * b) + d;
    y_ += (decrement < kShort ? 1.0 : line_search(next * c.dot(step_))) * step_;
    bounds.lower = c.dot(y_);
  }
  return bounds;
}

void ContactProgram::center() {
  for (int steps = 0; steps < kMaxSteps; ++steps) {
    linearize();
    solve(gradient_, center_);
    step_ = -center_;
    const double decrement = gradient_.dot(center_);
    if (!(decrement > kCentred)) return;
    y_ += (decrement < kShort ? 1.0 : line_search(0.0)) * step_;
  }
}

Matrix ContactProgram::dikin_shape(const RowMatrix& E) {
  linearize();
  Matrix solved(E.cols(), E.rows());
  for (Eigen::Index i = 0; i < E.rows(); ++i) {
    normal_ = E.row(i).transpose();
    solve(normal_, step_);
    solved.col(i) = step_;
  }
  return E * solved;
}

}  // namespace graspatlas
