#pragma once

#include <memory>
#include <string>
#include <vector>

#include "graspatlas/grasp/grasp_system.hpp"

namespace strain {

/// Three fingers of three joints each round a palm, the joints of a kind.
std::string hand_urdf(const std::string& kind);

struct Tripod {
  std::shared_ptr<graspatlas::GraspSystem> system;
  std::vector<double> x1;
};

/// A grasp of the tripod with `kept` hand motions: one fingertip on a plane, two on surfaces of revolution.
Tripod tripod(int kept, double length_scale);

}  // namespace strain
