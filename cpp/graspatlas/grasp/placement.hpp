#pragma once

#include <Eigen/Core>

namespace graspatlas {

/// A rigid placement: maps coordinates of the inner frame to the outer one, p_outer = rotation p_inner + translation.
struct Placement {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();
};

}  // namespace graspatlas
