#include "graspatlas/quality/holding_touches.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

#include "graspatlas/errors.hpp"

namespace graspatlas {

namespace {

// To which the hull is refined, of forces, and of forces and torques, whose hulls have many more facets.
constexpr double kSearchGap = 1e-3, kSearchGapWithTorques = 1e-2;
constexpr double kBelow = 3.0;  // so many times that gap the ball of the hull is smaller than the least touch at most
constexpr double kSame = 1e-7;  // difference of directions that are one
constexpr int kMostTries = 400;

double search_gap(const HoldingLimits& limits) {
  return limits.torque_length > 0.0 ? kSearchGapWithTorques : kSearchGap;
}

HoldingLimits for_search(HoldingLimits limits) {
  limits.gap = search_gap(limits);
  return limits;
}

}  // namespace

HoldingTouches::HoldingTouches(GraspSystem& system, HoldingLimits limits)
    : system_(system),
      limits_(std::move(limits)),
      holding_(system, for_search(limits_)),
      points_(static_cast<std::size_t>(system.contact_count())) {
  if (limits_.efforts.size() != 0) throw Error("slopes of the holding force are known without efforts only");
}

// E of the programme: directions first, torques divided by a length of their own where they must vanish.
void HoldingTouches::set_program() {
  const int forces = holding_.directions(), torques = system_.object_dof() - forces;
  E_ = holding_.wrenches();
  const bool resisted = limits_.torque_length > 0.0;
  const double largest = torques > 0 ? E_.bottomRows(torques).cwiseAbs().maxCoeff() : 1.0;
  torque_unit_ = resisted ? limits_.torque_length : std::max(largest, 1e-12);
  E_.bottomRows(torques) /= torque_unit_;
  program_.set(E_, holding_.cone_size(), resisted ? forces + torques : forces);
}

bool HoldingTouches::known(const TouchProgram::Touch& touch) const {
  return std::any_of(found_.begin(), found_.end(), [&](const TouchProgram::Touch& other) {
    return (other.v - touch.v).lpNorm<Eigen::Infinity>() < kSame * (1.0 + touch.v.lpNorm<Eigen::Infinity>());
  });
}

const std::vector<HoldingTouches::Touch>& HoldingTouches::find(const double* x, double share) {
  touches_.clear();
  found_.clear();
  const double largest = holding_.largest(x);
  if (!(largest > 0.0)) return touches_;
  set_program();
  const auto sides =
      holding_.sides_within((1.0 + share) * (1.0 + kBelow * search_gap(limits_)) * largest / holding_.unit());
  double least = HUGE_VAL;
  TouchProgram::Touch touch;
  int tries = 0;
  for (const HoldingForce::Side& side : sides) {
    if (side.distance > (1.0 + share) * least || ++tries > kMostTries) break;
    if (!program_.find(side.direction, side.z, touch) || known(touch)) continue;
    least = std::min(least, touch.reach);
    found_.push_back(touch);
  }
  if (found_.empty()) {
    least = sides.front().distance;
    found_.push_back(program_.guess(sides.front().direction, sides.front().z, least));
  }
  std::sort(found_.begin(), found_.end(), [](const auto& a, const auto& b) { return a.reach < b.reach; });
  for (const TouchProgram::Touch& one : found_)
    if (one.reach <= (1.0 + share) * least) touches_.push_back(touch_of(one));
  return touches_;
}

HoldingTouches::Touch HoldingTouches::touch_of(const TouchProgram::Touch& found) const {
  const int contacts = system_.contact_count(), forces = holding_.directions(), torques = system_.object_dof() - forces;
  const int cone_size = holding_.cone_size();
  const Eigen::Matrix3d to_object = holding_.object_rotation().transpose();
  Eigen::Vector3d d = Eigen::Vector3d::Zero(), w = d;
  d.head(forces) = found.v.head(forces);
  w.tail(torques) = found.v.tail(torques) / torque_unit_;
  Touch touch{
      found.reach * holding_.unit(), to_object * d,    to_object * w,         found.reach, Matrix::Zero(3, contacts),
      Matrix::Zero(3, contacts),     Vector(contacts), Vector::Zero(contacts)};
  for (int c = 0; c < contacts; ++c) {
    const Eigen::Index first = static_cast<Eigen::Index>(c) * cone_size;
    Eigen::Vector3d f = Eigen::Vector3d::Zero(), sliding = f;
    for (int k = 0; k < forces; ++k) {
      Eigen::Vector3d axis = Eigen::Vector3d::Zero();
      axis.head(forces) = holding_.wrenches().col(first + k).head(forces);
      f += found.z(first + k) * axis;
      if (k > 0) sliding += found.multipliers(first + k) / (limits_.friction * limits_.friction) * axis;
    }
    touch.forces.col(c) = to_object * f;
    touch.sliding.col(c) = to_object * sliding;
    touch.pressing(c) = found.multipliers(first);
    if (cone_size > forces) touch.torques(c) = limits_.torsional * found.z(first + forces);
  }
  return touch;
}

void HoldingTouches::lagrangians(const double* x, const std::vector<Touch>& touches, double* out) {
  system_.contact_points(x, points_.data());
  const Placement& object = system_.model().placement(system_.model().object_joint_index());
  const Eigen::Matrix3d to_object = object.rotation.transpose();
  for (std::size_t t = 0; t < touches.size(); ++t) out[t] = 0.0;
  for (int c = 0; c < system_.contact_count(); ++c) {
    const ContactPoint& point = points_[static_cast<std::size_t>(c)];
    const Eigen::Vector3d n = to_object * -point.object_normal;
    const Eigen::Vector3d arm = to_object * (point.object_point - object.translation) - limits_.center_of_mass;
    for (std::size_t t = 0; t < touches.size(); ++t) {
      const Touch& touch = touches[t];
      const Eigen::Vector3d f = touch.forces.col(c);
      const double normal = n.dot(f);
      out[t] += f.dot(touch.direction + touch.about.cross(arm)) + touch.torques(c) * touch.about.dot(n) +
                (touch.pressing(c) - touch.budget) * normal + touch.sliding.col(c).dot(f - normal * n);
    }
  }
  for (std::size_t t = 0; t < touches.size(); ++t) out[t] = holding_.unit() * (out[t] + touches[t].budget);
}

}  // namespace graspatlas
