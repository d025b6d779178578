#pragma once

#include <cstdint>
#include <mutex>
#include <shared_mutex>
#include <vector>

#include "graspatlas/continuation/chart.hpp"
#include "graspatlas/continuation/neighbours.hpp"
#include "graspatlas/continuation/stable_rows.hpp"
#include "graspatlas/memory.hpp"
#include "graspatlas/parallel.hpp"

namespace graspatlas {

/// The charts of an atlas as several threads make them: each has a slot, a number that means nothing.
///
/// A thread may read and change charts while others do, as long as no two touch the same one; adding a chart and
/// looking neighbours up take a lock.
class Charts {
 public:
  Charts(int x_size, int basis_size, int embedding_size, double radius)
      : x_size_(x_size), radius_(radius), charts_(1), rows_(x_size + basis_size), index_(embedding_size, radius) {}

  Chart& operator[](int slot) { return *charts_[static_cast<std::size_t>(slot)]; }
  const Chart& operator[](int slot) const { return *charts_[static_cast<std::size_t>(slot)]; }
  double* center(int slot) { return rows_[static_cast<std::size_t>(slot)]; }
  const double* center(int slot) const { return rows_[static_cast<std::size_t>(slot)]; }
  double* basis(int slot) { return center(slot) + x_size_; }
  const double* basis(int slot) const { return center(slot) + x_size_; }
  int count() const { return static_cast<int>(rows_.count()); }

  /// Slot of a new chart. Others do not find it before it is published.
  int add() {
    const std::lock_guard lock(adding_);
    charts_.add();
    rows_.add();
    return count() - 1;
  }

  /// From now on `near` finds the chart, by its embedding.
  void publish(int slot, const double* embedding) {
    for (SpinWait spin; !indexing_.try_lock();) spin.wait();
    const std::lock_guard lock(indexing_, std::adopt_lock);
    index_.insert(embedding, slot);
  }

  /// Slots of the published charts within a distance, and maybe of some hardly farther away, in no order.
  void near(const double* embedding, double distance, std::vector<int>& out, Neighbours::Scratch& scratch) const {
    for (SpinWait spin; !indexing_.try_lock_shared();) spin.wait();
    const std::shared_lock lock(indexing_, std::adopt_lock);
    index_.within(embedding, distance, out, scratch);
  }

  /// Scales of the equations: the largest entries of the Jacobian's rows at the first centre.
  std::vector<double>& scales() { return scales_; }
  const std::vector<double>& scales() const { return scales_; }

  /// Gives memory back: that by which `near` finds charts, and the centres, bases and polytopes of the charts before
  /// `last`, of which nothing can be asked any more.
  void forget_places() { index_ = Neighbours(index_.size(), radius_); }
  void forget_before(int last) {
    for (; forgotten_ < last; ++forgotten_) (*this)[forgotten_].polytope = Polytope();
    rows_.forget_before(static_cast<std::size_t>(last));
    trim_heap();
  }

  /// Memory that they hold, without their polytopes' arrays.
  std::int64_t bytes() const { return static_cast<std::int64_t>(charts_.bytes() + rows_.bytes()) + index_.bytes(); }

 private:
  int x_size_, forgotten_ = 0;
  double radius_;
  StableRows<Chart> charts_;
  StableRows<double> rows_;  // centre and basis
  Neighbours index_;
  std::vector<double> scales_;
  std::mutex adding_;
  mutable std::shared_mutex indexing_;
};

}  // namespace graspatlas
