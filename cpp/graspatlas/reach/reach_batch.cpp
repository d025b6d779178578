#include "graspatlas/reach/reach_batch.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <string>

#include "graspatlas/errors.hpp"
#include "graspatlas/parallel.hpp"

namespace graspatlas {

namespace {

constexpr std::int64_t kTargetsBetweenLooks = 16;
/// Postures that differ by less are the same [rad or m].
constexpr double kSame = 1e-6;

}  // namespace

ReachBatch::Space::Space(const ReachScene& parts) : arm(parts.arm), collisions(parts.scene) {
  q.resize(static_cast<std::size_t>(parts.arm.model.q_size()));
  whole = parts.scene->model().neutral();
}

ReachBatch::ReachBatch(ReachScene parts) : parts_(std::move(parts)), arm_size_(parts_.arm.model.q_size()) {
  const int whole = parts_.scene->model().q_size();
  if (static_cast<int>(parts_.arm_at.size()) != arm_size_ || arm_size_ + hand_size() != whole)
    throw Error("arm and hand have " + std::to_string(arm_size_) + " and " + std::to_string(hand_size()) +
                " numbers, their scene " + std::to_string(whole));
  for (const std::vector<int>* places : {&parts_.arm_at, &parts_.hand_at})
    for (const int at : *places)
      if (at < 0 || at >= whole) throw Error("a number of arm or hand has no place in their scene");
  if (parts_.seeds < 1) throw Error("inverse kinematics needs a start");
  InverseKinematics arm(parts_.arm);
  table_ = std::make_unique<const PostureTable>(arm, parts_.postures);
}

bool ReachBatch::rejected_before(Space& space) const {
  return std::any_of(space.rejected.begin(), space.rejected.end(), [&space](const std::vector<double>& other) {
    for (std::size_t i = 0; i < other.size(); ++i)
      if (std::abs(other[i] - space.q[i]) > kSame) return false;
    return true;
  });
}

int ReachBatch::first_hit(Space& space) const {
  for (std::size_t i = 0; i < space.q.size(); ++i) space.whole[parts_.arm_at[i]] = space.q[i];
  space.collisions.place(space.whole.data());
  return space.collisions.first_hit();
}

Reached ReachBatch::solve_one(Space& space, const Placement& target, const double* hand) const {
  Reached found;
  if (space.arm.too_far(target)) return found;
  for (int i = 0; i < hand_size(); ++i) space.whole[parts_.hand_at[i]] = hand[i];
  table_->nearest(target, parts_.seeds, space.starts);
  space.rejected.clear();
  for (const int start : space.starts) {
    std::copy_n(table_->posture(start), space.q.size(), space.q.begin());
    if (!space.arm.solve(target, space.q.data()) || rejected_before(space)) continue;
    const int pair = first_hit(space);
    if (pair < 0) return {ReachStatus::found, -1};
    if (space.rejected.empty()) found = {ReachStatus::hits, pair};
    space.rejected.push_back(space.q);
  }
  return found;
}

void ReachBatch::solve(int threads, const Placement* targets, const double* H, std::int64_t count, double* Q,
                       Reached* out, const std::function<bool()>& on) {
  std::atomic<bool> stopped{false};
  parallel_for(threads, count, [&](int worker, std::int64_t first, std::int64_t last) {
    if (stopped) return;
    std::unique_ptr<Space> space = take();
    for (std::int64_t row = first; row < last && !stopped; ++row) {
      out[row] = solve_one(*space, targets[row], H + row * hand_size());
      double* q = Q + row * arm_size_;
      if (out[row].status == ReachStatus::found)
        std::copy(space->q.begin(), space->q.end(), q);
      else
        std::fill_n(q, arm_size_, std::numeric_limits<double>::quiet_NaN());
      if (worker == 0 && row % kTargetsBetweenLooks == kTargetsBetweenLooks - 1 && !on()) stopped = true;
    }
    give(std::move(space));
  });
}

std::unique_ptr<ReachBatch::Space> ReachBatch::take() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!idle_.empty()) {
      std::unique_ptr<Space> space = std::move(idle_.back());
      idle_.pop_back();
      return space;
    }
  }
  return std::make_unique<Space>(parts_);
}

void ReachBatch::give(std::unique_ptr<Space> space) {
  const std::lock_guard<std::mutex> lock(mutex_);
  idle_.push_back(std::move(space));
}

}  // namespace graspatlas
