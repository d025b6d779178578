#pragma once

#include <functional>
#include <vector>

#include "graspatlas/climb/measure.hpp"
#include "graspatlas/climb/step_program.hpp"
#include "graspatlas/manifold/newton.hpp"
#include "graspatlas/manifold/system.hpp"

namespace graspatlas {

/// How a climb ended.
///
/// converged: at a local maximum, as far as slopes tell; stalled: where no smaller step gains anything, but slopes do
/// not vanish; given_up: after the most steps, or when it was told to stop; not_met: where no step comes nearer to what
/// the requirements ask for.
enum class ClimbStatus { converged, stalled, given_up, not_met };

/// Where a climb ended.
struct ClimbEnd {
  std::vector<double> x;
  double value;   ///< of the index
  double missed;  ///< by how much the requirement that is missed most is; 0 where all are met
  double kkt;     ///< residual of the conditions of Karush, Kuhn and Tucker
  ClimbStatus status;
  std::vector<double> values;  ///< of the index, where the requirements were first met and after each step from there
  int evaluations;             ///< grasps that were looked at
};

struct ClimbOptions {
  double trust_radius;  ///< largest entry of the first step [units of the tangent space]
  int max_steps;
};

/// Climbs to local maxima of an index on a manifold, within bounds and requirements, by sequential quadratic
/// programming.
///
/// In the tangent space of the current grasp the logarithm of the index (where it is positive) and the slacks of bounds
/// and requirements are linear; the curvature of the Lagrangian is gathered from step to step (damped BFGS), between
/// tangent bases that turn as little as can be. A step is what a quadratic programme finds within a box, projected onto
/// the manifold, bent once where requirements curve (second-order correction), and taken where the index less a penalty
/// for the requirement that is missed most gains enough. From a start that misses requirements it first repairs them.
/// Where steps become short on kinks, slopes from both sides are kept as cuts of the programme (a bundle).
///
/// Its end depends on its start alone, not on what was climbed before.
///
/// Source: J. Nocedal, S. J. Wright, "Numerical Optimization", chapter 18, for the method; R. H. Byrd, J. Nocedal,
/// R. A. Waltz, "Steering exact penalty methods for nonlinear programming" (2008) for the penalty; C. Lemarechal, "An
/// extension of Davidon methods to non differentiable problems" (1975) for cuts.
class Climber {
 public:
  /// The measures must outlive it, and are used by it only; `index` has one row.
  Climber(System& system, Measure& index, std::vector<Measure*> requirements, ClimbOptions options);

  /// From x on the manifold; `on` is asked at each step whether to go on.
  ClimbEnd climb(const double* x, const std::function<bool()>& on);

  /// By how much the requirement that is missed most is missed at x, on the manifold; infinite where one has no number.
  double missed(const double* x);

  static constexpr double kConverged = 1e-6;  ///< largest residual of a climb that has converged

 private:
  static constexpr double kMet = 0.5e-8;     // a slack may miss the inside of a requirement by so much
  static constexpr double kShort = 1e-4;     // trust radius below which refused steps are seen as kinks
  static constexpr double kCutReach = 20.0;  // cuts farther away than so many trust radii are dropped

  struct Point {
    std::vector<double> x;
    double value = 0.0;
    std::vector<double> slacks;
    double missed = 0.0;
    bool blocked = false;  ///< a requirement is missed by what has no row
  };
  enum class Outcome { taken, refused, ended };

  bool begin(const double* x);
  bool gets_nowhere(int steps);
  void linearize(const std::vector<double>& x, const std::vector<double>& Phi, bool index);
  void linearize_current();
  void set_slope();
  void start_climbing();
  Outcome step();
  Outcome end_step(ClimbStatus status);
  bool solve();
  bool try_step(const Vector& w);
  void look_at_trial();
  double gain(double value) const;
  double merit_gain() const;
  Vector corrected_step(const Vector& w);
  void take();
  void update_curvature(const Vector& w);
  void refuse();
  void shift_cuts(const Vector& w, double gained);
  void add_cuts(const Vector& w);
  void sample_cuts();
  bool falls_at_once();
  bool challenged();
  void keep_if_best();
  ClimbEnd end() const;

  System& system_;
  Measure& index_;
  std::vector<Measure*> requirements_;
  ClimbOptions options_;
  Newton newton_;
  StepProgram program_;
  Surroundings here_;
  const int k_;

  Point current_, trial_, best_;
  std::vector<double> Phi_, trial_Phi_, step_;
  bool has_best_ = false, repairing_ = false, logarithmic_ = false, has_curvature_ = false;
  double scale_ = 1.0;  // divides the index and its slopes
  Vector g_, w_, lambda_;
  Rows rows_, old_rows_, index_row_;
  Matrix B_;
  double trust_radius_ = 0.0, penalty_ = 0.0, kkt_ = 0.0, reach_ = 0.0;
  double missed_before_ = 0.0, best_before_ = 0.0;
  std::vector<Cut> cuts_;
  std::vector<double> values_;
  int evaluations_ = 0, challenges_ = 0, samplings_ = 0;
  ClimbStatus status_ = ClimbStatus::given_up;
};

}  // namespace graspatlas
