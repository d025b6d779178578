#include "graspatlas/quality/holding_force.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <utility>

#include "graspatlas/errors.hpp"

namespace graspatlas {

namespace {

constexpr double kProgramShare = 0.5;  // of the gap, that of each reach
constexpr double kLoadGap = 1e-6;      // relative, of the force along one direction
constexpr double kStartShare = 0.5;    // of the budget and the efforts that the forces have from which programmes start
constexpr double kNoBudget = 1e4;      // units of normal force that stand for any
constexpr double kSideShare = 0.95;    // of forces, how much those of facets have of the hull's and not of the centre's
constexpr double kEnough = 1.1;        // times the least reach, beyond which a reach is known well enough

/// Of at most six rows and columns: decompositions of one type for all spaces of disturbances, without allocation.
using Small = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 6, 6>;
using SmallVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 6, 1>;

/// Semi-axes' directions of an ellipsoid with this shape, one a column.
Small principal_axes(const Small& shape) { return Eigen::SelfAdjointEigenSolver<Small>(shape).eigenvectors(); }

SmallVector solve(const Small& A, const SmallVector& b) { return A.partialPivLu().solve(b); }

/// A square matrix with orthonormal columns, whose first ones span the columns of A.
Matrix orthonormal(const Matrix& A) {
  Matrix Q = Matrix::Identity(A.rows(), A.rows());
  Q.applyOnTheLeft(Eigen::HouseholderQR<Matrix>(A).householderQ());
  return Q;
}

}  // namespace

HoldingForce::HoldingForce(GraspSystem& system, HoldingLimits limits)
    : system_(system),
      limits_(std::move(limits)),
      closure_(system, limits_.friction, limits_.torsional),
      directions_(system.object_joint().space_dimension()),
      cone_size_(directions_ + (directions_ == 3 && limits_.torsional > 0.0 ? 1 : 0)) {
  if (limits_.efforts.size() != 0 && limits_.efforts.size() != system.actuated_count())
    throw Error("efforts must hold " + std::to_string(system.actuated_count()) +
                " numbers, one for each actuated joint");
  for (Eigen::Index j = 0; j < limits_.efforts.size(); ++j) {
    if (!(limits_.efforts(j) > 0.0)) throw Error("efforts must be positive, got " + to_text(limits_.efforts(j)));
    if (std::isfinite(limits_.efforts(j))) limited_.push_back(static_cast<int>(j));
  }
  if (!(limits_.normal_force > 0.0)) throw Error("normal_force must be positive, got " + to_text(limits_.normal_force));
  if (!std::isfinite(limits_.normal_force) && limited_.empty())
    throw Error("normal_force may be infinite only where joints have efforts");
  if (!(limits_.gap > 0.0 && limits_.gap < 1.0))
    throw Error("gap must be between 0 and 1, got " + to_text(limits_.gap));
  if (!(limits_.torque_length >= 0.0) || !std::isfinite(limits_.torque_length))
    throw Error("torque_length must not be negative, got " + to_text(limits_.torque_length));
}

// Wrenches and efforts of the contacts' coordinates z at x, forces in units; false without force closure.
bool HoldingForce::prepare(const double* x) {
  if (!closure_.closes(x, inner_)) return false;
  const int contacts = system_.contact_count(), dof = system_.object_dof();
  const Placement& object = system_.model().placement(system_.model().object_joint_index());
  rotation_ = object.rotation;
  const Eigen::Vector3d center = object.translation + object.rotation * limits_.center_of_mass;
  if (!limited_.empty() && cone_size_ > directions_) {
    spins_.resize(contacts, system_.actuated_count());
    system_.normal_spins(x, spins_);
  }
  wrenches_.setZero(dof, static_cast<Eigen::Index>(contacts) * cone_size_);
  efforts_.setZero(static_cast<Eigen::Index>(limited_.size()), wrenches_.cols());
  z_.resize(wrenches_.cols());
  for (int c = 0; c < contacts; ++c) set_contact(c, center);
  for (std::size_t j = 0; j < limited_.size(); ++j)
    efforts_.row(static_cast<Eigen::Index>(j)) /= limits_.efforts(limited_[j]);
  const double share = limited_.empty() ? 0.0 : (efforts_ * z_).cwiseAbs().maxCoeff();
  unit_ = std::isfinite(limits_.normal_force) ? limits_.normal_force : 1.0 / std::max(share, 1e-12);
  efforts_ *= unit_;
  z_ *= kStartShare / std::max(1.0, share * unit_);
  return true;
}

// Columns of one contact: a unit along the normal, what the cone has across it for that, and the torque about it.
void HoldingForce::set_contact(int c, const Eigen::Vector3d& center) {
  const ContactPoint& point = closure_.points()[c];
  const Eigen::Vector3d n = -point.object_normal, arm = point.object_point - center;
  const Eigen::Vector3d s = directions_ == 2 ? Eigen::Vector3d(-n.y(), n.x(), 0.0) : n.unitOrthogonal();
  const Eigen::Vector3d axes[3] = {n, limits_.friction * s, limits_.friction * n.cross(s)};
  const Eigen::Vector3d f = inner_.forces.row(c).transpose();
  const Eigen::Index first = static_cast<Eigen::Index>(c) * cone_size_, torques = system_.object_dof() - directions_;
  for (int k = 0; k < directions_; ++k) {
    auto wrench = wrenches_.col(first + k);
    wrench.head(directions_) = axes[k].head(directions_);
    wrench.tail(torques) = arm.cross(axes[k]).tail(torques);
    for (std::size_t j = 0; j < limited_.size(); ++j)
      efforts_(static_cast<Eigen::Index>(j), first + k) = closure_.J().col(limited_[j]).segment<3>(3 * c).dot(axes[k]);
    z_(first + k) = f.dot(axes[k]) / axes[k].squaredNorm();
  }
  if (cone_size_ == directions_) return;
  wrenches_.col(first + directions_).tail<3>() = limits_.torsional * n;
  for (std::size_t j = 0; j < limited_.size(); ++j)
    efforts_(static_cast<Eigen::Index>(j), first + directions_) = limits_.torsional * spins_(c, limited_[j]);
  z_(first + directions_) = inner_.torques(c) / limits_.torsional;
}

// The programme of the forces that meet the equations [e x contacts cone_size], equations z = 0.
void HoldingForce::set_program(const RowMatrix& equations) {
  const Eigen::Index size = z_.size(), count = equations.rows();
  basis_.setIdentity(size, size);
  if (count > 0) basis_ = orthonormal(equations.transpose()).rightCols(size - count);
  y_.noalias() = basis_.transpose() * z_;
  program_.set(basis_, cone_size_, efforts_ * basis_, std::isfinite(limits_.normal_force) ? 1.0 : kNoBudget);
}

double HoldingForce::largest(const double* x) {
  if (!prepare(x)) return 0.0;
  const int dof = system_.object_dof();
  if (limits_.torque_length > 0.0) {
    set_program(RowMatrix(0, z_.size()));
    reach_map_ = wrenches_;
    reach_map_.bottomRows(dof - directions_) /= limits_.torque_length;
  } else {
    set_program(wrenches_.bottomRows(dof - directions_));
    reach_map_ = wrenches_.topRows(directions_) * basis_;
  }
  if (reach_map_.rows() == 2) return unit_ * ball_radius(hull2_);
  if (reach_map_.rows() == 3) return unit_ * ball_radius(hull3_);
  return unit_ * ball_radius(hull6_);
}

// In units. The hull starts from the reaches both ways along the axes of the Dikin ellipsoid, which is about as long
// and wide as the body.
template <int D>
double HoldingForce::ball_radius(WrenchHull<D>& hull) {
  using Point = typename WrenchHull<D>::Point;
  if (!program_.start(y_)) return 0.0;
  program_.center();
  y_ = program_.y();
  const Small axes = principal_axes(program_.dikin_shape(reach_map_));
  optima_.resize(y_.size(), std::max<Eigen::Index>(optima_.cols(), 8 * D));
  typename WrenchHull<D>::Points points(D, 2 * D);
  double least = HUGE_VAL;
  for (int i = 0; i < 2 * D; ++i) {
    const Vector c = (i % 2 == 0 ? 1.0 : -1.0) * (reach_map_.transpose() * axes.col(i / 2));
    program_.start(y_);
    least = std::min(least, program_.maximize(c, kProgramShare * limits_.gap, kEnough * least).upper);
    optima_.col(i) = program_.y();
    points.col(i) = reach_map_ * program_.y();
  }
  int count = 2 * D;
  const auto reach = [&](const Point& direction, const typename WrenchHull<D>::Corners& corners, double smallest,
                         Point& furthest) {
    Vector between = Vector::Zero(y_.size());
    for (const auto corner : corners) between += optima_.col(corner) / D;
    const Vector c = reach_map_.transpose() * direction;
    double upper = HUGE_VAL;
    // Rounding may stop a programme that starts close to many constraints, but not the one from the centre.
    for (const Vector* from : {&std::as_const(between), &std::as_const(y_)}) {
      if (!program_.start(*from)) continue;
      const ContactProgram::Bounds bounds = program_.maximize(c, kProgramShare * limits_.gap, kEnough * smallest);
      upper = std::min(upper, bounds.upper);
      if (bounds.lower >= std::min((1.0 - limits_.gap) * upper, kEnough * smallest)) break;
    }
    furthest = reach_map_ * program_.y();
    if (count == optima_.cols()) optima_.conservativeResize(Eigen::NoChange, 2 * count);
    optima_.col(count++) = program_.y();
    return upper;
  };
  return hull.ball_radius(points, least, limits_.gap, reach);
}

// The point of a facet that is nearest to the origin is a mean of its corners; where rounding weighs one negatively,
// the weight is none.
template <int D>
std::vector<HoldingForce::Side> HoldingForce::sides_within(const WrenchHull<D>& hull, double distance) const {
  std::vector<Side> sides;
  Small corners(D, D);
  Vector y(y_.size());
  for (const auto& side : hull.sides_within(distance)) {
    for (int k = 0; k < D; ++k) corners.col(k) = reach_map_ * optima_.col(side.corners[k]);
    const SmallVector weights = solve(corners, side.normal * side.distance).cwiseMax(0.0);
    y.setZero();
    for (int k = 0; k < D; ++k) y += weights(k) / weights.sum() * optima_.col(side.corners[k]);
    sides.push_back({side.distance, side.normal, basis_ * (kSideShare * y + (1.0 - kSideShare) * y_)});
  }
  return sides;
}

std::vector<HoldingForce::Side> HoldingForce::sides_within(double distance) const {
  if (reach_map_.rows() == 2) return sides_within(hull2_, distance);
  if (reach_map_.rows() == 3) return sides_within(hull3_, distance);
  return sides_within(hull6_, distance);
}

double HoldingForce::along(const double* x, const double* direction) {
  if (!prepare(x)) return 0.0;
  const int dof = system_.object_dof(), torques = dof - directions_;
  const Eigen::Map<const Vector> in_object(direction, directions_);
  const Vector d = rotation_.topLeftCorner(directions_, directions_) * in_object;
  RowMatrix equations(dof - 1, z_.size());
  equations.topRows(torques) = wrenches_.bottomRows(torques);
  const Matrix across = orthonormal(d);  // its first column is along d
  equations.bottomRows(directions_ - 1) =
      across.rightCols(directions_ - 1).transpose() * wrenches_.topRows(directions_);
  set_program(equations);
  if (!program_.start(y_)) return 0.0;
  program_.center();
  const Vector c = -basis_.transpose() * (wrenches_.topRows(directions_).transpose() * d);
  const ContactProgram::Bounds bounds = program_.maximize(c, kLoadGap, HUGE_VAL);
  return bounds.lower >= (1.0 - kLoadGap) * bounds.upper ? unit_ * bounds.lower : std::nan("");
}

}  // namespace graspatlas
