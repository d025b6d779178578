#include "graspatlas/collision/collision_scene.hpp"

#include <coal/BVH/BVH_model.h>
#include <coal/collision.h>
#include <coal/distance.h>
#include <coal/shape/convex.h>
#include <coal/shape/geometric_shapes.h>

#include <cmath>
#include <limits>

#include "graspatlas/collision/support_point.hpp"
#include "graspatlas/errors.hpp"
#include "graspatlas/parallel.hpp"

namespace graspatlas {

namespace {

using Vector3 = Eigen::Vector3d;

/// Radius of the ball that stands for a point [m].
constexpr double kDot = 1e-6;
/// Boxes and balls settle what is farther apart than this beyond what is required; coal settles the rest [m].
constexpr double kDoubt = 1e-6;
/// How exact distances from a hull are [m].
constexpr double kHullTolerance = 1e-8;

std::shared_ptr<coal::CollisionGeometry> convex_hull(const std::vector<Vector3>& points) {
  auto copy = std::make_shared<std::vector<coal::Vec3s>>(points.begin(), points.end());
  const std::shared_ptr<coal::CollisionGeometry> hull(
      coal::ConvexBase::convexHull(copy, static_cast<unsigned int>(copy->size()), true, "Qt"));
  hull->computeLocalAABB();
  return hull;
}

std::shared_ptr<coal::CollisionGeometry> triangle_mesh(const CollisionShape& shape) {
  std::vector<coal::Triangle> triangles;
  triangles.reserve(shape.triangles.size());
  for (const auto& corners : shape.triangles) {
    for (const int corner : corners)
      if (corner < 0 || corner >= static_cast<int>(shape.points.size()))
        throw Error("a triangle has corner " + std::to_string(corner) + ", but there are " +
                    std::to_string(shape.points.size()) + " points");
    triangles.emplace_back(corners[0], corners[1], corners[2]);
  }
  auto mesh = std::make_shared<coal::BVHModel<coal::OBBRSS>>();
  mesh->beginModel();
  mesh->addSubModel(std::vector<coal::Vec3s>(shape.points.begin(), shape.points.end()), triangles);
  mesh->endModel();
  return mesh;
}

std::shared_ptr<coal::CollisionGeometry> geometry_of(const CollisionShape& shape) {
  const std::string what = "collision shape '" + shape.name + "' ";
  const Vector3& s = shape.sizes;
  const int sizes = shape.kind == ShapeKind::sphere ? 1 : shape.kind == ShapeKind::box ? 3 : 2;
  const bool solid = shape.kind >= ShapeKind::convex;
  if (!solid && !(s.head(sizes).allFinite() && s.head(sizes).minCoeff() >= 0.0))
    throw Error(what + "must have finite sizes, none negative");
  for (const Vector3& point : shape.points)
    if (!point.allFinite()) throw Error(what + "must have finite points");
  switch (shape.kind) {
    case ShapeKind::sphere:
      return std::make_shared<coal::Sphere>(s[0]);
    case ShapeKind::capsule:
      return std::make_shared<coal::Capsule>(s[0], s[1]);
    case ShapeKind::cylinder:
      return std::make_shared<coal::Cylinder>(s[0], s[1]);
    case ShapeKind::box:
      return std::make_shared<coal::Box>(s[0], s[1], s[2]);
    case ShapeKind::convex:
      try {
        return convex_hull(shape.points);
      } catch (const std::exception& error) {
        throw Error(what + "of " + std::to_string(shape.points.size()) + " points has no convex hull: " + error.what());
      }
    case ShapeKind::half_space:
      return std::make_shared<coal::Halfspace>(Vector3::UnitZ(), 0.0);
    default:
      return triangle_mesh(shape);
  }
}

/// Radius of the ball about the middle of a shape's box that holds the shape.
double ball_radius(const CollisionShape& shape, const Vector3& center, const Vector3& half) {
  if (shape.points.empty()) {
    if (shape.kind == ShapeKind::sphere) return shape.sizes[0];
    if (shape.kind == ShapeKind::capsule) return shape.sizes[0] + 0.5 * shape.sizes[1];
    if (shape.kind == ShapeKind::cylinder) return std::hypot(shape.sizes[0], 0.5 * shape.sizes[1]);
    return half.norm();
  }
  double squared = 0.0;
  for (const Vector3& point : shape.points) squared = std::max(squared, (point - center).squaredNorm());
  return std::sqrt(squared);
}

coal::Transform3s transform_of(const Placement& placement) { return {placement.rotation, placement.translation}; }

}  // namespace

struct CollisionScene::Geometries {
  std::vector<std::shared_ptr<coal::CollisionGeometry>> shapes;
  std::vector<CollisionShape> stated;  ///< empty without half-spaces, which alone are measured from them
};

CollisionScene::CollisionScene(const Model& model, const std::vector<CollisionShape>& shapes,
                               std::vector<CollisionPair> pairs)
    : model_(model), pairs_(std::move(pairs)) {
  auto geometries = std::make_unique<Geometries>();
  for (const CollisionShape& shape : shapes) {
    if (shape.joint < 0 || shape.joint >= model_.joint_count())
      throw Error("collision shape '" + shape.name + "' sits on joint " + std::to_string(shape.joint) +
                  ", but there are " + std::to_string(model_.joint_count()));
    geometries->shapes.push_back(geometry_of(shape));
    if (shape.kind == ShapeKind::half_space) {
      carriers_.push_back({shape.joint, false, true, shape.placement, Vector3::Zero(), Vector3::Zero(), 0.0});
      geometries->stated = shapes;
      continue;
    }
    coal::CollisionGeometry& geometry = *geometries->shapes.back();
    geometry.computeLocalAABB();
    const Vector3 center = geometry.aabb_local.center();
    const Vector3 half = 0.5 * (geometry.aabb_local.max_ - geometry.aabb_local.min_);
    carriers_.push_back({shape.joint, shape.kind == ShapeKind::mesh, false, shape.placement, center, half,
                         ball_radius(shape, center, half)});
  }
  for (const CollisionPair& pair : pairs_)
    if (std::min(pair.first, pair.second) < 0 || std::max(pair.first, pair.second) >= shape_count() ||
        pair.first == pair.second || !std::isfinite(pair.required))
      throw Error("a collision pair names two shapes of " + std::to_string(shape_count()) + " and a distance");
  for (const CollisionPair& pair : pairs_)
    if (carriers_[pair.first].half_space && carriers_[pair.second].half_space)
      throw Error("two half-spaces have no distance");
  geometries_ = std::move(geometries);
}

CollisionScene::~CollisionScene() = default;

/// coal's functions for the pairs, made when first asked for.
struct CollisionSpace::Solvers {
  std::vector<std::unique_ptr<coal::ComputeCollision>> collision;
  std::vector<std::unique_ptr<coal::ComputeDistance>> distance;
  std::vector<coal::Transform3s> transforms;
  coal::CollisionRequest collision_request;
  coal::DistanceRequest distance_request;
  coal::CollisionResult collision_result;
  coal::DistanceResult distance_result;
};

CollisionSpace::CollisionSpace(std::shared_ptr<const CollisionScene> scene)
    : scene_(std::move(scene)), model_(scene_->model()), solvers_(new Solvers) {
  placements_.resize(scene_->carriers_.size());
  centers_.resize(placements_.size());
  solvers_->transforms.resize(placements_.size());
  solvers_->collision.resize(scene_->pairs_.size());
  solvers_->distance.resize(scene_->pairs_.size());
  // A guess that is stated, not what coal has left of the last question.
  solvers_->collision_request.gjk_initial_guess = coal::GJKInitialGuess::CachedGuess;
  solvers_->distance_request.gjk_initial_guess = coal::GJKInitialGuess::CachedGuess;
  solvers_->distance_request.gjk_tolerance = kDistanceTolerance;
}

CollisionSpace::~CollisionSpace() = default;

void CollisionSpace::place(const double* q) {
  model_.update(q, false);
  for (std::size_t i = 0; i < placements_.size(); ++i) {
    const CollisionScene::Carrier& carrier = scene_->carriers_[i];
    const Placement& joint = model_.placement(carrier.joint);
    Placement& at = placements_[i];
    at.rotation.noalias() = joint.rotation * carrier.placement.rotation;
    at.translation.noalias() = joint.translation + joint.rotation * carrier.placement.translation;
    centers_[i].noalias() = at.translation + at.rotation * carrier.box_center;
    solvers_->transforms[i] = transform_of(at);
  }
}

/// True when balls or boxes show that a pair keeps its distance. Only that is told: false says nothing.
bool CollisionSpace::apart(const CollisionPair& pair) const {
  if (with_half_space(pair)) return ball_above_half_space(pair);
  const auto &first = scene_->carriers_[pair.first], &second = scene_->carriers_[pair.second];
  const Vector3 between = centers_[pair.second] - centers_[pair.first];
  const double gap = pair.required + kDoubt, reach = first.radius + second.radius + gap;
  if (reach < 0.0 || between.squaredNorm() > reach * reach) return true;
  // Separating axes: along each the boxes' extents, summed, fall short of the distance of their centres.
  const Eigen::Matrix3d &A = placements_[pair.first].rotation, &B = placements_[pair.second].rotation;
  const Eigen::Matrix3d C = A.transpose() * B, D = C.cwiseAbs();
  const Vector3 a = A.transpose() * between, b = B.transpose() * between;
  const Vector3 &h = first.box_half, &k = second.box_half;
  for (int i = 0; i < 3; ++i)
    if (std::abs(a[i]) - h[i] - D.row(i).dot(k) > gap || std::abs(b[i]) - k[i] - D.col(i).dot(h) > gap) return true;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      const int i1 = (i + 1) % 3, i2 = (i + 2) % 3, j1 = (j + 1) % 3, j2 = (j + 2) % 3;
      const double length = std::sqrt(std::max(0.0, 1.0 - C(i, j) * C(i, j)));
      const double distance = std::abs(a[i2] * C(i1, j) - a[i1] * C(i2, j));
      const double extents = h[i1] * D(i2, j) + h[i2] * D(i1, j) + k[j1] * D(i, j2) + k[j2] * D(i, j1);
      if (length > 1e-3 && distance - extents > gap * length) return true;
    }
  return false;
}

bool CollisionSpace::with_half_space(const CollisionPair& pair) const {
  return scene_->carriers_[pair.first].half_space || scene_->carriers_[pair.second].half_space;
}

/// Whether the ball about the shape of a pair with a half-space keeps its distance.
bool CollisionSpace::ball_above_half_space(const CollisionPair& pair) const {
  const bool first = scene_->carriers_[pair.first].half_space;
  const Placement& plane = placements_[first ? pair.first : pair.second];
  const int shape = first ? pair.second : pair.first;
  const double height = plane.rotation.col(2).dot(centers_[shape] - plane.translation);
  return height - scene_->carriers_[shape].radius > pair.required + kDoubt;
}

/// The lowest point of the shape of a pair with a half-space, and the point of the plane below it.
NearestPoints CollisionSpace::nearest_to_half_space(const CollisionPair& pair) const {
  const bool first = scene_->carriers_[pair.first].half_space;
  const Placement& plane = placements_[first ? pair.first : pair.second];
  const int shape = first ? pair.second : pair.first;
  const Placement& at = placements_[shape];
  const Vector3 up = plane.rotation.col(2);
  const Vector3 lowest = at.translation + at.rotation * support_point(scene_->geometries_->stated[shape],
                                                                      Vector3(-(at.rotation.transpose() * up)));
  const double height = up.dot(lowest - plane.translation);
  const Vector3 below = lowest - height * up;
  return first ? NearestPoints{height, below, lowest, up} : NearestPoints{height, lowest, below, -up};
}

/// Lets coal begin with the line between the centres, in the frame of the first shape.
void CollisionSpace::aim(int pair) {
  const CollisionPair& p = scene_->pairs_[pair];
  Vector3 guess = placements_[p.first].rotation.transpose() * (centers_[p.first] - centers_[p.second]);
  if (!(guess.squaredNorm() > 1e-12)) guess = Vector3::UnitX();
  for (coal::QueryRequest* request : {static_cast<coal::QueryRequest*>(&solvers_->collision_request),
                                      static_cast<coal::QueryRequest*>(&solvers_->distance_request)}) {
    request->cached_gjk_guess = guess;
    request->cached_support_func_guess.setZero();
  }
}

bool CollisionSpace::hit(int pair) {
  const CollisionPair& p = scene_->pairs_[pair];
  if (apart(p)) return false;
  if (with_half_space(p)) return nearest_to_half_space(p).distance <= p.required;
  auto& compute = solvers_->collision[pair];
  if (!compute) {
    const auto& shapes = scene_->geometries_->shapes;
    compute = std::make_unique<coal::ComputeCollision>(shapes[p.first].get(), shapes[p.second].get());
  }
  aim(pair);
  solvers_->collision_request.security_margin = p.required;
  solvers_->collision_result.clear();
  (*compute)(solvers_->transforms[p.first], solvers_->transforms[p.second], solvers_->collision_request,
             solvers_->collision_result);
  return solvers_->collision_result.isCollision();
}

bool CollisionSpace::may_be_within(int pair, double distance) const {
  const CollisionPair& stated = scene_->pairs_[static_cast<std::size_t>(pair)];
  return !apart({stated.first, stated.second, distance});
}

bool CollisionSpace::free() { return first_hit() < 0; }

int CollisionSpace::first_hit() {
  const int count = static_cast<int>(scene_->pairs_.size());
  for (int pair = 0; pair < count; ++pair)
    if (hit(pair)) return pair;
  return -1;
}

NearestPoints CollisionSpace::nearest(int pair) {
  const CollisionPair& p = scene_->pairs_[pair];
  if (with_half_space(p)) return nearest_to_half_space(p);
  auto& compute = solvers_->distance[pair];
  if (!compute) {
    const auto& shapes = scene_->geometries_->shapes;
    compute = std::make_unique<coal::ComputeDistance>(shapes[p.first].get(), shapes[p.second].get());
  }
  aim(pair);
  coal::DistanceResult& result = solvers_->distance_result;
  result.clear();
  (*compute)(solvers_->transforms[p.first], solvers_->transforms[p.second], solvers_->distance_request, result);
  NearestPoints found{result.min_distance, result.nearest_points[0], result.nearest_points[1], result.normal};
  if (scene_->carriers_[p.first].mesh && scene_->carriers_[p.second].mesh) {  // for which coal has no normal
    const Vector3 between = found.on_second - found.on_first;
    if (found.distance > 0.0)
      found.normal = between / between.norm();
    else
      found.normal = found.on_first = found.on_second = Vector3::Constant(std::numeric_limits<double>::quiet_NaN());
  }
  return found;
}

double CollisionSpace::distance_of(const Vector3& point, int shape) {
  const coal::Sphere dot(kDot);
  const coal::Transform3s here(Eigen::Matrix3d::Identity(), point);
  const coal::DistanceRequest request;
  coal::DistanceResult result;
  return kDot + coal::distance(&dot, here, scene_->geometries_->shapes[shape].get(), solvers_->transforms[shape],
                               request, result);
}

std::vector<double> distances_from_hull(const std::vector<Vector3>& points, const std::vector<Vector3>& corners) {
  const auto hull = convex_hull(corners);
  std::vector<double> out(points.size());
  parallel_for(
      available_threads(), static_cast<std::int64_t>(points.size()), [&](int, std::int64_t first, std::int64_t last) {
        const coal::Sphere dot(0.0);
        const coal::ComputeDistance compute(&dot, hull.get());
        coal::DistanceRequest request;
        request.gjk_tolerance = kHullTolerance;
        request.gjk_initial_guess = coal::GJKInitialGuess::CachedGuess;
        request.enable_signed_distance = false;
        coal::DistanceResult result;
        for (std::int64_t i = first; i < last; ++i) {
          const Vector3& point = points[static_cast<std::size_t>(i)];
          request.cached_gjk_guess = point - hull->aabb_local.center();
          result.clear();
          const coal::Transform3s here(Eigen::Matrix3d::Identity(), point);
          out[static_cast<std::size_t>(i)] = std::max(0.0, compute(here, coal::Transform3s(), request, result));
        }
      });
  return out;
}

}  // namespace graspatlas
