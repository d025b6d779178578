#pragma once

#include <array>
#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <vector>

#include "graspatlas/clock.hpp"
#include "graspatlas/continuation/front.hpp"
#include "graspatlas/manifold/system.hpp"

namespace graspatlas {

/// Hands the expansions of a front out to several threads such that the atlas is the one that a single thread makes.
///
/// Threads look at a window of the front's order, and take the first expansion that is far enough (kIndependent) from
/// all before it that are not done: then the two leave each other's charts alone.
class TaskWindow {
 public:
  struct Task {
    Expansion expansion;    ///< number 0: this place in the window is free
    int most;               ///< charts that it may make in all
    std::uint32_t awaited;  ///< places in the window of those that must be done first, as bits
    bool running;
  };

  /// `radius` is that of the charts.
  TaskWindow(const System& system, double radius, Front& front);

  /// Opens the window: until there are so many charts, or the deadline has passed.
  void open(std::int64_t chart_limit, Clock::time_point deadline);
  Clock::time_point deadline() const { return deadline_; }

  /// The next expansion that nothing must be waited for; null when there is none, or the limit or the time is up.
  /// `helper` is false for one of the threads, which does small generations alone.
  Task* take(bool helper);

  /// Takes a task out of the window that has made so many charts. One that is not done goes on in its place, or in the
  /// next generation when it has made as many as an expansion may. `reopened` are charts to expand again.
  void finish(Task& task, int made, bool done, const std::vector<int>& reopened);

  /// No more are handed out; what was not begun is kept for later.
  void close();

  /// Looks up where the charts of the front's generation lie, after the front was restored.
  void place_generation();

 private:
  /// Places in the window: bits of Task::awaited.
  static constexpr int kPlaces = 32;
  /// How often a thread looks whether it may go on before it goes to sleep: longer than most expansions take, since to
  /// be woken costs more than to wait for one.
  static constexpr int kSpinsBeforeSleep = 1000;
  /// A generation of fewer charts is left to one thread: others would mostly wait for it.
  static constexpr int kLeastForHelpers = 16;

  using Lock = std::unique_lock<std::mutex>;

  Task* first_free();
  bool may_admit() const;
  void admit(std::int64_t more);
  void free_place(Task& task);
  void stop();
  bool begin_generation();
  void wait(Lock& lock);
  bool for_one_thread() const { return static_cast<int>(front_.generation().size()) < kLeastForHelpers; }
  const double* embedding(const Expansion& expansion) const;

  const System& system_;
  double independent_;  // centres farther apart than this may be expanded at the same time
  Front& front_;

  std::mutex mutex_;  // guards all that follows, and the front
  std::condition_variable changed_, helpers_wanted_;
  std::vector<double> embeddings_;  // of the charts of the generation
  std::array<Task, kPlaces> tasks_{};
  int admitted_ = 0;                                        // tasks in the window
  std::int64_t chart_limit_ = 0, made_ = 0, promised_ = 0;  // charts that there are, and that tasks may still make
  bool stopped_ = false;                                    // no more are admitted
  std::atomic<std::int64_t> events_{0};                     // changes that a thread may wait for
  Clock::time_point deadline_;
};

}  // namespace graspatlas
