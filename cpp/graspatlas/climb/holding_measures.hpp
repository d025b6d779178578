#pragma once

#include <vector>

#include "graspatlas/climb/measure.hpp"
#include "graspatlas/grasp/grasp_system.hpp"
#include "graspatlas/quality/force_closure.hpp"
#include "graspatlas/quality/holding_touches.hpp"

namespace graspatlas {

/// The holding force as an index: the least force of all touches; 0 without force closure.
class HoldingIndex : public Measure {
 public:
  HoldingIndex(GraspSystem& system, const HoldingLimits& limits) : touches_(system, limits) {}
  void linearize(const Surroundings& at, double reach, Rows& rows) override;
  bool revisit(const double* x, double* values) override;

 private:
  HoldingTouches touches_;
};

/// The holding force as a multiple of one that is asked for, less one: a row for each direction in which a grasp
/// withstands about the least. Without force closure one row, less than none by the closure's slack.
class HoldingMeasure : public Measure {
 public:
  HoldingMeasure(GraspSystem& system, const HoldingLimits& limits, double at_least);
  void linearize(const Surroundings& at, double reach, Rows& rows) override;
  bool revisit(const double* x, double* values) override;

 private:
  double excess(double force) const;
  double open_excess(double closure_slack) const;
  void linearize_open(const Surroundings& at, Rows& rows);

  using Place = Eigen::Matrix<double, 6, 1>;  // of a touch on the ball: its direction, torques as the ball weighs them
  Place place_of(const HoldingTouches::Touch& touch) const;

  HoldingTouches touches_;
  ForceClosure closure_;
  double at_least_, torque_length_;
  std::vector<Place> seen_;  // of the rows; none where the grasp was open
};

}  // namespace graspatlas
