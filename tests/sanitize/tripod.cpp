#include "tripod.hpp"

#include <Eigen/Geometry>
#include <Eigen/QR>
#include <array>

#include "strain.hpp"

namespace strain {

using namespace graspatlas;

namespace {

constexpr std::array<double, 9> kBent = {0.1, -0.6, -0.5, 2.0, -0.7, -0.6, -2.1, -0.8, -0.4};

// The patch, and its placement on the object, such that at (u, v) it touches a point with its normal.
template <class Make>
ContactSide side_on_object(int joint, const Eigen::Vector3d& point, const Eigen::Vector3d& normal, double u, double v,
                           Make make) {
  PatchPoint local;
  make(Placement{})->evaluate(u, v, local);
  Eigen::Matrix3d from, to;
  from << local.m, local.a, local.m.cross(local.a);
  const Eigen::Vector3d tangent = normal.unitOrthogonal();
  to << normal, tangent, normal.cross(tangent);
  Placement placement;
  placement.rotation = to * from.transpose();
  placement.translation = point - placement.rotation * local.o;
  return {joint, {}, make(placement), {true, u, false, u - 1.0, u + 1.0}, {true, v, false, v - 0.02, v + 0.02}};
}

}  // namespace

std::string hand_urdf(const std::string& kind) {
  const char* roots[] = {"0.06 0 0", "-0.03 0.05 0", "-0.03 -0.05 0"};
  const char* axes[] = {"0 0 1", "0 1 0", "0.3 1 0.2"};
  std::string text = "<robot name='tripod'><link name='palm'/>";
  for (int finger = 0; finger < 3; ++finger) {
    std::string parent = "palm", xyz = roots[finger];
    for (int joint = 0; joint < 4; ++joint) {
      const std::string name = std::string(1, static_cast<char>('a' + finger)) + std::to_string(joint);
      text += "<link name='l" + name + "'/><joint name='" + name + "' type='" + (joint == 3 ? "fixed" : kind) +
              "'><origin xyz='" + xyz + "'/><parent link='" + parent + "'/><child link='l" + name + "'/>";
      if (joint < 3) text += std::string("<axis xyz='") + axes[joint] + "'/>";
      text += "<limit lower='-3' upper='3' effort='1' velocity='1'/></joint>";
      parent = "l" + name;
      xyz = "0.05 0 0";
    }
  }
  return text + "</robot>";
}

Tripod tripod(int kept, double length_scale) {
  auto model = std::make_shared<Model>(hand_urdf("revolute"), ObjectJoint::free_flyer);
  std::vector<double> x1(kBent.begin(), kBent.end());
  x1.insert(x1.end(), {0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0});
  model->update(x1.data(), false);
  std::vector<Contact> contacts;
  for (const FrameInfo& frame : model->hand_frames()) {
    if (frame.name.back() != '3') continue;
    const Placement& joint = model->placement(frame.joint);
    const Eigen::Vector3d point = joint.rotation * frame.placement.translation + joint.translation;
    const Eigen::Vector3d normal(0.0, 0.0, 1.0);
    Placement tip;
    tip.rotation.col(1) = joint.rotation.transpose() * normal;
    tip.rotation.col(0) = tip.rotation.col(1).unitOrthogonal();
    tip.rotation.col(2) = tip.rotation.col(0).cross(tip.rotation.col(1));
    tip.translation = frame.placement.translation;
    const ContactSide hand = {frame.joint, tip, std::make_shared<PlanePatch>(Placement{}), {}, {}};
    const int object = model->object_joint_index();
    const auto plane = [](const Placement& at) { return std::make_shared<PlanePatch>(at); };
    const auto turned = [&](const Placement& at) {
      Eigen::Matrix<double, Eigen::Dynamic, 4> outline(2, 4);
      outline << 0.03, 0.1, 0.0, 0.0, 0.031, 0.1, -1.0, 0.0;
      return std::make_shared<RevolutionPatch>(at, std::vector<double>{0.0, 0.01, 0.03}, outline);
    };
    if (contacts.empty())
      contacts.push_back({hand, side_on_object(object, point, -normal, 0.0, 0.0, plane)});
    else
      contacts.push_back({hand, side_on_object(object, point, -normal, 0.3, 0.012, turned)});
    for (const PatchParameter* w : {&contacts.back().object.u, &contacts.back().object.v}) x1.push_back(w->value);
  }
  Random random(11);
  Matrix motions(9, 9);
  for (Eigen::Index i = 0; i < motions.size(); ++i) motions(i) = random.normal();
  motions = Eigen::HouseholderQR<Matrix>(motions).householderQ() * Matrix::Identity(9, kept);
  if (kept == 9) motions.setIdentity();
  const auto lower = model->lower_limits(), upper = model->upper_limits();
  const GraspParts parts{model, contacts, motions, length_scale, lower, upper, Matrix::Identity(9, 9)};
  return {std::make_shared<GraspSystem>(parts), x1};
}

}  // namespace strain
