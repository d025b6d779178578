#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <vector>

#include "graspatlas/collision/collision_scene.hpp"
#include "graspatlas/reach/inverse_kinematics.hpp"
#include "graspatlas/reach/posture_table.hpp"

namespace graspatlas {

/// Whether an arm can bring its frame to a target.
enum class ReachStatus : std::int8_t {
  found = 0,       ///< in a posture within the limits that hits nothing
  no_posture = 1,  ///< no start led to a posture within the limits; that there is none is not proved
  hits = 2,        ///< postures were found, and each hits something
};

/// What was found for one target.
struct Reached {
  ReachStatus status = ReachStatus::no_posture;
  int pair = -1;  ///< the pair of shapes that the first of the postures brings too near, where all do
};

/// An arm that carries a hand, in the scene that holds both. It does not change once it is made.
struct ReachScene {
  ArmParts arm;
  std::shared_ptr<const CollisionScene> scene;  ///< its configurations hold those of arm and hand, and no more
  std::vector<int> arm_at, hand_at;             ///< where the numbers of arm and hand stand in them
  int seeds;                                    ///< starts for each target
  int postures;                                 ///< of the table that they are taken from
};

/// Looks for postures of an arm, for many targets on all cores. What is found for a target is a function of the target
/// and the hand's posture alone: it depends neither on the other targets nor on the number of threads.
class ReachBatch {
 public:
  /// Throws Error when parts do not fit together.
  explicit ReachBatch(ReachScene parts);

  int arm_size() const { return arm_size_; }
  int hand_size() const { return static_cast<int>(parts_.hand_at.size()); }

  /// Looks at each of `count` targets, with the hand at H [count x hand_size]: writes out [count], and to Q [count x
  /// arm_size] the postures that were found, NaN where none was. Stops early once `on()`, which is asked now and then
  /// on the caller's thread, returns false.
  void solve(int threads, const Placement* targets, const double* H, std::int64_t count, double* Q, Reached* out,
             const std::function<bool()>& on);

 private:
  /// Work space of one thread.
  struct Space {
    explicit Space(const ReachScene& parts);
    InverseKinematics arm;
    CollisionSpace collisions;
    std::vector<double> q, whole;  // the arm's posture; arm and hand
    std::vector<int> starts;
    std::vector<std::vector<double>> rejected;  // postures that hit something
  };

  Reached solve_one(Space& space, const Placement& target, const double* hand) const;
  bool rejected_before(Space& space) const;
  int first_hit(Space& space) const;
  std::unique_ptr<Space> take();
  void give(std::unique_ptr<Space> space);

  ReachScene parts_;
  int arm_size_;
  std::unique_ptr<const PostureTable> table_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<Space>> idle_;
};

}  // namespace graspatlas
