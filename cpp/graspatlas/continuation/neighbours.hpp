#pragma once

#include <cstdint>
#include <vector>

#include "graspatlas/continuation/stable_rows.hpp"

namespace graspatlas {

/// True when the squared distance between points a and b [size] is at most `squared`; mostly found out from some of
/// their numbers.
template <class Number>
bool is_within(const Number* a, const Number* b, int size, Number squared) {
  Number sum = 0;
  int c = 0;
  for (; c + 4 <= size; c += 4) {
    for (int i = c; i < c + 4; ++i) sum += (a[i] - b[i]) * (a[i] - b[i]);
    if (sum > squared) return false;
  }
  for (; c < size; ++c) sum += (a[c] - b[c]) * (a[c] - b[c]);
  return sum <= squared;
}

/// Points of R^size that come one by one, and those within a distance of any point.
///
/// It keeps them in single precision, as seen from the first one: to within a millionth of how far they are from there.
/// So some that are farther from a point than asked for, by as little, count as near; none that is near is missed.
///
/// A k-d tree with buckets. A subtree that has grown lopsided is rebuilt, so the depth stays logarithmic
/// whatever the order of the points: an insertion costs O(log^2 n) amortised, and a search visits the cells
/// that the ball meets.
class Neighbours {
 public:
  /// Lengths from 1e-18 to 1e18 times `unit` can be told from each other.
  explicit Neighbours(int size, double unit = 1.0);

  /// Work space of `within`, one for each thread.
  struct Scratch {
    std::vector<float> point;
    std::vector<double> offsets;
  };

  /// Add a point [size] under a number of the caller's.
  void insert(const double* point, int number);

  /// Numbers of all points within `distance` of `point`, in no order, into `out`. Which of those hardly farther away
  /// are among them does not depend on other points but the first.
  void within(const double* point, double distance, std::vector<int>& out, Scratch& scratch) const;

  int size() const { return size_; }
  int count() const { return count_; }
  /// Memory that it holds.
  std::int64_t bytes() const;

 private:
  static constexpr int kBucket = 16;  // points in a leaf

  struct Node {
    int axis = -1;  // -1: a leaf
    float split = 0.0F;
    int left = -1, right = -1;
    int bucket = -1;
    int count = 0;
  };
  struct Item {
    float key;  // of the point, on the axis that is split
    int number;
    const float* point;
  };

  float* bucket_point(int bucket, int i) { return buckets_[bucket] + static_cast<std::size_t>(i) * size_; }
  const float* bucket_point(int bucket, int i) const { return buckets_[bucket] + static_cast<std::size_t>(i) * size_; }
  double from_origin(const double* point, float* out) const;
  int new_node();
  int new_bucket();
  int widest_axis(const Item* first, const Item* last);
  int build(Item* first, Item* last);
  int rebuild(int node, const float* point, int number);
  void collect(int node);
  void search(int node, const float* point, double squared_to_cell, double* offsets, double squared,
              std::vector<int>& out) const;

  int size_, count_ = 0, root_ = -1;
  double scale_;                // numbers kept are so many times those of the caller
  std::vector<double> origin_;  // the first point
  std::vector<Node> nodes_;
  StableRows<float> buckets_;  // a bucket is a row: kBucket points [size]
  StableRows<int> numbers_;    // of the points in a bucket [kBucket]
  std::vector<int> free_nodes_, free_buckets_;
  std::vector<float> inserted_;
  // What a rebuild collects; kept while it is small, because leaves are split all the time.
  std::vector<int> collected_numbers_;
  std::vector<float> collected_points_, low_, high_;
  std::vector<Item> items_;
};

}  // namespace graspatlas
