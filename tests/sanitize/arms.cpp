#include <Eigen/Geometry>
#include <limits>
#include <memory>

#include "graspatlas/reach/reach_batch.hpp"
#include "strain.hpp"

namespace strain {

namespace {

using namespace graspatlas;

// Seven joints: the first slides, the second turns without limits; then a finger of one joint, of the hand.
std::string tree(bool with_finger) {
  const char* axes[] = {"0 0 1", "0 0 1", "0 1 0", "1 0 0", "0 0 1", "0 1 0", "1 0 0"};
  std::string text = "<robot name='arm'><link name='l0'/>";
  for (int i = 0; i < 7; ++i) {
    const std::string kind = i == 0 ? "prismatic" : i == 1 ? "continuous" : "revolute";
    text += "<link name='l" + std::to_string(i + 1) + "'/><joint name='j" + std::to_string(i) + "' type='" + kind +
            "'><parent link='l" + std::to_string(i) + "'/><child link='l" + std::to_string(i + 1) +
            "'/><origin xyz='0.15 0 0'/><axis xyz='" + axes[i] + "'/><limit lower='-0.3' upper='" +
            (i == 0 ? "0.3" : "7") + "' effort='1' velocity='1'/></joint>";
  }
  if (with_finger)
    text +=
        "<link name='tip'/><joint name='z' type='revolute'><parent link='l7'/><child link='tip'/><origin xyz='0.05 0 "
        "0'/>"
        "<axis xyz='0 1 0'/><limit lower='-1' upper='1' effort='1' velocity='1'/></joint>";
  return text + "</robot>";
}

constexpr int kArm = 8, kHand = 1;  // numbers of their configurations: the turning joint has two

// A ball on each joint, and one that stands in the way; arm and hand share the scene.
ReachScene parts() {
  const Model arm(tree(false), ObjectJoint::none), both(tree(true), ObjectJoint::none);
  std::vector<CollisionShape> shapes(both.joint_count() + 1);
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    shapes[i].name = "ball" + std::to_string(i);
    shapes[i].joint = i + 1 < shapes.size() ? static_cast<int>(i) : 0;
    shapes[i].sizes = {0.03, 0.0, 0.0};
  }
  shapes.back().sizes[0] = 0.2;
  shapes.back().placement.translation = {0.5, 0.2, 0.0};
  std::vector<CollisionPair> pairs;
  for (int i = 1; i + 1 < static_cast<int>(shapes.size()); ++i)
    pairs.push_back({i, static_cast<int>(shapes.size()) - 1, 0.0});
  std::vector<double> lower = arm.lower_limits(), upper = arm.upper_limits();
  std::vector<int> arm_at(kArm), hand_at = {kArm};
  for (int i = 0; i < kArm; ++i) arm_at[i] = i;
  return {{arm, 7, {Eigen::Matrix3d::Identity(), {0.1, 0.0, 0.0}}, lower, upper},
          std::make_shared<const CollisionScene>(both, shapes, pairs),
          arm_at,
          hand_at,
          24,
          300};
}

struct Answers {
  std::vector<double> Q;
  std::vector<ReachStatus> statuses;
};

Answers answers_of(ReachBatch& batch, int threads, const std::vector<Placement>& targets) {
  const auto count = static_cast<std::int64_t>(targets.size());
  std::vector<double> H(targets.size(), 0.2), Q(targets.size() * kArm);
  std::vector<Reached> reached(targets.size());
  batch.solve(threads, targets.data(), H.data(), count, Q.data(), reached.data(), [] { return true; });
  Answers out{Q, {}};
  for (const Reached& one : reached) {
    out.statuses.push_back(one.status);
    require((one.pair >= 0) == (one.status == ReachStatus::hits), "a pair is named where something is hit");
  }
  return out;
}

// Where random postures have the frame, and a placement far away.
std::vector<Placement> targets_of(InverseKinematics& arm, int count) {
  Random random(3);
  std::vector<Placement> targets;
  std::vector<double> q(kArm);
  for (int i = 0; i < count; ++i) {
    for (const InverseKinematics::Axis& axis : arm.axes()) {
      const double angle = axis.slides ? random.uniform(axis.lower, axis.upper) : random.uniform(-0.3, 3.0);
      q[axis.q] = axis.turns_round ? std::cos(angle) : angle;
      if (axis.turns_round) q[axis.q + 1] = std::sin(angle);
    }
    targets.push_back(arm.place(q.data()));
  }
  targets.push_back({Eigen::Matrix3d::Identity(), {5.0, 0.0, 0.0}});
  return targets;
}

void many_threads() {
  ReachBatch batch(parts());
  InverseKinematics arm(parts().arm);
  const std::vector<Placement> targets = targets_of(arm, 60);
  const Answers expected = answers_of(batch, 1, targets);
  int found = 0;
  for (std::size_t i = 0; i < targets.size(); ++i) {
    if (expected.statuses[i] != ReachStatus::found) continue;
    ++found;
    const Placement there = arm.place(&expected.Q[i * kArm]);
    require((there.translation - targets[i].translation).norm() < 1e-8, "the frame is where it has to be");
    require((there.rotation - targets[i].rotation).norm() < 1e-8, "the frame is turned as it has to be");
  }
  require(found > 20, "postures are found");
  require(expected.statuses.back() == ReachStatus::no_posture, "what is far away is not reached");
  std::vector<Answers> answers(3);
  together(3, [&](int user) { answers[user] = answers_of(batch, 2, targets); });
  for (const Answers& one : answers) {
    require(one.statuses == expected.statuses, "threads change no status");
    for (std::size_t i = 0; i < one.Q.size(); ++i)
      require(one.Q[i] == expected.Q[i] || (std::isnan(one.Q[i]) && std::isnan(expected.Q[i])),
              "threads change no posture");
  }
}

void wrong_parts() {
  const auto refused = [](auto change, const char* part) {
    ReachScene wrong = parts();
    change(wrong);
    refuse([&] { ReachBatch{wrong}; }, part);
  };
  const double infinity = std::numeric_limits<double>::infinity();
  refused([](ReachScene& scene) { scene.arm.joint = 0; }, "joint 0");
  refused([](ReachScene& scene) { scene.arm.joint = 8; }, "joint 8");
  refused([](ReachScene& scene) { scene.arm.lower.pop_back(); }, "limits");
  refused([](ReachScene& scene) { scene.arm.upper[5] = scene.arm.lower[5]; }, "has no range");
  refused([&](ReachScene& scene) { scene.arm.upper[0] = infinity; }, "slides without limits");
  refused([](ReachScene& scene) { scene.hand_at.clear(); }, "numbers");
  refused([](ReachScene& scene) { scene.arm_at[3] = 99; }, "no place");
  refused([](ReachScene& scene) { scene.seeds = 0; }, "start");
  refused([](ReachScene& scene) { scene.postures = 0; }, "posture");
}

}  // namespace

void arms() {
  wrong_parts();
  many_threads();
}

}  // namespace strain
