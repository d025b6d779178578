#pragma once

namespace graspatlas {

/// Dimensions that an atlas, and the polytope of a chart, may have.
constexpr int kMostDimensions = 12;

/// What a user chooses of an atlas; what he need not choose are constants beside the code that they are for.
struct AtlasOptions {
  double radius = 0.1;   ///< r: radius of the ball that a chart may cover [units of the tangent space]
  double epsilon = 0.1;  ///< eqs (17) and (18): how far and how different neighbouring charts may be
};

}  // namespace graspatlas
