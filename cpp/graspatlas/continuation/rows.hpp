#pragma once

#include <array>
#include <cstddef>
#include <memory>

namespace graspatlas {

/// Rows of numbers (or other items) that only ever come, in blocks: they stay where they are, and growing copies
/// nothing. Each block is as large as all before it, and memory that was never written to costs nothing.
///
/// One thread at a time may add rows; others may read the rows they know of meanwhile.
template <class T>
class Rows {
 public:
  explicit Rows(int row_size) : row_size_(row_size) {}

  /// A new row [row_size]; its numbers are not set.
  T* add() {
    const std::size_t block = block_of(count_);
    if (!blocks_[block]) blocks_[block].reset(new T[first_of(block + 1) * row_size_ - first_of(block) * row_size_]);
    return (*this)[count_++];
  }

  T* operator[](std::size_t i) { return row(i); }
  const T* operator[](std::size_t i) const { return row(i); }
  std::size_t count() const { return count_; }
  /// Memory of the rows that were added.
  std::size_t bytes() const { return count_ * row_size_ * sizeof(T); }

 private:
  static constexpr std::size_t kFirst = 256;  // rows in the first block
  static constexpr int kFirstBits = 8;

  // Blocks begin at rows 0, 256, 512, 1024, 2048, ...
  static std::size_t first_of(std::size_t block) { return block == 0 ? 0 : kFirst << (block - 1); }
  static std::size_t block_of(std::size_t i) {
    return i < kFirst ? 0 : static_cast<std::size_t>(64 - kFirstBits - __builtin_clzll(i));
  }
  T* row(std::size_t i) const {
    const std::size_t block = block_of(i);
    return &blocks_[block][(i - first_of(block)) * row_size_];
  }

  std::size_t row_size_, count_ = 0;
  std::array<std::unique_ptr<T[]>, 40> blocks_;
};

}  // namespace graspatlas
