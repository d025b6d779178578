#include "graspatlas/climb/climb_batch.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "graspatlas/climb/requirement_measures.hpp"
#include "graspatlas/manifold/lease.hpp"
#include "graspatlas/parallel.hpp"

namespace graspatlas {

namespace {

/// A climber with a system and measures of its own, for one thread.
struct OwnClimber {
  OwnClimber(GraspSystem& shared, const MeasureRecipe& index_recipe, const std::vector<MeasureRecipe>& recipes,
             const ClimbOptions& options)
      : system(shared), index(index_recipe.make(*system)) {
    requirements.push_back(std::make_unique<BoundsMeasure>(*system));
    for (const MeasureRecipe& recipe : recipes) requirements.push_back(recipe.make(*system));
    std::vector<Measure*> pointers;
    for (const auto& requirement : requirements) pointers.push_back(requirement.get());
    climber = std::make_unique<Climber>(*system, *index, pointers, options);
  }

  Lease<GraspSystem> system;
  std::unique_ptr<Measure> index;
  std::vector<std::unique_ptr<Measure>> requirements;
  std::unique_ptr<Climber> climber;
};

}  // namespace

std::vector<ClimbEnd> climb_all(GraspSystem& system, const double* X, std::int64_t count, const MeasureRecipe& index,
                                const std::vector<MeasureRecipe>& requirements, const ClimbOptions& options,
                                int threads, const std::function<bool()>& on) {
  const std::int64_t size = system.configuration_size();
  std::vector<ClimbEnd> ends(static_cast<std::size_t>(count));
  for (std::int64_t i = 0; i < count; ++i) {
    ClimbEnd& none = ends[static_cast<std::size_t>(i)];
    none = {{X + i * size, X + (i + 1) * size}, std::nan(""), HUGE_VAL, HUGE_VAL, ClimbStatus::given_up, {}, 0};
  }
  const bool any_thread = index.any_thread && std::all_of(requirements.begin(), requirements.end(),
                                                          [](const MeasureRecipe& r) { return r.any_thread; });
  const int workers = any_thread ? static_cast<int>(std::min<std::int64_t>(threads, count)) : 1;
  std::atomic<std::int64_t> next{0};
  std::atomic<bool> stopped{false};
  run_on_threads(std::max(workers, 1), [&](int worker) {
    OwnClimber own(system, index, requirements, options);
    const auto go_on = [&] {
      if (worker == 0 && !on()) stopped = true;
      return !stopped;
    };
    for (std::int64_t i = next++; i < count && go_on(); i = next++)
      ends[static_cast<std::size_t>(i)] = own.climber->climb(X + i * size, go_on);
  });
  return ends;
}

}  // namespace graspatlas
