#include "graspatlas/collision/collision_batch.hpp"

#include <atomic>

#include "graspatlas/parallel.hpp"

namespace graspatlas {

namespace {

constexpr std::int64_t kRowsBetweenLooks = 32;

}  // namespace

void CollisionBatch::for_grasps(int threads, const double* Q, std::int64_t count, std::int64_t stride,
                                const std::function<void(CollisionSpace&, std::int64_t)>& work,
                                const std::function<bool()>& on) {
  std::atomic<bool> stopped{false};
  parallel_for(threads, count, [&](int worker, std::int64_t first, std::int64_t last) {
    if (stopped) return;
    std::unique_ptr<CollisionSpace> space = take();
    for (std::int64_t row = first; row < last && !stopped; ++row) {
      space->place(Q + row * stride);
      work(*space, row);
      if (worker == 0 && row % kRowsBetweenLooks == kRowsBetweenLooks - 1 && !on()) stopped = true;
    }
    give(std::move(space));
  });
}

std::unique_ptr<CollisionSpace> CollisionBatch::take() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!idle_.empty()) {
      std::unique_ptr<CollisionSpace> space = std::move(idle_.back());
      idle_.pop_back();
      return space;
    }
  }
  return std::make_unique<CollisionSpace>(scene_);
}

void CollisionBatch::give(std::unique_ptr<CollisionSpace> space) {
  const std::lock_guard<std::mutex> lock(mutex_);
  idle_.push_back(std::move(space));
}

}  // namespace graspatlas
