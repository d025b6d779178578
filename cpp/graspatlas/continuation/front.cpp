#include "graspatlas/continuation/front.hpp"

#include <algorithm>

#include "graspatlas/continuation/checkpoint.hpp"

namespace graspatlas {

std::int64_t Front::open_count() const {
  return static_cast<std::int64_t>(sequence_.size() - position_ + paused_.size() + order_.size() - next_first_ +
                                   deferred_.size());
}

void Front::settle() {
  for (int slot = static_cast<int>(order_.size()); slot < charts_.count(); ++slot) order_.push_back(slot);
  const auto by_key = [this](int a, int b) { return charts_[a].key < charts_[b].key; };
  std::sort(order_.begin() + settled_, order_.end(), by_key);
  for (std::size_t i = static_cast<std::size_t>(settled_); i < order_.size(); ++i)
    charts_[order_[i]].number = static_cast<int>(i);
  if (paused_.empty()) {
    settled_ = static_cast<std::ptrdiff_t>(order_.size());
    return;
  }
  const auto before = [this](int slot, ChartKey key) { return charts_[slot].key < key; };
  settled_ = std::lower_bound(order_.begin(), order_.end(), first_key(paused_.front().number), before) - order_.begin();
}

bool Front::begin_generation() {
  settle();
  std::sort(deferred_.begin(), deferred_.end(), [this](int a, int b) { return charts_[a].key < charts_[b].key; });
  generation_ = deferred_;
  generation_.insert(generation_.end(), order_.begin() + static_cast<std::ptrdiff_t>(next_first_), order_.end());
  next_first_ = order_.size();
  deferred_.clear();
  choose_sequence();
  position_ = 0;
  return !generation_.empty();
}

// It depends on the size of the generation only.
void Front::choose_sequence() {
  const int count = static_cast<int>(generation_.size());
  const int parts = count < kLeastForParts ? 1 : std::min(count / kSmallestPart, kMostParts);
  const int length = (count + parts - 1) / parts;
  sequence_.clear();
  for (int first = 0; first < length; ++first)
    for (int index = first; index < count; index += length) sequence_.push_back(index);
}

Expansion Front::next() {
  if (paused_.empty()) return {++expansion_count_, sequence_[position_++], 0};
  const Expansion first = paused_.front();
  paused_.erase(paused_.begin());
  return first;
}

void Front::pause(const Expansion& expansion) {
  const auto after = [](const Expansion& a, const Expansion& b) { return a.number < b.number; };
  paused_.insert(std::upper_bound(paused_.begin(), paused_.end(), expansion, after), expansion);
}

void Front::save(Checkpoint& out) const {
  for (const int slot : generation_) out.generation.push_back(charts_[slot].number);
  for (const int slot : deferred_) out.deferred.push_back(charts_[slot].number);
  out.paused = paused_;
  out.position = static_cast<std::int64_t>(position_);
  out.next_first = static_cast<std::int64_t>(next_first_);
  out.expansion_count = expansion_count_;
}

void Front::restore(const Checkpoint& saved) {
  settle();  // a slot is a chart's number now
  generation_.assign(saved.generation.begin(), saved.generation.end());
  deferred_.assign(saved.deferred.begin(), saved.deferred.end());
  choose_sequence();
  position_ = static_cast<std::size_t>(saved.position);
  next_first_ = static_cast<std::size_t>(saved.next_first);
  expansion_count_ = saved.expansion_count;
  paused_ = saved.paused;
  settle();  // by the expansions that are paused
  for (const Expansion& expansion : paused_) charts_[slot_of(expansion)].done = false;
  for (std::size_t i = position_; i < sequence_.size(); ++i) charts_[generation_[sequence_[i]]].done = false;
  for (std::size_t i = next_first_; i < order_.size(); ++i) charts_[order_[i]].done = false;
  for (const int slot : deferred_) charts_[slot].done = false;
}

}  // namespace graspatlas
