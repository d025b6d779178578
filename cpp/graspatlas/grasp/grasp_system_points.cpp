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

// Joint velocities [hand_v_size] with velocities along the motions kept [motion_count].
void GraspSystem::along_motions(const double* y, double* velocity) const {
  const double* motion = motions_.data();
  for (int i = 0; i < model_->hand_v_size(); ++i) {
    double sum = 0.0;
    for (int c = 0; c < motion_count_; ++c) sum += *motion++ * y[c];
    velocity[i] = sum;
  }
}

// Velocities along the motions kept of joint velocities, by least squares.
void GraspSystem::on_motions(const double* velocity, double* y) const {
  for (int c = 0; c < motion_count_; ++c) {
    const double* const motion =
        motions_pseudo_inverse_.data() + static_cast<std::ptrdiff_t>(c) * model_->hand_v_size();
    double sum = 0.0;
    for (int i = 0; i < model_->hand_v_size(); ++i) sum += motion[i] * velocity[i];
    y[c] = sum;
  }
}

void GraspSystem::integrate(const double* x, const double* v, double* out) const {
  const int hand_v_size = model_->hand_v_size();
  Velocity room(model_->v_size());
  double* const velocity = room.data();
  if (all_motions_)
    std::copy_n(v, hand_v_size, velocity);
  else
    along_motions(v, velocity);
  for (int i = 0; i < object_dof(); ++i) velocity[hand_v_size + i] = v[motion_count_ + i] * object_scale(i);
  model_->integrate(x, velocity, out);
  const double* v_w = v + motion_count_ + object_dof();
  for (int i = 0; i < parameter_count(); ++i) {
    const int at = model_->q_size() + i;
    const FreeParameter& free = free_parameters_[static_cast<std::size_t>(i)];
    out[at] = x[at] + free.scale * v_w[i];
    if (free.parameter.periodic) out[at] = wrap_angle(out[at]);
  }
}

void GraspSystem::difference(const double* x0, const double* x1, double* out) const {
  Velocity room(model_->v_size());
  double* const velocity = room.data();
  model_->difference(x0, x1, velocity);
  const int hand_v_size = model_->hand_v_size();
  if (all_motions_)
    std::copy_n(velocity, hand_v_size, out);
  else
    on_motions(velocity, out);
  for (int i = 0; i < object_dof(); ++i) out[motion_count_ + i] = velocity[hand_v_size + i] / object_scale(i);
  double* out_w = out + motion_count_ + object_dof();
  for (int i = 0; i < parameter_count(); ++i) {
    const int at = model_->q_size() + i;
    const FreeParameter& free = free_parameters_[static_cast<std::size_t>(i)];
    const double d = x1[at] - x0[at];
    out_w[i] = free.parameter.periodic ? wrap_angle(d) : d / free.scale;
  }
}

void GraspSystem::embed(const double* x, double* out) const {
  if (model_->hand_is_euclidean()) {
    on_motions(x, out);
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
      *out++ = value / free_parameters_[i].scale;
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
