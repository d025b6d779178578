#pragma once

#include <vector>

#include "graspatlas/climb/surroundings.hpp"
#include "graspatlas/types.hpp"

namespace graspatlas {

/// Numbers of a grasp with their slopes along its tangent vectors. A row keeps its id from grasp to grasp.
class Rows {
 public:
  explicit Rows(int dimension) : slopes_(0, dimension) {}

  void clear() { ids_.clear(); }
  /// What is added to the ids that follow, so that those of several measures differ.
  void set_base(int base) { base_ = base; }
  int size() const { return static_cast<int>(ids_.size()); }
  int dimension() const { return static_cast<int>(slopes_.cols()); }

  /// A new row; returns its slopes [dimension], to be filled.
  double* add(int id, double value) {
    const auto row = static_cast<Eigen::Index>(ids_.size());
    ids_.push_back(base_ + id);
    if (row == slopes_.rows()) slopes_.conservativeResize(2 * row + 8, Eigen::NoChange);
    if (values_.size() < ids_.size()) values_.resize(2 * ids_.size());
    values_[ids_.size() - 1] = value;
    return slopes_.row(row).data();
  }

  int id(int row) const { return ids_[static_cast<std::size_t>(row)]; }
  double value(int row) const { return values_[static_cast<std::size_t>(row)]; }
  const double* slopes(int row) const { return slopes_.row(row).data(); }
  double* slopes(int row) { return slopes_.row(row).data(); }

  /// The row of an id, or -1.
  int find(int id) const {
    for (int row = 0; row < size(); ++row)
      if (ids_[static_cast<std::size_t>(row)] == id) return row;
    return -1;
  }

 private:
  int base_ = 0;
  std::vector<int> ids_;
  std::vector<double> values_;
  RowMatrix slopes_;
};

/// Numbers of a grasp that a climb follows: an index, which is one, or the slacks of a requirement, none of them
/// negative where it is met. Slacks are of about the size of tangent coordinates.
///
/// A measure remembers the rows of its last `linearize`, so a thread has its own.
class Measure {
 public:
  virtual ~Measure() = default;

  /// Appends the rows at a grasp; those that can get to zero only farther than `reach` away [units of the tangent
  /// space] may be left out.
  virtual void linearize(const Surroundings& at, double reach, Rows& rows) = 0;

  /// Values of the same rows at another grasp x, in their order. False when the requirement is missed there by what has
  /// no row.
  virtual bool revisit(const double* x, double* values) = 0;
};

}  // namespace graspatlas
