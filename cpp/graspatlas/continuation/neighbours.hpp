#pragma once

#include <cstdint>
#include <vector>

#include "graspatlas/continuation/rows.hpp"

namespace graspatlas {

/// Points of R^size that come one by one, and those within a distance of any point.
///
/// A k-d tree with buckets. A subtree that has grown lopsided is rebuilt, so the depth stays logarithmic
/// whatever the order of the points: an insertion costs O(log^2 n) amortised, and a search visits the cells
/// that the ball meets.
class Neighbours {
 public:
  explicit Neighbours(int size);

  /// Add a point [size]; points are numbered 0, 1, 2, ... as they come.
  void insert(const double* point);

  /// Numbers of all points within `distance` of `point`, ascending, into `out`.
  void within(const double* point, double distance, std::vector<int>& out) const;

  int size() const { return size_; }
  int count() const { return count_; }

 private:
  static constexpr int kBucket = 16;  // points in a leaf

  struct Node {
    int axis = -1;  // -1: a leaf
    double split = 0.0;
    int left = -1, right = -1;
    int bucket = -1;
    int count = 0;
  };
  struct Item {
    int number;
    const double* point;
  };

  double* bucket_point(int bucket, int i) { return buckets_[bucket] + static_cast<std::size_t>(i) * size_; }
  const double* bucket_point(int bucket, int i) const { return buckets_[bucket] + static_cast<std::size_t>(i) * size_; }
  int new_node();
  int new_bucket();
  int build(Item* first, Item* last);
  int rebuild(int node, const double* point);
  void collect(int node, std::vector<int>& numbers, std::vector<double>& points);
  void search(int node, const double* point, double squared_to_cell, std::vector<double>& offsets, double squared,
              std::vector<int>& out) const;

  int size_, count_ = 0, root_ = -1;
  std::vector<Node> nodes_;
  Rows buckets_;              // a bucket is a row: kBucket points [size]
  std::vector<int> numbers_;  // of the buckets, kBucket each
  std::vector<int> free_nodes_, free_buckets_;
};

}  // namespace graspatlas
