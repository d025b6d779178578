#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "graspatlas/clock.hpp"
#include "graspatlas/grasp/grasp_system.hpp"
#include "graspatlas/manifold/lease.hpp"
#include "graspatlas/parallel.hpp"

namespace graspatlas {

/// A measure of grasps with a system of its own to read them from, for one worker.
template <class Measure>
struct OwnMeasure {
  template <class... Arguments>
  explicit OwnMeasure(GraspSystem& shared, Arguments... arguments) : system(shared), measure(*system, arguments...) {}
  Lease<GraspSystem> system;
  Measure measure;
};

/// Evaluates rows 0 ... count - 1 on all cores: each worker calls for its rows what `make(worker)` has returned. `on`
/// is asked now and then, on the caller's thread, whether to go on; false when it was not.
template <class Make>
bool for_rows(std::int64_t count, const Make& make, const std::function<bool()>& on) {
  constexpr std::chrono::milliseconds kBetweenLooks{50};
  constexpr std::int64_t kRowsForThreads = 256;  // fewer rows are done before other threads have started
  const int threads = count < kRowsForThreads ? 1 : available_threads();
  std::vector<decltype(make(0))> evaluate;
  for (int worker = 0; worker < threads; ++worker) evaluate.push_back(make(worker));
  std::atomic<bool> stopped{false};
  Clock::time_point looked = Clock::now();  // by the first worker
  parallel_for(threads, count, [&](int worker, std::int64_t first, std::int64_t last) {
    for (std::int64_t row = first; row < last && !stopped; ++row) {
      evaluate[static_cast<std::size_t>(worker)](row);
      if (worker == 0 && Clock::now() - looked > kBetweenLooks) {
        if (!on()) stopped = true;
        looked = Clock::now();
      }
    }
  });
  return !stopped;
}

/// The same for one number of each row: values[row] = evaluate(row).
template <class Make>
bool evaluate_rows(std::int64_t count, const Make& make, double* values, const std::function<bool()>& on) {
  const auto writer = [&make, values](int worker) {
    return [evaluate = make(worker), values](std::int64_t row) mutable { values[row] = evaluate(row); };
  };
  return for_rows(count, writer, on);
}

}  // namespace graspatlas
