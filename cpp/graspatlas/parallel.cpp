#include "graspatlas/parallel.hpp"

#include <algorithm>
#include <atomic>
#include <exception>
#include <thread>
#include <vector>

#ifdef __linux__
#include <sched.h>
#endif

namespace graspatlas {

int available_threads() {
#ifdef __linux__
  cpu_set_t cores;
  if (sched_getaffinity(0, sizeof(cores), &cores) == 0) return std::max(CPU_COUNT(&cores), 1);
#endif
  return std::max(static_cast<int>(std::thread::hardware_concurrency()), 1);
}

void run_on_threads(int threads, const std::function<void(int)>& body) {
  std::vector<std::exception_ptr> errors(static_cast<std::size_t>(std::max(threads, 1)));
  const auto guarded = [&](int worker) {
    try {
      body(worker);
    } catch (...) {
      errors[static_cast<std::size_t>(worker)] = std::current_exception();
    }
  };
  std::vector<std::thread> helpers;
  for (int worker = 1; worker < threads; ++worker) helpers.emplace_back(guarded, worker);
  guarded(0);
  for (std::thread& helper : helpers) helper.join();
  for (const std::exception_ptr& error : errors)
    if (error) std::rethrow_exception(error);
}

void parallel_for(int threads, std::int64_t count, const std::function<void(int, std::int64_t, std::int64_t)>& body) {
  // Some pieces for each worker, so that one that is slowed down does not keep the others waiting for long.
  const std::int64_t piece = std::max<std::int64_t>(1, count / (16 * std::max(threads, 1)));
  const int workers = static_cast<int>(std::min<std::int64_t>(threads, (count + piece - 1) / piece));
  std::atomic<std::int64_t> next{0};
  run_on_threads(workers, [&](int worker) {
    for (std::int64_t first = next.fetch_add(piece); first < count; first = next.fetch_add(piece))
      body(worker, first, std::min(first + piece, count));
  });
}

}  // namespace graspatlas
