#pragma once

#include <Eigen/Core>

#include "graspatlas/collision/collision_shape.hpp"

namespace graspatlas {

/// The point of a shape that lies farthest along a direction, both in the shape's frame; of several such the middle of
/// a sphere's, capsule's, cylinder's or box's side that the direction is exactly normal to. Half-spaces have none.
Eigen::Vector3d support_point(const CollisionShape& shape, const Eigen::Vector3d& direction);

}  // namespace graspatlas
