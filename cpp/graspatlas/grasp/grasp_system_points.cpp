#include <algorithm>
#include <cmath>
#include <vector>

#include "graspatlas/grasp/grasp_system.hpp"
#include "graspatlas/manifold/angle.hpp"

// Points of the space in which a system's manifold lies: steps from one to another, bounds, and which are the same.

namespace graspatlas {

namespace {

// Room for a tangent vector of a model, on the stack unless the model is large.
class Velocity {
 public:
  explicit Velocity(int size) {
    if (size > kMost) many_.resize(static_cast<std::size_t>(size));
  }
  double* data() { return many_.empty() ? few_ : many_.data(); }

 private:
  static constexpr int kMost = 64;
  double few_[kMost];
  std::vector<double> many_;
};

}  // namespace

void GraspSystem::integrate(const double* x, const double* v, double* out) const {
  const int hand_v_size = model_->hand_v_size();
  Velocity room(model_->v_size());
  double* const velocity = room.data();
  for (int i = 0; i < hand_v_size; ++i) {
    double sum = 0.0;
    if (all_motions_)
      sum = v[i];
    else
      for (int c = 0; c < motion_count_; ++c) sum += motions_(i, c) * v[c];
    velocity[i] = sum;
  }
  for (int i = 0; i < object_dof(); ++i) velocity[hand_v_size + i] = v[motion_count_ + i] * object_scale(i);
  model_->integrate(x, velocity, out);
  const double* v_w = v + motion_count_ + object_dof();
  for (int i = 0; i < parameter_count(); ++i) {
    const int at = model_->q_size() + i;
    out[at] = x[at] + parameter_scale(free_parameters_[i].unit) * v_w[i];
    if (free_parameters_[i].parameter.periodic) out[at] = wrap_angle(out[at]);
  }
}

void GraspSystem::difference(const double* x0, const double* x1, double* out) const {
  Velocity room(model_->v_size());
  double* const velocity = room.data();
  model_->difference(x0, x1, velocity);
  const int hand_v_size = model_->hand_v_size();
  if (all_motions_) {
    std::copy_n(velocity, hand_v_size, out);
  } else {
    std::fill_n(out, motion_count_, 0.0);
    for (int i = 0; i < hand_v_size; ++i)
      for (int c = 0; c < motion_count_; ++c) out[c] += motions_pseudo_inverse_t_(i, c) * velocity[i];
  }
  for (int i = 0; i < object_dof(); ++i) out[motion_count_ + i] = velocity[hand_v_size + i] / object_scale(i);
  double* out_w = out + motion_count_ + object_dof();
  for (int i = 0; i < parameter_count(); ++i) {
    const int at = model_->q_size() + i;
    const double d = x1[at] - x0[at];
    out_w[i] = free_parameters_[i].parameter.periodic ? wrap_angle(d) : d / parameter_scale(free_parameters_[i].unit);
  }
}

void GraspSystem::embed(const double* x, double* out) const {
  if (model_->hand_is_euclidean()) {
    std::fill_n(out, motion_count_, 0.0);
    for (int i = 0; i < model_->hand_v_size(); ++i)
      for (int c = 0; c < motion_count_; ++c) out[c] += motions_pseudo_inverse_t_(i, c) * x[i];
    out += motion_count_;
  } else {
    for (const JointInfo& joint : model_->hand_joints())
      if (joint.comparable()) out = std::copy_n(x + joint.q_index, joint.q_size, out);
  }
  object_joint_.embed(x + model_->hand_q_size(), length_scale_, out);
  out += object_joint_.embedding_size();
  for (int i = 0; i < parameter_count(); ++i) {
    const double value = x[model_->q_size() + i];
    if (free_parameters_[i].unit == ParameterUnit::angle) {
      *out++ = std::cos(value);
      *out++ = std::sin(value);
    } else {
      *out++ = value / parameter_scale(free_parameters_[i].unit);
    }
  }
}

void GraspSystem::slack(const double* x, double* out) const {
  for (const Bound& bound : bounds_) *out++ = (bound.limit - bound.sign * x[bound.at]) / bound.scale;
}

void GraspSystem::check_point(const double* x) const { object_joint_.check(x + model_->hand_q_size()); }

double GraspSystem::radius_limit() const { return kLargestAngularRadius; }

bool GraspSystem::same_point(const double* x0, const double* x1, double tolerance) const {
  for (int i = 0; i < model_->hand_q_size(); ++i)
    if (!(std::abs(x1[i] - x0[i]) <= tolerance)) return false;
  return System::same_point(x0, x1, tolerance);
}

}  // namespace graspatlas
