#pragma once

#include <cstdint>
#include <functional>
#include <thread>

namespace graspatlas {

/// What a thread does between two looks at something that mostly changes within a microsecond: at first it pauses,
/// after some looks it lets others run.
class SpinWait {
 public:
  void wait() {
    if (waits_++ < kPauses)
      pause();
    else
      std::this_thread::yield();
  }

 private:
  /// Pauses, some microseconds in all; then what is waited for may need the core.
  static constexpr int kPauses = 64;

  static void pause() {
#if defined(__x86_64__)
    __builtin_ia32_pause();
#endif
  }
  int waits_ = 0;
};

/// Cores that this process may use.
int available_threads();

/// Calls body(worker) for worker = 0 ... threads - 1 at the same time, worker 0 on the caller's thread, and waits for
/// all. The first exception that a worker throws is thrown again here.
///
/// Threads are started for each call, which takes some 20 microseconds: call it for work of a millisecond and more.
void run_on_threads(int threads, const std::function<void(int worker)>& body);

/// Calls body(worker, first, last) for pieces [first, last) that make up [0, count), on up to `threads` threads. Pieces
/// are handed out as workers become free; what is computed for an item must not depend on the piece or the worker.
void parallel_for(int threads, std::int64_t count,
                  const std::function<void(int worker, std::int64_t first, std::int64_t last)>& body);

}  // namespace graspatlas
