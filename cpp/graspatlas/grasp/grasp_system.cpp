#include "graspatlas/grasp/grasp_system.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

#include "graspatlas/errors.hpp"
#include "graspatlas/manifold/angle.hpp"

namespace graspatlas {

namespace {

constexpr int kEntries = ObjectJoint::kContactEntries;
using Twist = Eigen::Matrix<double, 6, 1>;

// A joint is moved by the kept motions when the row of its velocity is longer than this.
constexpr double kMoved = 1e-12;

// An angle is embedded as a point of the circle.
int embedded_numbers(ParameterUnit unit) { return unit == ParameterUnit::angle ? 2 : 1; }

template <class Visit>
void visit_sides(const std::vector<Contact>& contacts, Visit visit) {
  for (const Contact& contact : contacts) {
    visit(contact.hand);
    visit(contact.object);
  }
}

int count_free(const std::vector<Contact>& contacts) {
  int count = 0;
  visit_sides(contacts, [&](const ContactSide& side) { count += side.u.free + side.v.free; });
  return count;
}

int configuration_size(const GraspParts& parts) { return parts.model->q_size() + count_free(parts.contacts); }

int tangent_size(const GraspParts& parts) {
  return static_cast<int>(parts.motions.cols()) + parts.model->object_joint().dof() + count_free(parts.contacts);
}

int equation_count(const GraspParts& parts) {
  return parts.model->object_joint().equations_per_contact() * static_cast<int>(parts.contacts.size());
}

int embedding_size(const GraspParts& parts) {
  int size = parts.model->object_joint().embedding_size();
  if (parts.model->hand_is_euclidean()) {
    size += static_cast<int>(parts.motions.cols());
  } else {
    for (const JointInfo& joint : parts.model->hand_joints()) size += joint.comparable() ? joint.q_size : 0;
  }
  visit_sides(parts.contacts, [&](const ContactSide& side) {
    if (side.u.free) size += embedded_numbers(side.patch->u_unit());
    if (side.v.free) size += embedded_numbers(side.patch->v_unit());
  });
  return size;
}

Matrix pseudo_inverse(const Matrix& A) { return (A.transpose() * A).ldlt().solve(A.transpose()); }

}  // namespace

GraspSystem::GraspSystem(GraspParts parts)
    : System(graspatlas::configuration_size(parts), graspatlas::tangent_size(parts), graspatlas::equation_count(parts),
             graspatlas::embedding_size(parts)),
      model_(std::move(parts.model)),
      contacts_(std::move(parts.contacts)),
      motions_(parts.motions),
      motions_pseudo_inverse_(pseudo_inverse(parts.motions)),
      transmission_(parts.transmission),
      all_motions_(parts.motions.rows() == parts.motions.cols() && parts.motions.isIdentity(0.0)),
      motion_count_(static_cast<int>(parts.motions.cols())),
      object_joint_(model_->object_joint()),
      rows_per_contact_(object_joint_.equations_per_contact()),
      rows_(object_joint_.contact_rows()),
      length_scale_(parts.length_scale),
      twists_(6 * static_cast<std::size_t>(motion_count_)),
      lower_limits_(std::move(parts.lower)),
      upper_limits_(std::move(parts.upper)) {
  check_parts();
  std::vector<int> joints;
  visit_sides(contacts_, [&](const ContactSide& side) { joints.push_back(side.joint); });
  if (model_->object_joint_index() >= 0) joints.push_back(model_->object_joint_index());
  placed_ = model_->carriers(joints);
  collect_free_parameters();
  add_joint_bounds();
  add_parameter_bounds();
  set_bound_normals(normals_of_bounds());
}

void GraspSystem::check_parts() const {
  const int velocities = model_->hand_v_size();
  if (motions_.rows() != velocities)
    throw Error("the hand motions have " + std::to_string(motions_.rows()) + " rows, the hand has " +
                std::to_string(velocities) + " joint velocities");
  if (transmission_.rows() != velocities)
    throw Error("the transmission has " + std::to_string(transmission_.rows()) + " rows, the hand has " +
                std::to_string(velocities) + " joint velocities");
  if (!(length_scale_ > 0.0) || !std::isfinite(length_scale_))
    throw Error("length_scale must be positive, got " + to_text(length_scale_));
  const int joints = model_->joint_count();
  visit_sides(contacts_, [&](const ContactSide& side) {
    if (side.joint < 0 || side.joint >= joints)
      throw Error("a contact sits on joint " + std::to_string(side.joint) + ", the model has " +
                  std::to_string(joints));
  });
  if (static_cast<int>(lower_limits_.size()) != model_->hand_q_size() || lower_limits_.size() != upper_limits_.size())
    throw Error("joint limits must hold " + std::to_string(model_->hand_q_size()) + " numbers");
}

void GraspSystem::collect_free_parameters() {
  visit_sides(contacts_, [&](const ContactSide& side) {
    const auto add = [&](const PatchParameter& parameter, ParameterUnit unit) {
      if (parameter.free) free_parameters_.push_back({parameter, unit, parameter_scale(unit)});
    };
    add(side.u, side.patch->u_unit());
    add(side.v, side.patch->v_unit());
  });
}

void GraspSystem::add_joint_bounds() {
  for (const JointInfo& joint : model_->hand_joints()) {
    if (joint.q_size != 1) continue;
    const double low = lower_limits_[joint.q_index], high = upper_limits_[joint.q_index];
    const auto add = [&](double sign, double limit, const char* side) {
      bounds_.push_back({joint.q_index, joint.v_index, true, sign, limit, joint.prismatic ? length_scale_ : 1.0});
      bound_names_.push_back(std::string(side) + " limit of joint '" + joint.name + "'");
    };
    // A joint that no kept motion moves stays where x1 has it.
    if (motions_.row(joint.v_index).norm() < kMoved) continue;
    if (!(low < high))
      throw Error("joint '" + joint.name + "' has limits [" + to_text(low) + ", " + to_text(high) +
                  "]; the lower must be below the upper, and a joint that does not move is of type fixed");
    if (std::isfinite(high)) add(1.0, high, "upper");
    if (std::isfinite(low)) add(-1.0, -low, "lower");
  }
}

void GraspSystem::add_parameter_bounds() {
  for (std::size_t i = 0; i < free_parameters_.size(); ++i) {
    const PatchParameter& parameter = free_parameters_[i].parameter;
    if (parameter.periodic) continue;
    const double scale = free_parameters_[i].scale;
    const auto add = [&](double sign, double limit, const char* side) {
      if (!std::isfinite(limit)) return;
      bounds_.push_back({model_->q_size() + static_cast<int>(i), static_cast<int>(i), false, sign, limit, scale});
      bound_names_.push_back(std::string(side) + " end of patch parameter " + std::to_string(i));
    };
    add(1.0, parameter.upper, "upper");
    add(-1.0, -parameter.lower, "lower");
  }
}

RowMatrix GraspSystem::normals_of_bounds() const {
  RowMatrix B = RowMatrix::Zero(static_cast<Eigen::Index>(bounds_.size()), tangent_size());
  for (std::size_t i = 0; i < bounds_.size(); ++i) {
    const Bound& bound = bounds_[i];
    const auto row = static_cast<Eigen::Index>(i);
    if (bound.joint)
      B.row(row).head(motion_count_) = bound.sign / bound.scale * motions_.row(bound.tangent);
    else
      B(row, motion_count_ + object_dof() + bound.tangent) = bound.sign;
  }
  return B;
}

// Places model and patches at x, with `velocities` so that velocities of the model can be asked for too, and calls
// visit(contact, hand, object) for each contact, with both sides where they are.
template <class Visit>
void GraspSystem::visit_contacts(const double* x, bool velocities, Visit visit) {
  model_->update(x, velocities, placed_);
  const double* w = x + model_->q_size();
  SideState hand, object;
  for (const Contact& contact : contacts_) {
    place_side(contact.hand, w, hand);
    place_side(contact.object, w, object);
    visit(contact, hand, object);
  }
}

void GraspSystem::place_side(const ContactSide& side, const double*& w, SideState& out) const {
  const double u = side.u.free ? *w++ : side.u.value;
  const double v = side.v.free ? *w++ : side.v.value;
  side.patch->evaluate(u, v, out.local);
  const Placement& joint = model_->placement(side.joint);
  out.rotation.noalias() = joint.rotation * side.frame.rotation;
  const Eigen::Vector3d in_joint = side.frame.rotation * out.local.o + side.frame.translation;
  out.point.noalias() = joint.rotation * in_joint + joint.translation;
}

GraspSystem::ContactAxes GraspSystem::contact_axes(const SideState& hand, const SideState& object) const {
  return {object.rotation * object.local.m, object_joint_.first_tangent(hand.rotation, hand.local.a, hand.local.m),
          hand.rotation * hand.local.b};
}

// The equations of one contact, from R on, which then is behind them.
void GraspSystem::write_equations(const SideState& hand, const SideState& object, const ContactAxes& axes,
                                  double*& R) const {
  const Eigen::Vector3d gap = (hand.point - object.point) / length_scale_;
  const double entries[kEntries] = {gap.x(), gap.y(), gap.z(), axes.m.dot(axes.a), axes.m.dot(axes.b)};
  for (int e = 0; e < rows_per_contact_; ++e) *R++ = entries[rows_[e]];
}

void GraspSystem::residual(const double* x, double* R) {
  visit_contacts(x, false, [&](const Contact&, const SideState& hand, const SideState& object) {
    write_equations(hand, object, contact_axes(hand, object), R);
  });
}

// Adds the column of what moves with a velocity, times a scale, to the rows of one contact, given its point.
void GraspSystem::add_velocity_column(const double* velocity, double scale, const ContactArms& arms, double* J) const {
  const Eigen::Map<const Eigen::Vector3d> linear(velocity), angular(velocity + 3);
  const Eigen::Vector3d moved = (scale / length_scale_) * (linear + angular.cross(arms.point));
  const double entries[kEntries] = {moved.x(), moved.y(), moved.z(), scale * angular.dot(arms.a_cross_m),
                                    scale * angular.dot(arms.b_cross_m)};
  const int n = tangent_size();
  for (int e = 0; e < rows_per_contact_; ++e) J[static_cast<std::ptrdiff_t>(e) * n] += entries[rows_[e]];
}

// Adds the columns of hand and object to the rows of one contact, for the side on a joint.
void GraspSystem::add_velocity_columns(int joint, double sign, const ContactArms& arms, double* J) {
  const int hand_v_size = model_->hand_v_size();
  double* const twists = twists_.data();
  bool moved = false;  // by hand motions, along each of which the joint moves with a twist
  for (const int v : model_->support(joint)) {
    const double* const velocity = model_->velocity(v);
    if (v >= hand_v_size) {
      const int object_v = v - hand_v_size;
      add_velocity_column(velocity, sign * object_scale(object_v), arms, J + motion_count_ + object_v);
    } else if (all_motions_) {
      add_velocity_column(velocity, sign, arms, J + v);
    } else {
      if (!moved) std::fill(twists_.begin(), twists_.end(), 0.0);
      moved = true;
      const double* const motion = motions_.data() + static_cast<std::ptrdiff_t>(v) * motion_count_;
      for (int c = 0; c < motion_count_; ++c)
        Eigen::Map<Twist>(twists + 6 * c) += motion[c] * Eigen::Map<const Twist>(velocity);
    }
  }
  for (int c = 0; moved && c < motion_count_; ++c) add_velocity_column(twists + 6 * c, sign, arms, J + c);
}

void GraspSystem::write_column(const double* entries, double* J) const {
  for (int e = 0; e < rows_per_contact_; ++e) J[static_cast<std::ptrdiff_t>(e) * tangent_size()] = entries[rows_[e]];
}

void GraspSystem::write_hand_column(const SideState& hand, const ContactAxes& axes, const PatchDerivative& by,
                                    ParameterUnit unit, double* J) const {
  const double scale = parameter_scale(unit);
  const Eigen::Vector3d d = hand.rotation * by.o * (scale / length_scale_);
  const double da = axes.m.dot(object_joint_.first_tangent(hand.rotation, by.a, by.m));
  const double db = axes.m.dot(hand.rotation * by.b);
  const double entries[kEntries] = {d.x(), d.y(), d.z(), scale * da, scale * db};
  write_column(entries, J);
}

void GraspSystem::write_object_column(const SideState& object, const ContactAxes& axes, const PatchDerivative& by,
                                      ParameterUnit unit, double* J) const {
  const double scale = parameter_scale(unit);
  const Eigen::Vector3d d = object.rotation * by.o * (-scale / length_scale_);
  const Eigen::Vector3d dm = scale * (object.rotation * by.m);
  const double entries[kEntries] = {d.x(), d.y(), d.z(), axes.a.dot(dm), axes.b.dot(dm)};
  write_column(entries, J);
}

// Columns of the free parameters of one contact, from J on: u and v of the hand's patch, then of the object's. Returns
// how many they are.
int GraspSystem::write_parameter_columns(const Contact& contact, const SideState& hand, const SideState& object,
                                         const ContactAxes& axes, double* J) const {
  const ContactSide &on_hand = contact.hand, &on_object = contact.object;
  double* const first = J;
  if (on_hand.u.free) write_hand_column(hand, axes, by_u(hand.local), on_hand.patch->u_unit(), J++);
  if (on_hand.v.free) write_hand_column(hand, axes, by_v(hand.local), on_hand.patch->v_unit(), J++);
  if (on_object.u.free) write_object_column(object, axes, by_u(object.local), on_object.patch->u_unit(), J++);
  if (on_object.v.free) write_object_column(object, axes, by_v(object.local), on_object.patch->v_unit(), J++);
  return static_cast<int>(J - first);
}

void GraspSystem::linearize(const double* x, double* R, double* J) {
  std::fill_n(J, static_cast<std::size_t>(equation_count()) * tangent_size(), 0.0);
  int column = motion_count_ + object_dof();
  visit_contacts(x, true, [&](const Contact& contact, const SideState& hand, const SideState& object) {
    const ContactAxes axes = contact_axes(hand, object);
    write_equations(hand, object, axes, R);
    const Eigen::Vector3d a_cross_m = axes.a.cross(axes.m), b_cross_m = axes.b.cross(axes.m);
    add_velocity_columns(contact.hand.joint, 1.0, {hand.point, a_cross_m, b_cross_m}, J);
    add_velocity_columns(contact.object.joint, -1.0, {object.point, a_cross_m, b_cross_m}, J);
    column += write_parameter_columns(contact, hand, object, axes, J + column);
    J += static_cast<std::ptrdiff_t>(rows_per_contact_) * tangent_size();
  });
}

std::unique_ptr<System> GraspSystem::clone() const {
  auto copy = std::make_unique<GraspSystem>(*this);
  copy->model_ = std::make_shared<Model>(*model_);
  return copy;
}

void GraspSystem::contact_points(const double* x, ContactPoint* out) {
  visit_contacts(x, false, [&](const Contact&, const SideState& hand, const SideState& object) {
    *out++ = {hand.point, object.point, hand.rotation * hand.local.m, object.rotation * object.local.m};
  });
}

void GraspSystem::contact_points(const double* x, ContactPoint* out, Eigen::Ref<RowMatrix> Gt) {
  contact_points(x, out);
  const Eigen::Vector3d& origin = model_->placement(model_->object_joint_index()).translation;
  for (int c = 0; c < contact_count(); ++c)
    object_joint_.point_velocities(out[c].object_point - origin, Gt.middleRows<3>(3 * c));
}

void GraspSystem::grasp_matrices(const double* x, Eigen::Ref<RowMatrix> J, Eigen::Ref<RowMatrix> Gt) {
  J.setZero();
  Eigen::Index row = 0;
  visit_contacts(x, true, [&](const Contact& contact, const SideState& hand, const SideState& object) {
    for (int v : model_->support(contact.hand.joint)) {
      const Eigen::Map<const Eigen::Vector3d> linear(model_->velocity(v)), angular(model_->velocity(v) + 3);
      const Eigen::Vector3d moved = linear + angular.cross(hand.point);
      for (Eigen::Index d = 0; d < transmission_.cols(); ++d) J.block<3, 1>(row, d) += transmission_(v, d) * moved;
    }
    const Eigen::Vector3d& origin = model_->placement(model_->object_joint_index()).translation;
    object_joint_.point_velocities(object.point - origin, Gt.middleRows<3>(row));
    row += 3;
  });
}

void GraspSystem::normal_spins(const double* x, Eigen::Ref<RowMatrix> out) {
  out.setZero();
  Eigen::Index row = 0;
  visit_contacts(x, true, [&](const Contact& contact, const SideState&, const SideState& object) {
    const Eigen::Vector3d inward = -(object.rotation * object.local.m);
    for (int v : model_->support(contact.hand.joint)) {
      const Eigen::Map<const Eigen::Vector3d> angular(model_->velocity(v) + 3);
      out.row(row) += inward.dot(angular) * transmission_.row(v);
    }
    ++row;
  });
}

}  // namespace graspatlas
