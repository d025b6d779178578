#include "graspatlas/collision/support_point.hpp"

#include <cmath>

#include "graspatlas/errors.hpp"

namespace graspatlas {

namespace {

double sign(double value) { return value > 0.0 ? 1.0 : value < 0.0 ? -1.0 : 0.0; }

}  // namespace

Eigen::Vector3d support_point(const CollisionShape& shape, const Eigen::Vector3d& direction) {
  const Eigen::Vector3d& s = shape.sizes;
  switch (shape.kind) {
    case ShapeKind::sphere:
      return s[0] * direction.normalized();
    case ShapeKind::capsule:
      return s[0] * direction.normalized() + Eigen::Vector3d(0.0, 0.0, 0.5 * s[1] * sign(direction[2]));
    case ShapeKind::cylinder: {
      const double across = std::hypot(direction[0], direction[1]), scale = across > 0.0 ? s[0] / across : 0.0;
      return {scale * direction[0], scale * direction[1], 0.5 * s[1] * sign(direction[2])};
    }
    case ShapeKind::box:
      return 0.5 * s.cwiseProduct(direction.unaryExpr(&sign));
    case ShapeKind::half_space:
      throw Error("half-space '" + shape.name + "' reaches without end");
    default: {
      const Eigen::Vector3d* farthest = &shape.points.at(0);
      for (const Eigen::Vector3d& point : shape.points)
        if (direction.dot(point) > direction.dot(*farthest)) farthest = &point;
      return *farthest;
    }
  }
}

}  // namespace graspatlas
