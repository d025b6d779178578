#include "graspatlas/climb/climb_batch.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "graspatlas/climb/requirement_measures.hpp"
#include "graspatlas/manifold/lease.hpp"
#include "graspatlas/parallel.hpp"

namespace graspatlas {

namespace {

constexpr double kReachOfMissed = 1e-3;  // what is met by more is not looked at [units of the tangent space]

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

/// work(climber, i, go_on) for i = 0 ... count - 1, one at a time as threads become free.
template <class Work>
void for_climbs(GraspSystem& system, std::int64_t count, const MeasureRecipe& index,
                const std::vector<MeasureRecipe>& requirements, const ClimbOptions& options, int threads,
                const std::function<bool()>& on, const Work& work) {
  const bool any_thread = index.any_thread && std::all_of(requirements.begin(), requirements.end(),
                                                          [](const MeasureRecipe& r) { return r.any_thread; });
  const int workers = any_thread ? static_cast<int>(std::min<std::int64_t>(threads, count)) : 1;
  std::atomic<std::int64_t> next{0};
  std::atomic<bool> stopped{false};
  run_on_threads(std::max(workers, 1), [&](int worker) {
    OwnClimber own(system, index, requirements, options);
    const std::function<bool()> go_on = [&, worker] {
      if (worker == 0 && !on()) stopped = true;
      return !stopped;
    };
    for (std::int64_t i = next++; i < count && go_on(); i = next++) work(*own.climber, i, go_on);
  });
}

/// An index that is the same everywhere.
class NoIndex : public Measure {
 public:
  void linearize(const Surroundings& at, double, Rows& rows) override {
    std::fill_n(rows.add(0, 1.0), at.dimension(), 0.0);
  }
  bool revisit(const double*, double* values) override {
    *values = 1.0;
    return true;
  }
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
  for_climbs(system, count, index, requirements, options, threads, on,
             [&](Climber& climber, std::int64_t i, const std::function<bool()>& go_on) {
               ends[static_cast<std::size_t>(i)] = climber.climb(X + i * size, go_on);
             });
  return ends;
}

std::vector<double> missed_by_all(GraspSystem& system, const double* X, std::int64_t count,
                                  const std::vector<MeasureRecipe>& requirements, int threads,
                                  const std::function<bool()>& on) {
  const std::int64_t size = system.configuration_size();
  std::vector<double> missed(static_cast<std::size_t>(count), HUGE_VAL);
  const MeasureRecipe no_index{[](GraspSystem&) { return std::make_unique<NoIndex>(); }};
  for_climbs(system, count, no_index, requirements, {kReachOfMissed, 1}, threads, on,
             [&](Climber& climber, std::int64_t i, const std::function<bool()>&) {
               missed[static_cast<std::size_t>(i)] = climber.missed(X + i * size);
             });
  return missed;
}

}  // namespace graspatlas
