#include "graspatlas/continuation/atlas.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>
#include <thread>

#include "graspatlas/parallel.hpp"

namespace graspatlas {

namespace {

// Charts that one task may make: a chart with more to make comes again in the next generation.
constexpr int kMostCharts = 64;
// How often a thread looks whether it may go on before it goes to sleep.
constexpr int kLooks = 1000;
// A generation of fewer charts keeps its own order, which packs charts best: threads would mostly wait for each other.
constexpr int kSmall = 64;
// In a large one, the next chart is the first of so many to come that is far from so many taken before it.
constexpr int kChoices = 32, kFarFrom = 7;
// Beside smaller charts rounding and the tolerances of points and polytopes are no longer small.
constexpr double kSmallestRadius = 1e-7;

void check_options(const AtlasOptions& options, const System& system) {
  if (!(options.radius > 0.0)) throw Error("radius must be positive, got " + to_text(options.radius));
  if (!(options.radius >= kSmallestRadius))
    throw Error("radius must be at least " + to_text(kSmallestRadius) + ", got " + to_text(options.radius) +
                "; scale the variables of a smaller manifold");
  if (!(options.radius < system.radius_limit()))
    throw Error("radius must be below " + to_text(system.radius_limit()) + " for this system, got " +
                to_text(options.radius));
  if (!(options.epsilon > 0.0) || !(options.epsilon < 1.0))
    throw Error("epsilon must lie between 0 and 1, got " + to_text(options.epsilon));
}

}  // namespace

Atlas::Atlas(System& system, const AtlasOptions& options, int threads)
    : system_(system),
      options_(options),
      charts_(system.configuration_size(), system.dimension() * system.tangent_size(), system.embedding_size()) {
  check_options(options, system);
  for (int i = 0; i < std::max(threads, 1); ++i) {
    auto worker = std::make_unique<Worker>();
    if (i > 0) worker->system = system.clone();
    if (i > 0 && !worker->system) break;
    worker->expander = std::make_unique<Expander>(i > 0 ? *worker->system : system, options, charts_);
    workers_.push_back(std::move(worker));
  }
}

Atlas::Atlas(System& system, const double* x0, const AtlasOptions& options, int threads)
    : Atlas(system, options, threads) {
  for (int i = 0; i < system.configuration_size(); ++i)
    if (!std::isfinite(x0[i])) throw Error("x0 holds a number that is not finite");
  system.check_point(x0);
  workers_[0]->expander->start(x0);
  settle_order();
}

Atlas::Atlas(System& system, const Checkpoint& saved, const AtlasOptions& options, int threads)
    : Atlas(system, options, threads) {
  restore(saved);
}

std::int64_t Atlas::open_count() const {
  return static_cast<std::int64_t>(turns_.size() - position_ + order_.size() - next_first_ + again_.size());
}

std::int64_t Atlas::projections() const {
  std::int64_t sum = 0;
  for (const auto& worker : workers_) sum += worker->expander->projections();
  return sum;
}

std::int64_t Atlas::bytes() const {
  std::int64_t sum = charts_.bytes() + static_cast<std::int64_t>(order_.capacity() * sizeof(int));
  for (const auto& worker : workers_) sum += worker->expander->polytope_bytes() + worker->expander->list_bytes();
  return sum;
}

std::int64_t Atlas::array_bytes() const {
  // A centre, a basis and a residual; the polytopes; two numbers for each neighbour in a list.
  const std::int64_t numbers = system_.configuration_size() + system_.dimension() * system_.tangent_size() + 1;
  std::int64_t sum = count() * numbers * static_cast<std::int64_t>(sizeof(double));
  for (const auto& worker : workers_) sum += worker->expander->polytope_bytes() + 2 * worker->expander->list_bytes();
  return sum;
}

void Atlas::expand(std::int64_t chart_limit, double seconds) {
  constexpr double kLongest = 1e6;
  deadline_ = Clock::now() +
              std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(std::min(seconds, kLongest)));
  chart_limit_ = chart_limit;
  made_ = count();
  promised_ = 0;
  stop_ = false;
  try {
    run_on_threads(threads(), [this](int worker) { work(*workers_[static_cast<std::size_t>(worker)]); });
  } catch (...) {
    settle_order();
    throw;
  }
  settle_order();
}

void Atlas::work(Worker& worker) {
  Task task;
  while (take_task(worker, task)) {
    int made = 0;
    try {
      made = worker.expander->expand(task.slot, static_cast<ChartKey>(task.number) * kMostCharts, task.most);
    } catch (...) {
      finish_task(worker, task, task.most);  // as if more were to be made
      const std::lock_guard lock(mutex_);
      stop_ = true;
      changed_.notify_all();
      helpers_wanted_.notify_all();
      throw;
    }
    finish_task(worker, task, made);
  }
}

// Waits for what another thread does. Mostly that is a matter of microseconds, in which a thread is not worth stopping.
template <class Condition>
void Atlas::wait(Lock& lock, Condition condition) {
  for (int i = 0; i < kLooks && !condition(); ++i) {
    lock.unlock();
    std::this_thread::yield();
    lock.lock();
  }
  changed_.wait(lock, condition);
}

// Towards the limit of charts, tasks come one by one and with what is left, so that it is met exactly.
bool Atlas::may_take() const {
  if (stop_ || running_ == 0) return true;
  return position_ < turns_.size() && chart_limit_ - made_ - promised_ >= kMostCharts;
}

// The next chart to expand, once that can begin; false when there is none, or the time is up.
bool Atlas::take_task(Worker& worker, Task& task) {
  Lock lock(mutex_);
  const bool helper = &worker != workers_.front().get();
  do {
    if (helper) helpers_wanted_.wait(lock, [this] { return stop_ || !small(); });
    wait(lock, [this, helper] { return may_take() || (helper && small()); });
    if (stop_) return false;
  } while (helper && small());
  if ((position_ == turns_.size() && !next_generation(worker)) || made_ >= chart_limit_) {
    stop_ = true;
    changed_.notify_all();
    helpers_wanted_.notify_all();
    return false;
  }
  const int turn = turns_[position_++];
  task.slot = generation_[static_cast<std::size_t>(turn)];
  task.most = static_cast<int>(std::min<std::int64_t>(kMostCharts, chart_limit_ - made_ - promised_));
  task.number = ++task_count_;
  promised_ += task.most;
  ++running_;
  find_conflicts(worker, task, turn);
  if (Clock::now() > deadline_) {
    stop_ = true;  // but this task is done
    helpers_wanted_.notify_all();
  }
  wait(lock, [&task] {
    return std::none_of(task.before.begin(), task.before.end(),
                        [](const auto& other) { return other.first->task == other.second; });
  });
  return true;
}

// The tasks of others that are too near, and the place of this one, for those to come.
void Atlas::find_conflicts(Worker& worker, Task& task, int turn) {
  const int size = system_.embedding_size();
  const double distance = kIndependent * options_.radius;
  if (!small()) worker.embedding = &embeddings_[static_cast<std::size_t>(turn) * size];
  task.before.clear();
  // In a small generation a helper that has begun it may be at its first chart: nothing is done at the same time.
  for (const auto& other : workers_)
    if (other->task != 0 && (small() || is_within(worker.embedding, other->embedding, size, distance * distance)))
      task.before.emplace_back(other.get(), other->task);
  worker.task = task.number;
}

void Atlas::finish_task(Worker& worker, const Task& task, int made) {
  const std::lock_guard lock(mutex_);
  made_ += made;
  promised_ -= task.most;
  --running_;
  if (made >= task.most) {
    if (task.most < kMostCharts)
      --position_;  // it was the last: it goes on where it stopped
    else
      again_.push_back(task.slot);
  }
  std::vector<int>& reopened = worker.expander->reopened();
  again_.insert(again_.end(), reopened.begin(), reopened.end());
  reopened.clear();
  worker.task = 0;
  changed_.notify_all();
}

// All charts that are new, in their order, and those that were not done. False when there is none.
bool Atlas::next_generation(Worker& worker) {
  settle_order();
  std::sort(again_.begin(), again_.end(), [this](int a, int b) { return charts_[a].key < charts_[b].key; });
  generation_ = again_;
  generation_.insert(generation_.end(), order_.begin() + static_cast<std::ptrdiff_t>(next_first_), order_.end());
  next_first_ = order_.size();
  again_.clear();
  choose_order(worker);
  position_ = 0;
  if (!small()) helpers_wanted_.notify_all();
  return !generation_.empty();
}

bool Atlas::small() const { return static_cast<int>(generation_.size()) < kSmall; }

// The order in which the generation is expanded: it depends on the charts only.
void Atlas::choose_order(Worker& worker) {
  const int count = static_cast<int>(generation_.size()), size = system_.embedding_size();
  turns_.resize(generation_.size());
  std::iota(turns_.begin(), turns_.end(), 0);
  if (small()) return;
  embeddings_.resize(generation_.size() * static_cast<std::size_t>(size));
  for (std::size_t i = 0; i < generation_.size(); ++i)
    std::copy_n(worker.expander->embedding_of(generation_[i]), size, &embeddings_[i * size]);
  const double distance = kIndependent * options_.radius;
  const auto near = [&](int i, int j) {
    return is_within(&embeddings_[static_cast<std::size_t>(i) * size], &embeddings_[static_cast<std::size_t>(j) * size],
                     size, distance * distance);
  };
  std::vector<int> choices;
  for (int turn = 0, next = 0; turn < count; ++turn) {
    while (next < count && static_cast<int>(choices.size()) < kChoices) choices.push_back(next++);
    // If none is far from them all, the one that is so from the most of the last ones.
    const int most = std::min(turn, kFarFrom);
    int best = 0, best_far = -1;
    for (int c = 0; c < static_cast<int>(choices.size()) && best_far < most; ++c) {
      int far = 0;
      while (far < most && !near(choices[c], turns_[turn - 1 - far])) ++far;
      if (far > best_far) {
        best = c;
        best_far = far;
      }
    }
    turns_[turn] = choices[best];
    choices.erase(choices.begin() + best);
  }
}

// Numbers the charts that have come; no task may be running.
void Atlas::settle_order() {
  const auto first = static_cast<std::ptrdiff_t>(order_.size());
  for (int slot = static_cast<int>(first); slot < charts_.count(); ++slot) order_.push_back(slot);
  std::sort(order_.begin() + first, order_.end(), [this](int a, int b) { return charts_[a].key < charts_[b].key; });
  for (std::size_t i = static_cast<std::size_t>(first); i < order_.size(); ++i)
    charts_[order_[i]].number = static_cast<int>(i);
}

}  // namespace graspatlas
