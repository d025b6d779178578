#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "graspatlas/climb/measure.hpp"
#include "graspatlas/collision/collision_scene.hpp"
#include "graspatlas/grasp/grasp_system.hpp"
#include "graspatlas/quality/force_closure.hpp"

namespace graspatlas {

/// How far inside bounds and requirements a climb stays, so that rounding does not put its end outside [units of the
/// tangent space].
constexpr double kInside = 1e-8;

/// The bounds of a system: joint limits and ends of patches.
class BoundsMeasure : public Measure {
 public:
  explicit BoundsMeasure(const System& system);
  void linearize(const Surroundings& at, double reach, Rows& rows) override;
  bool revisit(const double* x, double* values) override;

 private:
  const System& system_;
  std::vector<double> slacks_;
  std::vector<int> seen_;
};

/// Joints stay away from their limits, those that mimic others too.
class JointMarginMeasure : public Measure {
 public:
  JointMarginMeasure(GraspSystem& system, double distance);
  void linearize(const Surroundings& at, double reach, Rows& rows) override;
  bool revisit(const double* x, double* values) override;

 private:
  struct Limit {
    int at;  // number of the joint in x
    double sign, limit;
  };
  double slack(const Limit& limit, const double* x) const {
    return limit.sign * (x[limit.at] - limit.limit) - distance_;
  }

  double distance_;
  std::vector<Limit> limits_;
  std::vector<int> seen_;
};

/// The slack of closure as a climb sees it: where hardly any internal force presses it falls without bound, so by its
/// logarithm there.
double bounded_closure(double slack);

/// Slopes of that [dimension], of the closure whose `slack` at the grasp has just been asked for.
void write_closure_slopes(ForceClosure& closure, double slack, const Surroundings& at, double* slopes);

/// The force-closure margin with its sign, less one that is asked for; as an index the margin itself.
class ClosureMeasure : public Measure {
 public:
  ClosureMeasure(GraspSystem& system, double friction, double torsional, double margin);
  void linearize(const Surroundings& at, double reach, Rows& rows) override;
  bool revisit(const double* x, double* values) override;

 private:
  double excess(double slack) const;

  ForceClosure closure_;
  double margin_;
};

/// Distances of hand and object, less those that they must keep.
class DistancesMeasure : public Measure {
 public:
  /// `length_scale` [m] is the unit of slacks.
  DistancesMeasure(std::shared_ptr<const CollisionScene> scene, double length_scale);
  void linearize(const Surroundings& at, double reach, Rows& rows) override;
  bool revisit(const double* x, double* values) override;

 private:
  /// Points of two shapes that are nearest, in the frames of the joints that carry them.
  struct Watched {
    int pair, first_joint, second_joint;
    Eigen::Vector3d on_first, on_second, normal;
  };
  double slack(int pair, double distance) const;
  double along_normal(const Watched& watched) const;

  CollisionSpace space_;
  const CollisionScene& scene_;
  Model model_;
  double length_scale_;
  std::vector<Watched> watched_;
  std::vector<bool> seen_;
};

/// Whether grasps X [n x configuration_size] will do, by a function of somebody else's that has no slope.
using BatchTest = std::function<bool(const double* x)>;

/// A requirement that is met or not: a climb does not step where it is not.
class TestMeasure : public Measure {
 public:
  explicit TestMeasure(BatchTest met) : met_(std::move(met)) {}
  void linearize(const Surroundings&, double, Rows&) override {}
  bool revisit(const double* x, double*) override { return met_(x); }

 private:
  BatchTest met_;
};

}  // namespace graspatlas
