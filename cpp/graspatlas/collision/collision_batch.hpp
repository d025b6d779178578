#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <vector>

#include "graspatlas/collision/collision_scene.hpp"

namespace graspatlas {

/// Looks at many grasps of a scene on all cores. Calls from any number of threads at a time are safe: each borrows work
/// spaces that no other uses. What is found does not depend on the number of threads.
class CollisionBatch {
 public:
  explicit CollisionBatch(std::shared_ptr<const CollisionScene> scene) : scene_(std::move(scene)) {}

  const CollisionScene& scene() const { return *scene_; }
  const std::shared_ptr<const CollisionScene>& shared_scene() const { return scene_; }

  /// Calls work(space, row) for each of `count` configurations Q [count x stride], placed there, on up to `threads`
  /// threads. Stops early once `on()`, which is asked now and then on the caller's thread, returns false.
  void for_grasps(int threads, const double* Q, std::int64_t count, std::int64_t stride,
                  const std::function<void(CollisionSpace& space, std::int64_t row)>& work,
                  const std::function<bool()>& on);

 private:
  std::unique_ptr<CollisionSpace> take();
  void give(std::unique_ptr<CollisionSpace> space);

  std::shared_ptr<const CollisionScene> scene_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<CollisionSpace>> idle_;
};

}  // namespace graspatlas
