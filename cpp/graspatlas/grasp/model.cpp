#include "graspatlas/grasp/model.hpp"

#include <console_bridge/console.h>

#include <algorithm>
#include <cmath>
#include <mutex>
#include <pinocchio/algorithm/jacobian.hpp>
#include <pinocchio/algorithm/joint-configuration.hpp>
#include <pinocchio/algorithm/kinematics.hpp>
#include <pinocchio/multibody.hpp>
#include <pinocchio/parsers/urdf.hpp>
#include <set>

#include "graspatlas/errors.hpp"

namespace graspatlas {

namespace {

// A tree is taken for a model when at this many configurations its numbers differ from Pinocchio's by less [m, or
// none].
constexpr int kCompared = 3;
constexpr double kSame = 1e-9;

/// Pinocchio's joints for the object, and the spaces of their configurations.
struct FreeFlyer {
  using Joint = pinocchio::JointModelFreeFlyer;
  using Space = pinocchio::SpecialEuclideanOperationTpl<3, double, 0>;
  static constexpr int q_size = 7, v_size = 6;
};
struct Planar {
  using Joint = pinocchio::JointModelPlanar;
  using Space = pinocchio::SpecialEuclideanOperationTpl<2, double, 0>;
  static constexpr int q_size = 4, v_size = 3;
};

/// visit(FreeFlyer()) or visit(Planar()), or nothing without an object.
template <class Visit>
void visit_joint(const ObjectJoint& joint, const Visit& visit) {
  switch (joint.kind()) {
    case ObjectJoint::Kind::free_flyer:
      return visit(FreeFlyer());
    case ObjectJoint::Kind::planar:
      return visit(Planar());
    case ObjectJoint::Kind::none:
      return;
  }
}

template <int n>
using Numbers = Eigen::Map<Eigen::Matrix<double, n, 1>>;
template <int n>
using ConstNumbers = Eigen::Map<const Eigen::Matrix<double, n, 1>>;

std::vector<double> to_std(const Eigen::VectorXd& v) { return {v.data(), v.data() + v.size()}; }

/// Collects what the URDF parser would print, for the message of our error. There is one at a time: the parser has one
/// place for it in the whole process.
class ParserMessages : public console_bridge::OutputHandler {
 public:
  ParserMessages() : alone_(parsing()) { console_bridge::useOutputHandler(this); }
  ~ParserMessages() override { console_bridge::restorePreviousOutputHandler(); }
  void log(const std::string& text, console_bridge::LogLevel level, const char*, int) override {
    if (level < console_bridge::CONSOLE_BRIDGE_LOG_ERROR) return;
    if (!text_.empty()) text_ += "; ";
    text_ += text;
  }
  const std::string& text() const { return text_; }

 private:
  static std::mutex& parsing() {
    static std::mutex mutex;
    return mutex;
  }

  const std::lock_guard<std::mutex> alone_;
  std::string text_;
};

pinocchio::Model build_model(const std::string& urdf) {
  pinocchio::Model model;
  ParserMessages messages;
  try {
    pinocchio::urdf::buildModelFromXML(urdf, model);
  } catch (const std::exception& error) {
    const std::string reason = messages.text().empty() ? error.what() : messages.text();
    throw Error("its URDF cannot be read: " + reason);
  }
  if (model.nv == 0) throw Error("its URDF has no joint that moves");
  return model;
}

// A zero axis gives a joint that goes nowhere, or numbers that are none.
void check_axes(const pinocchio::Model& model) {
  pinocchio::Data data(model);
  pinocchio::computeJointJacobians(model, data, pinocchio::neutral(model));
  for (pinocchio::JointIndex j = 1; j < static_cast<pinocchio::JointIndex>(model.njoints); ++j)
    for (int v = 0; v < model.nvs[j]; ++v)
      if (!(data.J.col(model.idx_vs[j] + v).norm() > 1e-9) || !data.J.col(model.idx_vs[j] + v).allFinite())
        throw Error("joint '" + model.names[j] + "' of its URDF has no valid axis");
}

// The joints of a hand; none where one has other than one degree of freedom. A joint that neither turns nor slides, but
// does both, is taken for one that turns.
std::vector<AxisJoint> axis_joints(const pinocchio::Model& model, int joint_count) {
  pinocchio::Data data(model);
  pinocchio::computeJointJacobians(model, data, pinocchio::neutral(model));
  std::vector<AxisJoint> joints;
  for (pinocchio::JointIndex j = 1; j <= static_cast<pinocchio::JointIndex>(joint_count); ++j) {
    if (model.nvs[j] != 1 || model.idx_vs[j] != static_cast<int>(j) - 1) return {};
    const auto parent = model.parents[j];
    const pinocchio::SE3 at_zero = data.oMi[parent].actInv(data.oMi[j]);
    const Eigen::Vector3d linear = data.J.col(model.idx_vs[j]).head<3>(),
                          angular = data.J.col(model.idx_vs[j]).tail<3>();
    const bool turns = angular.norm() > 0.5;
    joints.push_back({static_cast<int>(parent),
                      turns,
                      model.idx_qs[j],
                      model.nqs[j] == 2,
                      {at_zero.rotation(), at_zero.translation()},
                      data.oMi[parent].rotation().transpose() * (turns ? angular : linear)});
  }
  return joints;
}

// Configurations far from each other, all joints turned by some part of a radian.
Eigen::VectorXd some_configuration(const pinocchio::Model& model, int number) {
  Eigen::VectorXd v(model.nv);
  for (int i = 0; i < model.nv; ++i) v[i] = std::sin(1.0 + 2.0 * i + 5.0 * number);
  return pinocchio::integrate(model, pinocchio::neutral(model), v);
}

}  // namespace

struct Model::Pinocchio {
  pinocchio::Model model;
  pinocchio::Data data;
};

Model::Model(const std::string& urdf, const ObjectJoint& object)
    : pinocchio_(new Pinocchio), urdf_(std::make_shared<std::string>(urdf)), object_joint_(object) {
  pinocchio::Model& model = pinocchio_->model;
  model = build_model(urdf);
  check_axes(model);
  hand_q_size_ = model.nq;
  hand_v_size_ = model.nv;
  for (pinocchio::JointIndex j = 1; j < static_cast<pinocchio::JointIndex>(model.njoints); ++j) {
    const std::string kind = model.joints[j].shortname();
    const bool prismatic = kind.find("Prismatic") != std::string::npos || kind.rfind("JointModelP", 0) == 0;
    hand_joints_.push_back(
        {model.names[j], model.idx_qs[j], model.nqs[j], model.idx_vs[j], model.nvs[j], prismatic && model.nqs[j] == 1});
    if (model.nqs[j] != model.nvs[j]) hand_is_euclidean_ = false;
  }
  for (const pinocchio::Frame& frame : model.frames) {
    if (frame.type != pinocchio::BODY && frame.type != pinocchio::OP_FRAME) continue;
    hand_frames_.push_back(
        {frame.name, static_cast<int>(frame.parentJoint), {frame.placement.rotation(), frame.placement.translation()}});
  }
  visit_joint(object, [&](auto kind) {
    const typename decltype(kind)::Joint joint;
    object_joint_index_ = static_cast<int>(model.addJoint(0, joint, pinocchio::SE3::Identity(), "object"));
  });
  pinocchio_->data = pinocchio::Data(model);
  placements_.resize(model.njoints);
  velocities_.resize(6 * static_cast<std::size_t>(model.nv));
  supports_.resize(model.njoints);
  for (std::size_t j = 0; j < supports_.size(); ++j)
    for (const auto ancestor : model.supports[j])
      for (int v = 0; v < model.nvs[ancestor]; ++v) supports_[j].push_back(model.idx_vs[ancestor] + v);
  for (int j = 1; j < model.njoints; ++j) all_joints_.push_back(j);
  make_tree();
}

// Takes the tree where it says what Pinocchio says.
void Model::make_tree() {
  const pinocchio::Model& model = pinocchio_->model;
  const int hand_joints = static_cast<int>(hand_joints_.size());
  const std::vector<AxisJoint> joints = axis_joints(model, hand_joints);
  if (static_cast<int>(joints.size()) != hand_joints) return;
  tree_ = JointTree(joints, object_joint_, hand_q_size_);
  has_tree_ = true;
  for (int number = 0; has_tree_ && number < kCompared; ++number) {
    const Eigen::VectorXd q = some_configuration(model, number);
    update(q.data(), true);
    const std::vector<Placement> placements = placements_;
    const std::vector<double> velocities = velocities_;
    update_with_pinocchio(q.data(), true);
    for (std::size_t j = 0; j < placements.size(); ++j)
      has_tree_ = has_tree_ && (placements[j].rotation - placements_[j].rotation).norm() < kSame &&
                  (placements[j].translation - placements_[j].translation).norm() < kSame;
    for (std::size_t i = 0; i < velocities.size(); ++i)
      has_tree_ = has_tree_ && std::abs(velocities[i] - velocities_[i]) < kSame;
  }
}

Model::Model(const Model& other)
    : pinocchio_(new Pinocchio(*other.pinocchio_)),
      urdf_(other.urdf_),
      hand_q_size_(other.hand_q_size_),
      hand_v_size_(other.hand_v_size_),
      object_joint_index_(other.object_joint_index_),
      object_joint_(other.object_joint_),
      hand_is_euclidean_(other.hand_is_euclidean_),
      hand_joints_(other.hand_joints_),
      hand_frames_(other.hand_frames_),
      placements_(other.placements_),
      velocities_(other.velocities_),
      supports_(other.supports_),
      all_joints_(other.all_joints_),
      tree_(other.tree_),
      has_tree_(other.has_tree_) {}

Model::~Model() = default;

int Model::q_size() const { return pinocchio_->model.nq; }
int Model::v_size() const { return pinocchio_->model.nv; }

std::vector<double> Model::lower_limits() const {
  return to_std(pinocchio_->model.lowerPositionLimit.head(hand_q_size_));
}
std::vector<double> Model::upper_limits() const {
  return to_std(pinocchio_->model.upperPositionLimit.head(hand_q_size_));
}
std::vector<double> Model::neutral() const { return to_std(pinocchio::neutral(pinocchio_->model)); }

void Model::integrate(const double* q, const double* v, double* out) const {
  if (!hand_is_euclidean_) {
    const Eigen::Map<const Eigen::VectorXd> q_map(q, q_size()), v_map(v, v_size());
    const Eigen::VectorXd result = pinocchio::integrate(pinocchio_->model, q_map, v_map);
    Eigen::Map<Eigen::VectorXd>(out, q_size()) = result;
    return;
  }
  for (int i = 0; i < hand_q_size_; ++i) out[i] = q[i] + v[i];
  const double *q_object = q + hand_q_size_, *v_object = v + hand_v_size_;
  visit_joint(object_joint_, [&](auto kind) {
    using Kind = decltype(kind);
    Eigen::Matrix<double, Kind::q_size, 1> moved;
    typename Kind::Space().integrate(ConstNumbers<Kind::q_size>(q_object), ConstNumbers<Kind::v_size>(v_object), moved);
    Numbers<Kind::q_size>(out + hand_q_size_) = moved;
  });
}

void Model::difference(const double* q0, const double* q1, double* out) const {
  if (!hand_is_euclidean_) {
    const Eigen::Map<const Eigen::VectorXd> a(q0, q_size()), b(q1, q_size());
    Eigen::Map<Eigen::VectorXd>(out, v_size()) = pinocchio::difference(pinocchio_->model, a, b);
    return;
  }
  for (int i = 0; i < hand_q_size_; ++i) out[i] = q1[i] - q0[i];
  const double *a = q0 + hand_q_size_, *b = q1 + hand_q_size_;
  visit_joint(object_joint_, [&](auto kind) {
    using Kind = decltype(kind);
    Numbers<Kind::v_size> d(out + hand_v_size_);
    typename Kind::Space().difference(ConstNumbers<Kind::q_size>(a), ConstNumbers<Kind::q_size>(b), d);
  });
}

void Model::update(const double* q, bool jacobians, const std::vector<int>& joints) {
  if (!has_tree_) return update_with_pinocchio(q, jacobians);
  tree_.place(q, joints, placements_.data());
  if (jacobians) tree_.move(joints, placements_.data(), velocities_.data());
}

std::vector<int> Model::carriers(const std::vector<int>& joints) const {
  std::set<int> all;
  for (const int joint : joints)
    for (const auto carrier : pinocchio_->model.supports[static_cast<std::size_t>(joint)])
      if (carrier > 0) all.insert(static_cast<int>(carrier));
  return {all.begin(), all.end()};
}

void Model::update_with_pinocchio(const double* q, bool jacobians) {
  const Eigen::Map<const Eigen::VectorXd> q_map(q, q_size());
  pinocchio::Data& data = pinocchio_->data;
  if (jacobians) {
    pinocchio::computeJointJacobians(pinocchio_->model, data, q_map);
    std::copy_n(data.J.data(), velocities_.size(), velocities_.data());
  } else {
    pinocchio::forwardKinematics(pinocchio_->model, data, q_map);
  }
  for (std::size_t j = 0; j < placements_.size(); ++j)
    placements_[j] = {data.oMi[j].rotation(), data.oMi[j].translation()};
}

}  // namespace graspatlas
