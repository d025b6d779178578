#include <limits>

#include "graspatlas/atlas/atlas.hpp"
#include "graspatlas/grasp/grasp_system.hpp"
#include "graspatlas/manifold/lease.hpp"
#include "graspatlas/quality/force_closure.hpp"
#include "graspatlas/quality/holding_force.hpp"
#include "graspatlas/quality/manipulability.hpp"
#include "strain.hpp"
#include "tripod.hpp"

namespace strain {

namespace {

using namespace graspatlas;

// Central differences of the residual against the Jacobian.
void check_jacobian(GraspSystem& system, const double* x) {
  const int n = system.tangent_size(), e = system.equation_count();
  std::vector<double> R(e), J(static_cast<std::size_t>(e) * n), ahead(e), behind(e), v(n),
      moved(system.configuration_size());
  system.linearize(x, R.data(), J.data());
  const double step = 1e-6;
  for (int c = 0; c < n; ++c) {
    std::fill(v.begin(), v.end(), 0.0);
    v[c] = step;
    system.integrate(x, v.data(), moved.data());
    system.residual(moved.data(), ahead.data());
    v[c] = -step;
    system.integrate(x, v.data(), moved.data());
    system.residual(moved.data(), behind.data());
    for (int i = 0; i < e; ++i)
      require(std::abs((ahead[i] - behind[i]) / (2.0 * step) - J[static_cast<std::size_t>(i) * n + c]) < 1e-4,
              "the Jacobian is the derivative of the residual");
  }
}

HoldingLimits holding(const GraspSystem& system, double torsional, double effort, double torque_length) {
  const Vector efforts = Vector::Constant(effort > 0.0 ? system.actuated_count() : 0, effort);
  return {0.5, torsional, 10.0, efforts, {0.001, 0.002, -0.003}, torque_length, 0.02};
}

void trace(int kept, double radius, std::int64_t limit) {
  const Tripod made = tripod(kept, 0.01);
  GraspSystem& system = *made.system;
  check_jacobian(system, made.x1.data());
  AtlasOptions options;
  options.radius = radius;
  options.epsilon = 0.5;
  Atlas atlas(system, made.x1.data(), options);
  atlas.expand(limit, 5.0);
  require(atlas.count() > 10, "the atlas of a made-up grasp grows");
  Manipulability manipulability(system, 1e-3);
  ForceClosure closure(system, 0.5, 0.0), soft(system, 0.5, 0.005);
  HoldingForce hard_force(system, holding(system, 0.0, 0.0, 0.0)), soft_force(system, holding(system, 0.005, 0.0, 0.0)),
      weak_force(system, holding(system, 0.0, 0.1, 0.0)), twisted(system, holding(system, 0.0, 0.0, 0.05));
  const double down[] = {0.0, 0.0, -1.0};
  std::vector<double> axes(system.object_dof()), R(system.equation_count());
  for (std::int64_t i = 0; i < atlas.count(); ++i) {
    system.residual(atlas.center(i), R.data());
    for (double r : R) require(std::abs(r) < 1e-9, "centres fulfil the contacts");
    manipulability.semi_axes(atlas.center(i), axes.data());
    for (double axis : axes) require(std::isfinite(axis) && axis >= 0.0, "semi-axes are numbers");
    const double margin = closure.margin(atlas.center(i));
    require(std::isfinite(margin) && margin >= 0.0, "margins are numbers");
    require(soft.margin(atlas.center(i)) >= margin - 1e-9, "soft fingers hold no worse");
    const double force = hard_force.largest(atlas.center(i));
    require((force > 0.0) == (margin > 0.0), "closed grasps hold something, others nothing");
    require(weak_force.largest(atlas.center(i)) <= force * 1.03 + 1e-9, "efforts add no force");
    require(soft_force.largest(atlas.center(i)) >= force * 0.97 - 1e-9, "soft fingers withstand no less");
    const double along = hard_force.along(atlas.center(i), down);
    require(!(along < force * 0.97), "what is withstood from all sides is along one");
    if (i % 10 == 0) require(twisted.largest(atlas.center(i)) <= force * 1.03 + 1e-9, "torques are no help");
  }
}

// Patches far outside their outline, on the axis and with absurd numbers give numbers, or none, but no fault.
void strange_patches() {
  Random random(3);
  Eigen::Matrix<double, Eigen::Dynamic, 4> cone(1, 4);
  cone << 0.0, 1.0, 0.0, 0.0;  // the apex is at v = 0
  const RevolutionPatch apex(Placement{}, {0.0, 1.0}, cone);
  Eigen::Matrix<double, Eigen::Dynamic, 4> wavy(3, 4);
  wavy << 1.0, 0.0, -1.0, 0.5, 1.0, 2.0, 0.0, -3.0, 0.5, -1.0, 4.0, 0.0;
  const RevolutionPatch pieces(Placement{}, {-1.0, 0.0, 0.5, 2.0}, wavy);
  const PlanePatch plane{Placement{}};
  PatchPoint p;
  const double huge = std::numeric_limits<double>::max(), infinity = std::numeric_limits<double>::infinity();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const Patch* patch :
       {static_cast<const Patch*>(&apex), static_cast<const Patch*>(&pieces), static_cast<const Patch*>(&plane)}) {
    for (int i = 0; i < 2000; ++i) patch->evaluate(random.uniform(-10, 10), random.uniform(-3, 3), p);
    for (double u : {0.0, 1e-310, huge, -huge, infinity, nan})
      for (double v : {0.0, -1.0, 0.5, 2.0, 1e-310, huge, -huge, infinity, nan}) patch->evaluate(u, v, p);
  }
  using Outline = Eigen::Matrix<double, Eigen::Dynamic, 4>;
  refuse([] { RevolutionPatch({}, {0.0, 1.0}, Outline(0, 4)); }, "pieces");
  refuse([] { RevolutionPatch({}, {0.0}, Outline::Zero(1, 4)); }, "breaks");
  refuse([] { RevolutionPatch({}, {1.0, 0.0}, Outline::Zero(1, 4)); }, "ascend");
  refuse([] { RevolutionPatch({}, {0.0, std::nan("")}, Outline::Zero(1, 4)); }, "ascend");
}

void wrong_systems() {
  for (const char* urdf : {"", "<", "<robot", "<robot name='r'/>", "<robot name='r'><link name='a'/></robot>"})
    refuse([&] { Model(urdf, ObjectJoint::none); }, "URDF");
  for (const char* kind : {"floating", "planar"}) Model(hand_urdf(kind), ObjectJoint::planar);
  auto model = std::make_shared<Model>(hand_urdf("revolute"), ObjectJoint::free_flyer);
  const auto lower = model->lower_limits(), upper = model->upper_limits();
  const Matrix all = Matrix::Identity(9, 9);
  const GraspParts sound{model, {}, all, 0.01, lower, upper, all};
  const auto refuse_with = [&](const char* message, const auto& spoil) {
    GraspParts parts = sound;
    spoil(parts);
    refuse([&] { GraspSystem{parts}; }, message);
  };
  refuse_with("rows", [](GraspParts& parts) { parts.motions = Matrix::Identity(8, 8); });
  refuse_with("transmission", [](GraspParts& parts) { parts.transmission = Matrix::Identity(8, 8); });
  refuse_with("length_scale", [](GraspParts& parts) { parts.length_scale = 0.0; });
  refuse_with("limits", [](GraspParts& parts) { parts.lower = {0.0}; });
  refuse_with("limits", [](GraspParts& parts) { std::swap(parts.lower, parts.upper); });
  const ContactSide nowhere = {99, {}, std::make_shared<PlanePatch>(Placement{}), {}, {}};
  refuse_with("joint 99", [&](GraspParts& parts) { parts.contacts = {{nowhere, nowhere}}; });
  GraspSystem free(sound);
  refuse([&] { Manipulability(free, 1e-3); }, "contact");
  refuse([&] { ForceClosure(free, 0.5, 0.0); }, "contact");
  const Tripod made = tripod(9, 0.01);
  refuse([&] { Manipulability(*made.system, 0.0); }, "length_unit");
  refuse([&] { ForceClosure(*made.system, -1.0, 0.0); }, "friction");
  refuse([&] { ForceClosure(*made.system, 0.5, -1.0); }, "torsional");
  const auto refuse_limits = [&](const char* message, const auto& spoil) {
    HoldingLimits limits = holding(*made.system, 0.0, 0.1, 0.0);
    spoil(limits);
    refuse([&] { HoldingForce{*made.system, limits}; }, message);
  };
  refuse_limits("friction", [](HoldingLimits& limits) { limits.friction = 0.0; });
  refuse_limits("efforts", [](HoldingLimits& limits) { limits.efforts = Vector::Ones(2); });
  refuse_limits("efforts", [](HoldingLimits& limits) { limits.efforts(1) = std::nan(""); });
  refuse_limits("normal_force", [](HoldingLimits& limits) { limits.normal_force = 0.0; });
  refuse_limits("torque_length", [](HoldingLimits& limits) { limits.torque_length = -1.0; });
  refuse_limits("gap", [](HoldingLimits& limits) { limits.gap = 0.0; });
}

// Grasps that no manifold has: qualities of arbitrary postures, contacts that miss, all fingers straight.
void arbitrary_grasps() {
  const Tripod made = tripod(9, 0.01);
  Manipulability manipulability(*made.system, 1e-3);
  std::vector<double> axes(made.system->object_dof());
  Random random(5);
  for (int i = 0; i < 200; ++i) {
    std::vector<double> x = made.x1;
    const double size = std::pow(10.0, random.uniform(-3.0, 3.0));
    for (int c = 0; c < 12; ++c) x[c] = i == 0 ? 0.0 : x[c] + size * random.normal();
    manipulability.semi_axes(x.data(), axes.data());
    const double friction = std::pow(10.0, random.uniform(-6.0, 6.0));
    for (const double torsional : {0.0, 0.01 * friction}) {
      ForceClosure(*made.system, friction, torsional).margin(x.data());
      HoldingLimits limits = holding(*made.system, torsional, i % 2 == 0 ? 0.1 : 0.0, 0.0);
      limits.friction = friction;
      const double force = HoldingForce(*made.system, limits).largest(x.data());
      require(std::isfinite(force) && force >= 0.0, "holding forces are numbers");
    }
  }
}

// What a user reads off one system that others use too.
std::vector<double> read_grasps(GraspSystem& shared, const std::vector<double>& x1) {
  const Lease own(shared);
  Manipulability manipulability(*own, 1e-3);
  ForceClosure closure(*own, 0.5, 0.005);
  std::vector<double> out, x(x1.size()), v(shared.tangent_size()), R(shared.equation_count()), J(R.size() * v.size()),
      axes(shared.object_dof());
  Random random(23);
  for (int i = 0; i < 20; ++i) {
    for (double& c : v) c = 0.1 * random.normal();
    shared.integrate(x1.data(), v.data(), x.data());
    shared.difference(x1.data(), x.data(), v.data());
    own->linearize(x.data(), R.data(), J.data());
    manipulability.semi_axes(x.data(), axes.data());
    for (const auto* numbers : {&x, &v, &R, &J, &axes}) out.insert(out.end(), numbers->begin(), numbers->end());
    out.push_back(closure.margin(x.data()));
  }
  return out;
}

std::vector<double> grow(GraspSystem& system, const std::vector<double>& x1, int threads) {
  AtlasOptions options;
  options.radius = 0.3;
  options.epsilon = 0.5;
  Atlas atlas(system, x1.data(), options, threads);
  atlas.expand(60, 1e9);
  std::vector<double> out;
  for (std::int64_t i = 0; i < atlas.count(); ++i)
    out.insert(out.end(), atlas.center(i), atlas.center(i) + system.configuration_size());
  return out;
}

// Several users of one system, and some who read URDFs that are wrong.
void many_users() {
  const Tripod made = tripod(4, 0.01);
  const std::vector<double> grasps = read_grasps(*made.system, made.x1), atlas = grow(*made.system, made.x1, 1);
  together(6, [&](int user) {
    if (user % 3 == 0) {
      require(read_grasps(*made.system, made.x1) == grasps, "grasps are those that one user reads, to the bit");
    } else if (user % 3 == 1) {
      require(grow(*made.system, made.x1, user) == atlas, "atlases are those of one user, to the bit");
    } else {
      for (int i = 0; i < 20; ++i) refuse([] { Model("<robot", ObjectJoint::none); }, "URDF");
    }
  });
}

}  // namespace

void grasps() {
  strange_patches();
  wrong_systems();
  trace(5, 0.2, 200);
  trace(4, 0.3, 100);
  trace(9, 0.5, 30);
  arbitrary_grasps();
  many_users();
}

}  // namespace strain
