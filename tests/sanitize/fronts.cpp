#include <algorithm>
#include <vector>

#include "graspatlas/continuation/checkpoint.hpp"
#include "graspatlas/continuation/front.hpp"
#include "graspatlas/continuation/task_window.hpp"
#include "graspatlas/manifold/toy_systems.hpp"
#include "strain.hpp"

namespace strain {

namespace {

using namespace graspatlas;

/// Charts without a manifold: of each only its key is known, and a place on a line.
struct Store {
  Charts charts{1, 1, 1, 1.0};
  Front front{charts};

  void add(ChartKey key, double place = 0.0) {
    const int slot = charts.add();
    charts[slot].key = key;
    *charts.center(slot) = place;
  }
};

std::vector<int> taken(Front& front) {
  std::vector<int> indices;
  while (front.has_next()) indices.push_back(front.next().index);
  return indices;
}

// Charts are numbered by their keys, whatever their slots; a small generation keeps that order.
void a_small_generation() {
  Store store;
  for (const ChartKey key : {0, 70, 5, 64}) store.add(key);
  require(store.front.begin_generation() && store.front.open_count() == 4, "new charts are open");
  const int numbers[] = {0, 3, 1, 2};
  for (int slot = 0; slot < 4; ++slot) require(store.charts[slot].number == numbers[slot], "keys give the numbers");
  require(taken(store.front) == std::vector<int>({0, 1, 2, 3}), "a small generation keeps its order");
  require(store.front.open_count() == 0 && !store.front.begin_generation(), "then nothing is open");
}

// A large one is taken from several parts in turn: those that follow each other are far apart in it.
void a_large_generation() {
  Store store;
  const int count = 100;
  for (int i = 0; i < count; ++i) store.add(static_cast<ChartKey>(i));
  store.front.begin_generation();
  std::vector<int> indices = taken(store.front);
  require(indices[0] == 0 && indices[1] - indices[0] >= 8, "parts are taken in turn");
  std::sort(indices.begin(), indices.end());
  for (int i = 0; i < count; ++i) require(indices[static_cast<std::size_t>(i)] == i, "each chart is taken once");
}

// What is paused goes on first, and numbers behind it are not settled; what is deferred comes again before new charts.
void paused_and_deferred() {
  Store store;
  for (const ChartKey key : {0, 1, 2}) store.add(key);
  store.front.begin_generation();
  const Expansion first = store.front.next(), second = store.front.next();
  store.add(Front::first_key(second.number));
  store.front.pause(second);
  store.front.pause({first.number, first.index, 7});
  store.front.settle();
  require(store.front.settled_count() == 3, "charts behind a paused expansion are not settled");
  Checkpoint saved;
  store.front.save(saved);
  const Expansion again = store.front.next();
  require(again.number == first.number && again.made == 7, "the first that is paused goes on first");
  store.front.defer(store.front.slot_of(again));
  require(store.front.next().number == second.number && store.front.next().index == 2, "then come the others");
  require(store.front.begin_generation() && store.front.generation() == std::vector<int>({0, 3}),
          "a chart that was deferred comes before those that are new");

  Front other(store.charts);
  other.restore(saved);
  require(other.open_count() == 4 && other.next().made == 7, "a front that was restored goes on where it was saved");
}

// The window hands out at the same time what is far apart, and nothing else.
void windows() {
  const Sphere line(2);  // of which only embeddings are asked, by their two numbers
  Charts charts(2, 2, 2, 1.0);
  Front front(charts);
  for (int i = 0; i < 3; ++i) {
    const int slot = charts.add();
    charts[slot].key = static_cast<ChartKey>(i);
    charts.center(slot)[0] = i == 2 ? 100.0 : 0.5 * i;
    charts.center(slot)[1] = 0.0;
  }
  TaskWindow window(line, 1.0, front);
  window.open(1000, deadline_after(1e9));
  TaskWindow::Task* const first = window.take(false);
  TaskWindow::Task* const far = window.take(false);
  require(first->expansion.index == 0 && far->expansion.index == 2, "a task that is near another waits for it");
  window.finish(*first, 0, true, {});
  TaskWindow::Task* const near = window.take(false);
  require(near->expansion.index == 1, "it is handed out once the other is done");
  window.finish(*near, 3, false, {});
  window.finish(*far, 0, true, {0});
  require(!window.take(false), "nothing begins behind a task that was cut short");
  require(front.next().made == 3, "which goes on later");
}

}  // namespace

void fronts() {
  a_small_generation();
  a_large_generation();
  paused_and_deferred();
  windows();
}

}  // namespace strain
