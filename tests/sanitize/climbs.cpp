#include <cmath>
#include <memory>

#include "graspatlas/climb/climb_batch.hpp"
#include "graspatlas/climb/holding_measures.hpp"
#include "graspatlas/climb/index_measures.hpp"
#include "graspatlas/climb/requirement_measures.hpp"
#include "graspatlas/climb/wrench_measures.hpp"
#include "graspatlas/manifold/far_projection.hpp"
#include "strain.hpp"
#include "tripod.hpp"

namespace strain {

namespace {

using namespace graspatlas;

constexpr std::int64_t kStarts = 2;

// Grasps around the first one, some far away: many miss what is required of them.
std::vector<double> starts(GraspSystem& system, const std::vector<double>& x1) {
  Random random(29);
  FarProjection projection(system);
  std::vector<double> X, x(x1.size()), v(system.tangent_size());
  while (static_cast<std::int64_t>(X.size()) < kStarts * system.configuration_size()) {
    for (double& c : v) c = 0.4 * random.normal();
    system.integrate(x1.data(), v.data(), x.data());
    if (projection.project(x.data())) X.insert(X.end(), x.begin(), x.end());
  }
  return X;
}

// A ball at each fingertip, and one in the object; the fingers keep apart.
std::shared_ptr<const CollisionScene> scene(const GraspSystem& system) {
  std::vector<CollisionShape> shapes;
  std::vector<CollisionPair> pairs;
  for (const FrameInfo& frame : system.model().hand_frames()) {
    if (frame.name.back() != '3') continue;
    CollisionShape shape;
    shape.name = frame.name;
    shape.sizes = {0.004, 0.0, 0.0};
    shape.joint = frame.joint;
    shape.placement = frame.placement;
    shapes.push_back(shape);
  }
  shapes.push_back(shapes.back());
  shapes.back().name = "object";
  shapes.back().joint = system.model().object_joint_index();
  const int count = static_cast<int>(shapes.size());
  for (int first = 0; first < count; ++first)
    for (int second = first + 1; second < count; ++second)
      pairs.push_back({first, second, second + 1 < count ? 0.001 : -0.002});
  return std::make_shared<CollisionScene>(system.model(), shapes, pairs);
}

template <class M, class... Arguments>
MeasureRecipe recipe(Arguments... arguments) {
  return {[=](GraspSystem& system) { return std::make_unique<M>(system, arguments...); }};
}

void climb_on(const MeasureRecipe& index, const std::vector<MeasureRecipe>& requirements, const char* name) {
  const Tripod made = tripod(6, 0.01);
  GraspSystem& system = *made.system;
  const std::vector<double> X = starts(system, made.x1);
  const auto ends_on = [&](int threads) {
    return climb_all(system, X.data(), kStarts, index, requirements, {0.1, 40}, threads, [] { return true; });
  };
  const std::vector<ClimbEnd> ends = ends_on(1), again = ends_on(3);
  std::vector<double> R(system.equation_count());
  for (std::size_t i = 0; i < ends.size(); ++i) {
    require(ends[i].x == again[i].x && ends[i].values == again[i].values, "climbs end alike on any number of threads");
    system.residual(ends[i].x.data(), R.data());
    for (const double r : R) require(std::abs(r) < 1e-8, std::string("climbs stay on the manifold: ") + name);
    if (ends[i].status != ClimbStatus::converged) continue;
    require(ends[i].kkt < Climber::kConverged, "what has converged has no slope left");
    require(ends[i].missed == 0.0, "what has converged meets the requirements");
  }
}

}  // namespace

void climbs() {
  const Tripod made = tripod(6, 0.01);
  const HoldingLimits limits{0.5, 0.0, 10.0, Vector(), {0.0, 0.0, 0.0}, 0.0, 1e-5};
  const MeasureRecipe volume = recipe<AxesMeasure>(AxesIndex::volume, 6, 1e-3);
  const MeasureRecipe closure = recipe<ClosureMeasure>(0.5, 0.0, 0.02), margin = recipe<JointMarginMeasure>(0.05);
  const auto shapes = scene(*made.system);
  const MeasureRecipe distances{
      [shapes](GraspSystem& system) { return std::make_unique<DistancesMeasure>(shapes, system.length_scale()); }};
  climb_on(volume, {}, "volume");
  climb_on(volume, {closure, margin, distances}, "volume with requirements");
  climb_on(closure, {}, "closure");
  climb_on(recipe<HoldingIndex>(limits), {distances}, "holding force");
  climb_on(volume, {recipe<HoldingMeasure>(limits, 0.5)}, "volume with a holding force");
  climb_on(recipe<EpsilonMeasure<6>>(Pyramids{0.5, 8, 0.0, 0.05}), {}, "epsilon");
  const std::vector<double> X = starts(*made.system, made.x1);
  int asked = 0;
  const auto ends =
      climb_all(*made.system, X.data(), kStarts, volume, {closure}, {0.1, 40}, 1, [&asked] { return ++asked < 25; });
  require(ends.back().status == ClimbStatus::given_up, "climbs that are told to stop are given up");
}

}  // namespace strain
