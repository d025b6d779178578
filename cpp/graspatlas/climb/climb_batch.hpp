#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "graspatlas/climb/climber.hpp"
#include "graspatlas/climb/measure.hpp"
#include "graspatlas/grasp/grasp_system.hpp"

namespace graspatlas {

/// How to make a measure for one thread.
struct MeasureRecipe {
  std::function<std::unique_ptr<Measure>(GraspSystem&)> make;
  bool any_thread = true;  ///< false where it asks Python, which one thread at a time may do
};

/// Climbs from each of `count` grasps X [count x configuration_size], on up to `threads` threads; see Climber. The ends
/// are the same for any number of threads. `on` is asked now and then, on the caller's thread, whether to go on; climbs
/// that have not ended by then have been given up, and those that have not begun have no values.
std::vector<ClimbEnd> climb_all(GraspSystem& system, const double* X, std::int64_t count, const MeasureRecipe& index,
                                const std::vector<MeasureRecipe>& requirements, const ClimbOptions& options,
                                int threads, const std::function<bool()>& on);

/// By how much each grasp misses the requirement that it misses most [count]; 0 where it meets all.
std::vector<double> missed_by_all(GraspSystem& system, const double* X, std::int64_t count,
                                  const std::vector<MeasureRecipe>& requirements, int threads,
                                  const std::function<bool()>& on);

}  // namespace graspatlas
