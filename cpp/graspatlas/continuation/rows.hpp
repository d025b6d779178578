#pragma once

#include <cstddef>
#include <memory>
#include <vector>

namespace graspatlas {

/// Rows of numbers that only ever come, in blocks: pointers to rows stay valid, and growing copies nothing, so that a
/// million charts need no more memory than they fill.
class Rows {
 public:
  explicit Rows(int row_size) : row_size_(row_size) {}

  /// A new row [row_size], its numbers not set.
  double* add() {
    if (count_ % kBlock == 0) blocks_.emplace_back(new double[kBlock * static_cast<std::size_t>(row_size_)]);
    return (*this)[count_++];
  }

  double* operator[](std::size_t i) { return &blocks_[i / kBlock][(i % kBlock) * row_size_]; }
  const double* operator[](std::size_t i) const { return &blocks_[i / kBlock][(i % kBlock) * row_size_]; }
  std::size_t count() const { return count_; }

 private:
  static constexpr std::size_t kBlock = 256;  // rows in a block

  std::size_t row_size_, count_ = 0;
  std::vector<std::unique_ptr<double[]>> blocks_;
};

}  // namespace graspatlas
