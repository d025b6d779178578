#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <memory>
#include <new>
#include <type_traits>
#include <utility>

#include "graspatlas/memory.hpp"

namespace graspatlas {

/// Rows of numbers (or other items) that only ever come, in blocks: they stay where they are, and growing copies
/// nothing. Each block is as large as all before it, and memory that was never written to costs nothing.
///
/// One thread at a time may add rows; others may read the rows they know of meanwhile.
template <class T>
class StableRows {
 public:
  explicit StableRows(int row_size) : row_size_(row_size) {}
  ~StableRows() {
    if constexpr (!std::is_trivially_destructible_v<T>)
      for (std::size_t i = 0; i < count_; ++i) std::destroy_n(row(i), row_size_);
  }
  StableRows(const StableRows&) = delete;
  StableRows& operator=(const StableRows&) = delete;
  StableRows& operator=(StableRows&& other) noexcept {
    std::swap(row_size_, other.row_size_);
    std::swap(count_, other.count_);
    std::swap(blocks_, other.blocks_);
    return *this;
  }

  /// A new row [row_size]; its numbers are not set.
  T* add() {
    const std::size_t block = block_of(count_);
    const std::size_t rows = first_of(block + 1) - first_of(block);
    if (!blocks_[block]) blocks_[block].reset(new std::byte[rows * row_size_ * sizeof(T)]);
    T* const added = row(count_);
    for (std::size_t j = 0; j < row_size_; ++j) new (added + j) T;
    ++count_;
    return added;
  }

  /// Gives the memory of the rows before `last` back; they must not be used any more, and items must be mere numbers.
  void forget_before(std::size_t last) {
    static_assert(std::is_trivially_destructible_v<T>);
    for (std::size_t block = 0; first_of(block) < last; ++block) {
      const std::size_t end = std::min(last, first_of(block + 1));
      give_back(blocks_[block].get(), row(first_of(block)) + (end - first_of(block)) * row_size_);
    }
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
    return reinterpret_cast<T*>(blocks_[block].get()) + (i - first_of(block)) * row_size_;
  }

  std::size_t row_size_, count_ = 0;
  std::array<std::unique_ptr<std::byte[]>, 40> blocks_;
};

}  // namespace graspatlas
