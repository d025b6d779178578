#include "graspatlas/grasp/grasp_system.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "graspatlas/continuation/angle.hpp"

namespace graspatlas {

namespace {

// Entries of one contact: the three coordinates between the points, and the hand's two tangents on the object's normal.
// In the plane the z coordinate and the tangent along z vanish.
constexpr int kEntries = 5;
constexpr int kSpatialRows[] = {0, 1, 2, 3, 4};
constexpr int kPlanarRows[] = {0, 1, 3};

bool is_planar(const Model& model) { return model.object_kind() == ObjectJoint::planar; }

int equations_per_contact(const Model& model) { return is_planar(model) ? 3 : 5; }

int object_v_size(const Model& model) { return model.v_size() - model.hand_v_size(); }

// Tangent coordinates of the object that are lengths: x, y, z of a free flyer; x, y of a planar joint.
int object_lengths(const Model& model) {
  return model.object_kind() == ObjectJoint::free_flyer ? 3 : model.object_kind() == ObjectJoint::planar ? 2 : 0;
}

int object_embedding(const Model& model) {
  return model.object_kind() == ObjectJoint::free_flyer ? 12 : model.object_kind() == ObjectJoint::planar ? 4 : 0;
}

// Numbers of q that may be compared one by one: all but quaternions, whose negatives are the same.
bool comparable(const JointInfo& joint) { return joint.q_size == joint.v_size || joint.q_size == 2; }

// An angle is embedded as a point of the circle.
int embedded_numbers(ParameterUnit unit) { return unit == ParameterUnit::angle ? 2 : 1; }

// How much a patch's parameter changes when its tangent coordinate changes by one.
double parameter_scale(ParameterUnit unit, double length_scale) {
  return unit == ParameterUnit::length ? length_scale : 1.0;
}

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

template <class Visit>
void visit_sides(const std::vector<Contact>& contacts, Visit visit) {
  for (const Contact& contact : contacts) {
    visit(contact.hand);
    visit(contact.object);
  }
}

}  // namespace

int GraspSystem::count_free(const std::vector<Contact>& contacts) {
  int count = 0;
  visit_sides(contacts, [&](const ContactSide& side) { count += side.u.free + side.v.free; });
  return count;
}

int GraspSystem::embedding_size(const Model& model, const std::vector<Contact>& contacts, int motions) {
  int size = object_embedding(model);
  if (model.hand_is_euclidean()) {
    size += motions;
  } else {
    for (const JointInfo& joint : model.hand_joints()) size += comparable(joint) ? joint.q_size : 0;
  }
  visit_sides(contacts, [&](const ContactSide& side) {
    if (side.u.free) size += embedded_numbers(side.patch->u_unit());
    if (side.v.free) size += embedded_numbers(side.patch->v_unit());
  });
  return size;
}

GraspSystem::GraspSystem(std::shared_ptr<Model> model, std::vector<Contact> contacts, const Matrix& motions,
                         double length_scale, const std::vector<double>& lower, const std::vector<double>& upper,
                         const Matrix& drives)
    : System(model->q_size() + count_free(contacts),
             static_cast<int>(motions.cols()) + graspatlas::object_v_size(*model) + count_free(contacts),
             equations_per_contact(*model) * static_cast<int>(contacts.size()),
             embedding_size(*model, contacts, static_cast<int>(motions.cols()))),
      model_(std::move(model)),
      contacts_(std::move(contacts)),
      motions_(motions),
      coordinates_((motions.transpose() * motions).ldlt().solve(motions.transpose()).transpose()),
      drives_(drives),
      all_motions_(motions.rows() == motions.cols() && motions.isIdentity(0.0)),
      motion_count_(static_cast<int>(motions.cols())),
      object_v_size_(graspatlas::object_v_size(*model_)),
      rows_per_contact_(equations_per_contact(*model_)),
      rows_(is_planar(*model_) ? kPlanarRows : kSpatialRows),
      length_scale_(length_scale),
      lower_limits_(lower),
      upper_limits_(upper) {
  if (motions.rows() != model_->hand_v_size())
    throw Error("the hand motions have " + std::to_string(motions.rows()) + " rows, the hand has " +
                std::to_string(model_->hand_v_size()) + " joint velocities");
  if (drives.rows() != model_->hand_v_size())
    throw Error("the drives have " + std::to_string(drives.rows()) + " rows, the hand has " +
                std::to_string(model_->hand_v_size()) + " joint velocities");
  if (!(length_scale > 0.0) || !std::isfinite(length_scale))
    throw Error("length_scale must be positive, got " + to_text(length_scale));
  const int joints = model_->joint_count();
  visit_sides(contacts_, [&](const ContactSide& side) {
    if (side.joint < 0 || side.joint >= joints)
      throw Error("a contact sits on joint " + std::to_string(side.joint) + ", the model has " +
                  std::to_string(joints));
    if (side.u.free) parameters_.push_back({side.u, side.patch->u_unit()});
    if (side.v.free) parameters_.push_back({side.v, side.patch->v_unit()});
  });
  add_joint_bounds(lower, upper);
  add_parameter_bounds();
  RowMatrix B = RowMatrix::Zero(static_cast<Eigen::Index>(bounds_.size()), tangent_size());
  for (std::size_t i = 0; i < bounds_.size(); ++i) {
    const Bound& bound = bounds_[i];
    const auto row = static_cast<Eigen::Index>(i);
    if (bound.joint)
      B.row(row).head(motion_count_) = bound.sign / bound.scale * motions_.row(bound.tangent);
    else
      B(row, motion_count_ + object_v_size_ + bound.tangent) = bound.sign;
  }
  set_bound_normals(B);
}

void GraspSystem::add_joint_bounds(const std::vector<double>& lower, const std::vector<double>& upper) {
  if (static_cast<int>(lower.size()) != model_->hand_q_size() || lower.size() != upper.size())
    throw Error("joint limits must hold " + std::to_string(model_->hand_q_size()) + " numbers");
  for (const JointInfo& joint : model_->hand_joints()) {
    if (joint.q_size != 1) continue;
    const double low = lower[joint.q_index], high = upper[joint.q_index];
    const auto add = [&](double sign, double limit, const char* side) {
      bounds_.push_back({joint.q_index, joint.v_index, true, sign, limit, joint.prismatic ? length_scale_ : 1.0});
      bound_names_.push_back(std::string(side) + " limit of joint '" + joint.name + "'");
    };
    // A joint that no kept motion moves stays where x1 has it.
    if (motions_.row(joint.v_index).norm() < 1e-12) continue;
    if (!(low < high))
      throw Error("joint '" + joint.name + "' has limits [" + to_text(low) + ", " + to_text(high) +
                  "]; the lower must be below the upper, and a joint that does not move is of type fixed");
    if (std::isfinite(high)) add(1.0, high, "upper");
    if (std::isfinite(low)) add(-1.0, -low, "lower");
  }
}

void GraspSystem::add_parameter_bounds() {
  for (std::size_t i = 0; i < parameters_.size(); ++i) {
    const PatchParameter& parameter = parameters_[i].parameter;
    if (parameter.periodic) continue;
    const double scale = parameter_scale(parameters_[i].unit, length_scale_);
    const auto add = [&](double sign, double limit, const char* side) {
      if (!std::isfinite(limit)) return;
      bounds_.push_back({model_->q_size() + static_cast<int>(i), static_cast<int>(i), false, sign, limit, scale});
      bound_names_.push_back(std::string(side) + " end of patch parameter " + std::to_string(i));
    };
    add(1.0, parameter.upper, "upper");
    add(-1.0, -parameter.lower, "lower");
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

void GraspSystem::contact_entries(const SideState& hand, const SideState& object, double* entries) const {
  const Eigen::Vector3d gap = (hand.point - object.point) / length_scale_;
  const Eigen::Vector3d m = object.rotation * object.local.m;
  entries[0] = gap.x();
  entries[1] = gap.y();
  entries[2] = gap.z();
  entries[3] = m.dot(first_tangent(hand, hand.local.a, hand.local.m));
  entries[4] = m.dot(hand.rotation * hand.local.b);
}

// The hand's first tangent in the world, or its derivative, from those of a and of the normal: in the plane it is the
// one in the plane.
Eigen::Vector3d GraspSystem::first_tangent(const SideState& hand, const Eigen::Vector3d& a,
                                           const Eigen::Vector3d& normal) const {
  if (!is_planar(*model_)) return hand.rotation * a;
  return Eigen::Vector3d::UnitZ().cross(hand.rotation * normal);
}

void GraspSystem::residual(const double* x, double* R) {
  model_->update(x, false);
  const double* w = x + model_->q_size();
  SideState hand, object;
  for (const Contact& contact : contacts_) {
    place_side(contact.hand, w, hand);
    place_side(contact.object, w, object);
    double entries[kEntries];
    contact_entries(hand, object, entries);
    for (int e = 0; e < rows_per_contact_; ++e) *R++ = entries[rows_[e]];
  }
}

// Column of the model's tangent coordinate v in the five rows of one contact, given the side's contact point.
void GraspSystem::add_column(int v, double sign, const Eigen::Vector3d& point, const Eigen::Vector3d& a_cross_m,
                             const Eigen::Vector3d& b_cross_m, double* J) const {
  const double* velocity = model_->velocity(v);
  const Eigen::Map<const Eigen::Vector3d> linear(velocity), angular(velocity + 3);
  const Eigen::Vector3d moved = (sign / length_scale_) * (linear + angular.cross(point));
  const double entries[kEntries] = {moved.x(), moved.y(), moved.z(), sign * angular.dot(a_cross_m),
                                    sign * angular.dot(b_cross_m)};
  const int n = tangent_size(), hand_v_size = model_->hand_v_size();
  if (v < hand_v_size && !all_motions_) {
    const double* motion = motions_.data() + static_cast<std::ptrdiff_t>(v) * motion_count_;
    for (int e = 0; e < rows_per_contact_; ++e) {
      double* __restrict row = J + static_cast<std::ptrdiff_t>(e) * n;
      const double entry = entries[rows_[e]];
      for (int c = 0; c < motion_count_; ++c) row[c] += entry * motion[c];
    }
    return;
  }
  const int object_v = v - hand_v_size;
  const int column = v < hand_v_size ? v : motion_count_ + object_v;
  const double scale = object_v >= 0 && object_v < object_lengths(*model_) ? length_scale_ : 1.0;
  for (int e = 0; e < rows_per_contact_; ++e)
    J[static_cast<std::ptrdiff_t>(e) * n + column] += scale * entries[rows_[e]];
}

void GraspSystem::linearize(const double* x, double* R, double* J) {
  model_->update(x, true);
  const int n = tangent_size();
  std::fill_n(J, static_cast<std::size_t>(equation_count()) * n, 0.0);
  const double* w = x + model_->q_size();
  int column = motion_count_ + object_v_size_;
  SideState hand, object;
  for (const Contact& contact : contacts_) {
    place_side(contact.hand, w, hand);
    place_side(contact.object, w, object);
    double residuals[kEntries];
    contact_entries(hand, object, residuals);
    for (int e = 0; e < rows_per_contact_; ++e) *R++ = residuals[rows_[e]];
    const Eigen::Vector3d m = object.rotation * object.local.m;
    const Eigen::Vector3d a = first_tangent(hand, hand.local.a, hand.local.m), b = hand.rotation * hand.local.b;
    const Eigen::Vector3d a_cross_m = a.cross(m), b_cross_m = b.cross(m);
    for (int v : model_->support(contact.hand.joint)) add_column(v, 1.0, hand.point, a_cross_m, b_cross_m, J);
    for (int v : model_->support(contact.object.joint)) add_column(v, -1.0, object.point, a_cross_m, b_cross_m, J);

    // Free parameters: u and v of the hand's patch, then of the object's; lengths are in units of length_scale.
    const auto fill = [&](double dx, double dy, double dz, double da, double db) {
      const double entries[kEntries] = {dx, dy, dz, da, db};
      for (int e = 0; e < rows_per_contact_; ++e) J[static_cast<std::ptrdiff_t>(e) * n + column] = entries[rows_[e]];
      ++column;
    };
    const auto hand_column = [&](const Eigen::Vector3d& o_w, const Eigen::Vector3d& m_w, const Eigen::Vector3d& a_w,
                                 const Eigen::Vector3d& b_w, double scale) {
      const Eigen::Vector3d d = hand.rotation * o_w * (scale / length_scale_);
      const double da = m.dot(first_tangent(hand, a_w, m_w)), db = m.dot(hand.rotation * b_w);
      fill(d.x(), d.y(), d.z(), scale * da, scale * db);
    };
    const auto object_column = [&](const Eigen::Vector3d& o_w, const Eigen::Vector3d& m_w, double scale) {
      const Eigen::Vector3d d = object.rotation * o_w * (-scale / length_scale_);
      const Eigen::Vector3d dm = scale * (object.rotation * m_w);
      fill(d.x(), d.y(), d.z(), a.dot(dm), b.dot(dm));
    };
    const auto scale_of = [&](ParameterUnit unit) { return parameter_scale(unit, length_scale_); };
    const PatchPoint &h = hand.local, &o = object.local;
    if (contact.hand.u.free) hand_column(h.o_u, h.m_u, h.a_u, h.b_u, scale_of(contact.hand.patch->u_unit()));
    if (contact.hand.v.free) hand_column(h.o_v, h.m_v, h.a_v, h.b_v, scale_of(contact.hand.patch->v_unit()));
    if (contact.object.u.free) object_column(o.o_u, o.m_u, scale_of(contact.object.patch->u_unit()));
    if (contact.object.v.free) object_column(o.o_v, o.m_v, scale_of(contact.object.patch->v_unit()));
    J += static_cast<std::ptrdiff_t>(rows_per_contact_) * n;
  }
}

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
  const int lengths = object_lengths(*model_);
  for (int i = 0; i < object_v_size_; ++i)
    velocity[hand_v_size + i] = v[motion_count_ + i] * (i < lengths ? length_scale_ : 1.0);
  model_->integrate(x, velocity, out);
  const double* v_w = v + motion_count_ + object_v_size_;
  for (int i = 0; i < parameter_count(); ++i) {
    const int at = model_->q_size() + i;
    out[at] = x[at] + parameter_scale(parameters_[i].unit, length_scale_) * v_w[i];
    if (parameters_[i].parameter.periodic) out[at] = wrap_angle(out[at]);
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
      for (int c = 0; c < motion_count_; ++c) out[c] += coordinates_(i, c) * velocity[i];
  }
  const int lengths = object_lengths(*model_);
  for (int i = 0; i < object_v_size_; ++i)
    out[motion_count_ + i] = velocity[hand_v_size + i] / (i < lengths ? length_scale_ : 1.0);
  double* out_w = out + motion_count_ + object_v_size_;
  for (int i = 0; i < parameter_count(); ++i) {
    const int at = model_->q_size() + i;
    const double d = x1[at] - x0[at];
    out_w[i] =
        parameters_[i].parameter.periodic ? wrap_angle(d) : d / parameter_scale(parameters_[i].unit, length_scale_);
  }
}

void GraspSystem::embed(const double* x, double* out) const {
  if (model_->hand_is_euclidean()) {
    std::fill_n(out, motion_count_, 0.0);
    for (int i = 0; i < model_->hand_v_size(); ++i)
      for (int c = 0; c < motion_count_; ++c) out[c] += coordinates_(i, c) * x[i];
    out += motion_count_;
  } else {
    for (const JointInfo& joint : model_->hand_joints())
      if (comparable(joint)) out = std::copy_n(x + joint.q_index, joint.q_size, out);
  }
  const double* object = x + model_->hand_q_size();
  const int lengths = object_lengths(*model_);
  for (int i = 0; i < lengths; ++i) *out++ = object[i] / length_scale_;
  if (model_->object_kind() == ObjectJoint::free_flyer) {
    // |R1 - R0| in the Frobenius norm is 2 sqrt(2) sin(angle / 2), at most sqrt(2) times the angle.
    const Eigen::Map<const Eigen::Quaterniond> quaternion(object + 3);
    Eigen::Map<Eigen::Matrix3d>{out} = quaternion.toRotationMatrix() * M_SQRT1_2;
    out += 9;
  } else if (model_->object_kind() == ObjectJoint::planar) {
    out = std::copy_n(object + 2, 2, out);
  }
  for (int i = 0; i < parameter_count(); ++i) {
    const double value = x[model_->q_size() + i];
    if (parameters_[i].unit == ParameterUnit::angle) {
      *out++ = std::cos(value);
      *out++ = std::sin(value);
    } else {
      *out++ = value / parameter_scale(parameters_[i].unit, length_scale_);
    }
  }
}

void GraspSystem::slack(const double* x, double* out) const {
  for (const Bound& bound : bounds_) *out++ = (bound.limit - bound.sign * x[bound.at]) / bound.scale;
}

void GraspSystem::check_point(const double* x) const {
  if (model_->object_kind() == ObjectJoint::free_flyer) check_quaternion(x + model_->hand_q_size() + 3);
}

double GraspSystem::radius_limit() const { return kLargestAngularRadius; }

std::unique_ptr<System> GraspSystem::clone() const {
  auto copy = std::make_unique<GraspSystem>(*this);
  copy->model_ = std::make_shared<Model>(*model_);
  return copy;
}

void GraspSystem::contact_points(const double* x, ContactPoint* out) {
  model_->update(x, false);
  const double* w = x + model_->q_size();
  SideState hand, object;
  for (const Contact& contact : contacts_) {
    place_side(contact.hand, w, hand);
    place_side(contact.object, w, object);
    *out++ = {hand.point, object.point, hand.rotation * hand.local.m, object.rotation * object.local.m};
  }
}

int GraspSystem::object_dof() const { return object_v_size_; }

void GraspSystem::grasp_matrices(const double* x, Eigen::Ref<RowMatrix> J, Eigen::Ref<RowMatrix> Gt) {
  model_->update(x, true);
  J.setZero();
  Gt.setZero();
  const double* w = x + model_->q_size();
  const Eigen::Vector3d origin = model_->placement(model_->object_joint()).translation;
  SideState hand, object;
  Eigen::Index row = 0;
  for (const Contact& contact : contacts_) {
    place_side(contact.hand, w, hand);
    place_side(contact.object, w, object);
    for (int v : model_->support(contact.hand.joint)) {
      const Eigen::Map<const Eigen::Vector3d> linear(model_->velocity(v)), angular(model_->velocity(v) + 3);
      const Eigen::Vector3d moved = linear + angular.cross(hand.point);
      for (Eigen::Index d = 0; d < drives_.cols(); ++d) J.block<3, 1>(row, d) += drives_(v, d) * moved;
    }
    const Eigen::Vector3d arm = object.point - origin;
    if (model_->object_kind() == ObjectJoint::free_flyer) {
      Gt.block<3, 3>(row, 0).setIdentity();
      for (int axis = 0; axis < 3; ++axis) Gt.block<3, 1>(row, 3 + axis) = Eigen::Vector3d::Unit(axis).cross(arm);
    } else {
      Gt(row, 0) = Gt(row + 1, 1) = 1.0;
      Gt.block<3, 1>(row, 2) = Eigen::Vector3d::UnitZ().cross(arm);
    }
    row += 3;
  }
}

}  // namespace graspatlas
