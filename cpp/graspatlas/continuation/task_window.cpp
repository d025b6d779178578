#include "graspatlas/continuation/task_window.hpp"

#include <algorithm>

#include "graspatlas/continuation/expander.hpp"
#include "graspatlas/parallel.hpp"

namespace graspatlas {

TaskWindow::TaskWindow(const System& system, double radius, Front& front)
    : system_(system), independent_(kIndependent * radius), front_(front) {}

void TaskWindow::open(std::int64_t chart_limit, Clock::time_point deadline) {
  deadline_ = deadline;
  chart_limit_ = chart_limit;
  made_ = front_.count();
  promised_ = 0;
  admitted_ = 0;
  tasks_.fill({});
  stopped_ = false;
}

// Waits for what another thread does. Mostly that is a matter of microseconds, in which a thread is not worth stopping.
void TaskWindow::wait(Lock& lock) {
  const std::int64_t seen = events_;
  lock.unlock();
  SpinWait spin;
  for (int i = 0; i < kSpinsBeforeSleep && events_ == seen; ++i) spin.wait();
  lock.lock();
  changed_.wait(lock, [this, seen] { return events_ != seen; });
}

TaskWindow::Task* TaskWindow::take(bool helper) {
  Lock lock(mutex_);
  while (true) {
    if (helper) helpers_wanted_.wait(lock, [this] { return stopped_ || !for_one_thread(); });
    if (Task* const task = first_free()) {
      task->running = true;
      return task;
    }
    if (may_admit()) {
      admit(Front::kMostCharts);
    } else if (admitted_ > 0) {
      wait(lock);
    } else if (stopped_) {
      return nullptr;
    } else if ((!front_.has_next() && !begin_generation()) || made_ >= chart_limit_) {
      stop();
    } else if (!may_admit()) {
      // Towards the limit of charts, tasks come one by one and with what is left, so that it is met exactly.
      admit(chart_limit_ - made_);
    }
  }
}

bool TaskWindow::may_admit() const {
  return !stopped_ && admitted_ < kPlaces && front_.has_next() &&
         chart_limit_ - made_ - promised_ >= Front::kMostCharts;
}

// The first in the window that nobody is at, and that nothing must be waited for.
TaskWindow::Task* TaskWindow::first_free() {
  Task* first = nullptr;
  for (Task& task : tasks_)
    if (task.expansion.number != 0 && !task.running && task.awaited == 0 &&
        (!first || task.expansion.number < first->expansion.number))
      first = &task;
  return first;
}

const double* TaskWindow::embedding(const Expansion& expansion) const {
  return &embeddings_[static_cast<std::size_t>(expansion.index) * static_cast<std::size_t>(system_.embedding_size())];
}

// Puts the next expansion into the window, where there must be room; it may make `more` charts at most.
void TaskWindow::admit(std::int64_t more) {
  const int size = system_.embedding_size();
  const Expansion next = front_.next();
  Task* place = nullptr;
  std::uint32_t awaited = 0;
  for (int i = 0; i < kPlaces; ++i) {
    if (tasks_[i].expansion.number == 0)
      place = &tasks_[i];
    else if (is_within(embedding(next), embedding(tasks_[i].expansion), size, independent_ * independent_))
      awaited |= std::uint32_t{1} << i;
  }
  const int most = static_cast<int>(std::min<std::int64_t>(Front::kMostCharts, next.made + more));
  *place = {next, most, awaited, false};
  ++admitted_;
  promised_ += most - next.made;
  if (Clock::now() > deadline_) stop();  // what is in the window and not begun is put back
}

void TaskWindow::finish(Task& task, int made, bool done, const std::vector<int>& reopened) {
  const std::lock_guard lock(mutex_);
  made_ += made - task.expansion.made;
  promised_ -= task.most - task.expansion.made;
  const bool paused = !done && made < Front::kMostCharts;
  if (paused)
    front_.pause({task.expansion.number, task.expansion.index, made});
  else if (!done)
    front_.defer(front_.slot_of(task.expansion));
  front_.defer(reopened);
  free_place(task);
  if (paused) stop();  // what waited for it must not begin
}

void TaskWindow::free_place(Task& task) {
  const std::uint32_t place = std::uint32_t{1} << (&task - tasks_.data());
  for (Task& other : tasks_) other.awaited &= ~place;
  task.expansion.number = 0;
  --admitted_;
  ++events_;
  changed_.notify_all();
}

void TaskWindow::stop() {
  for (Task& task : tasks_) {
    if (task.expansion.number == 0 || task.running) continue;
    promised_ -= task.most - task.expansion.made;
    front_.pause(task.expansion);
    free_place(task);
  }
  stopped_ = true;
  ++events_;
  changed_.notify_all();
  helpers_wanted_.notify_all();
}

void TaskWindow::close() {
  const std::lock_guard lock(mutex_);
  stop();
}

bool TaskWindow::begin_generation() {
  const bool any = front_.begin_generation();
  place_generation();
  if (!for_one_thread()) helpers_wanted_.notify_all();
  return any;
}

void TaskWindow::place_generation() {
  const std::vector<int>& generation = front_.generation();
  const auto size = static_cast<std::size_t>(system_.embedding_size());
  embeddings_ = std::vector<double>(generation.size() * size);  // no larger than that
  for (std::size_t i = 0; i < generation.size(); ++i)
    system_.embed(front_.center(generation[i]), &embeddings_[i * size]);
}

}  // namespace graspatlas
