#include "graspatlas/continuation/atlas.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "graspatlas/parallel.hpp"

namespace graspatlas {

namespace {

// How often a thread looks whether it may go on before it goes to sleep.
constexpr int kLooks = 1000;
// A generation of fewer charts is left to one thread: others would mostly wait for it.
constexpr int kTiny = 16;
// A generation of fewer charts keeps its own order, which packs them best. A larger one is taken in so many parts at
// once, of so many charts at least.
constexpr int kSmall = 48, kMostParts = 16, kSmallestPart = 8;
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
    worker->system = system.clone();
    if (i > 0 && !worker->system) break;
    worker->expander = std::make_unique<Expander>(worker->system ? *worker->system : system, options, charts_);
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
  return static_cast<std::int64_t>(turns_.size() - position_ + paused_.size() + order_.size() - next_first_ +
                                   again_.size());
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
  admitted_ = 0;
  window_.fill({});
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
  try {
    while (Task* const task = take_task(worker)) {
      int made = task->made;
      try {
        const auto key = static_cast<ChartKey>(task->number) * kMostCharts;
        const int slot = generation_[static_cast<std::size_t>(task->turn)];
        const bool done = worker.expander->expand(slot, key, task->most, made, deadline_);
        finish_task(worker, *task, made, done);
      } catch (...) {
        finish_task(worker, *task, made, false);
        throw;
      }
    }
  } catch (...) {
    stop_after_error();
    throw;
  }
}

// Waits for what another thread does. Mostly that is a matter of microseconds, in which a thread is not worth stopping.
void Atlas::wait(Lock& lock) {
  const std::int64_t seen = events_;
  lock.unlock();
  Patience patience;
  for (int i = 0; i < kLooks && events_ == seen; ++i) patience.wait();
  lock.lock();
  changed_.wait(lock, [this, seen] { return events_ != seen; });
}

// The next chart to expand that nothing must be waited for; none when there is none, or the limit or the time is up.
Atlas::Task* Atlas::take_task(Worker& worker) {
  Lock lock(mutex_);
  const bool helper = &worker != workers_.front().get();
  while (true) {
    if (helper) helpers_wanted_.wait(lock, [this] { return stop_ || !tiny(); });
    if (Task* const task = first_free_task()) {
      task->running = true;
      return task;
    }
    if (may_admit()) {
      admit_task(kMostCharts);
    } else if (admitted_ > 0) {
      wait(lock);
    } else if (stop_) {
      return nullptr;
    } else if ((!has_next() && !next_generation(worker)) || made_ >= chart_limit_) {
      stop();
    } else if (!may_admit()) {
      // Towards the limit of charts, tasks come one by one and with what is left, so that it is met exactly.
      admit_task(chart_limit_ - made_);
    }
  }
}

bool Atlas::may_admit() const {
  return !stop_ && admitted_ < kWindow && has_next() && chart_limit_ - made_ - promised_ >= kMostCharts;
}

// The first in the window that nobody is at, and that nothing must be waited for.
Atlas::Task* Atlas::first_free_task() {
  Task* first = nullptr;
  for (Task& task : window_)
    if (task.number != 0 && !task.running && task.before == 0 && (!first || task.number < first->number)) first = &task;
  return first;
}

// Where the chart of a turn of the generation lies.
const double* Atlas::embedding(int turn) const {
  return &embeddings_[static_cast<std::size_t>(turn) * static_cast<std::size_t>(system_.embedding_size())];
}

// Puts the next chart of the generation into the window, where there must be room; it may make `more` charts at most.
void Atlas::admit_task(std::int64_t more) {
  const int size = system_.embedding_size();
  const double distance = kIndependent * options_.radius;
  PausedTask next{};
  if (!paused_.empty()) {
    next = paused_.front();
    paused_.erase(paused_.begin());
  } else {
    next = {++task_count_, turns_[position_++], 0};
  }
  Task* place = nullptr;
  std::uint32_t before = 0;
  for (int i = 0; i < kWindow; ++i) {
    if (window_[i].number == 0)
      place = &window_[i];
    else if (is_within(embedding(next.turn), embedding(window_[i].turn), size, distance * distance))
      before |= std::uint32_t{1} << i;
  }
  const int most = static_cast<int>(std::min<std::int64_t>(kMostCharts, next.made + more));
  *place = {next.number, next.turn, next.made, most, before, false};
  ++admitted_;
  promised_ += most - next.made;
  if (Clock::now() > deadline_) stop();  // what is in the window and not begun is put back
}

// Takes a task out of the window. One that is not done goes on in its place, or in the next generation when it has made
// as many charts as a task may.
void Atlas::finish_task(Worker& worker, Task& task, int made, bool done) {
  const std::lock_guard lock(mutex_);
  made_ += made - task.made;
  promised_ -= task.most - task.made;
  if (!done && made >= kMostCharts)
    again_.push_back(generation_[static_cast<std::size_t>(task.turn)]);
  else if (!done)
    pause(task, made);
  std::vector<int>& reopened = worker.expander->reopened();
  again_.insert(again_.end(), reopened.begin(), reopened.end());
  reopened.clear();
  free_place(task);
  // What waited for a task that is paused must not begin.
  if (!done && made < kMostCharts) stop();
}

// A task that goes on in a later call, before all that come after it.
void Atlas::pause(const Task& task, int made) {
  const PausedTask paused{task.number, task.turn, made};
  const auto after = [](const PausedTask& a, const PausedTask& b) { return a.number < b.number; };
  paused_.insert(std::upper_bound(paused_.begin(), paused_.end(), paused, after), paused);
}

void Atlas::free_place(Task& task) {
  const std::uint32_t place = std::uint32_t{1} << (&task - window_.data());
  for (Task& other : window_) other.before &= ~place;
  task.number = 0;
  --admitted_;
  ++events_;
  changed_.notify_all();
}

// No more are admitted; what was admitted and not begun is kept for later.
void Atlas::stop() {
  for (Task& task : window_) {
    if (task.number == 0 || task.running) continue;
    promised_ -= task.most - task.made;
    pause(task, task.made);
    free_place(task);
  }
  stop_ = true;
  ++events_;
  changed_.notify_all();
  helpers_wanted_.notify_all();
}

void Atlas::stop_after_error() {
  const std::lock_guard lock(mutex_);
  stop();
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
  if (!tiny()) helpers_wanted_.notify_all();
  return !generation_.empty();
}

bool Atlas::tiny() const { return static_cast<int>(generation_.size()) < kTiny; }

// The order in which the generation is expanded: it depends on its size only. Charts that follow each other in the
// generation are mostly near each other, its parts are not: charts are taken from the beginning of each part in turn.
void Atlas::choose_order(Worker& worker) {
  const int count = static_cast<int>(generation_.size()), size = system_.embedding_size();
  embeddings_.resize(generation_.size() * static_cast<std::size_t>(size));
  for (std::size_t i = 0; i < generation_.size(); ++i)
    std::copy_n(worker.expander->embedding_of(generation_[i]), size, &embeddings_[i * size]);
  const int parts = count < kSmall ? 1 : std::min(count / kSmallestPart, kMostParts);
  const int length = (count + parts - 1) / parts;
  turns_.clear();
  for (int first = 0; first < length; ++first)
    for (int turn = first; turn < count; turn += length) turns_.push_back(turn);
}

// Numbers the charts that have come; no task may be running. While tasks are paused, charts that come after theirs may
// get other numbers later.
void Atlas::settle_order() {
  for (int slot = static_cast<int>(order_.size()); slot < charts_.count(); ++slot) order_.push_back(slot);
  const auto by_key = [this](int a, int b) { return charts_[a].key < charts_[b].key; };
  std::sort(order_.begin() + settled_, order_.end(), by_key);
  for (std::size_t i = static_cast<std::size_t>(settled_); i < order_.size(); ++i)
    charts_[order_[i]].number = static_cast<int>(i);
  if (paused_.empty()) {
    settled_ = static_cast<std::ptrdiff_t>(order_.size());
    return;
  }
  const auto next = static_cast<ChartKey>(paused_.front().number) * kMostCharts;
  const auto before = [this](int slot, ChartKey key) { return charts_[slot].key < key; };
  settled_ = std::lower_bound(order_.begin(), order_.end(), next, before) - order_.begin();
}

}  // namespace graspatlas
