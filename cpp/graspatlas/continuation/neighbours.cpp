#include "graspatlas/continuation/neighbours.hpp"

#include <algorithm>
#include <cmath>

namespace graspatlas {

namespace {

// A child that holds more than this share of its parent's points (and some more) makes the parent be rebuilt.
constexpr double kLopsided = 0.85;
// A number is kept to within so much of its size or less, and as much may be lost when it is compared.
constexpr double kRounding = 1.0 / (1 << 22);
// Numbers as large as this count as this one, whose square is no infinity. So points come nearer to each other at most.
constexpr double kLargest = 1e18;
// The work space of a rebuild of more points is given back.
constexpr std::size_t kMostKept = 4096;

template <class Items>
void give_up(Items& items) {
  Items().swap(items);
}

}  // namespace

Neighbours::Neighbours(int size, double unit)
    : size_(size), scale_(1.0 / unit), buckets_(kBucket * size), numbers_(kBucket), inserted_(size) {}

// A point as it is kept; its largest number.
double Neighbours::from_origin(const double* point, float* out) const {
  double largest = 0.0;
  for (int c = 0; c < size_; ++c) {
    const double number = std::clamp((point[c] - origin_[c]) * scale_, -kLargest, kLargest);
    out[c] = static_cast<float>(number);
    largest = std::max(largest, std::abs(number));
  }
  return largest;
}

int Neighbours::new_node() {
  if (free_nodes_.empty()) {
    nodes_.emplace_back();
    return static_cast<int>(nodes_.size()) - 1;
  }
  const int node = free_nodes_.back();
  free_nodes_.pop_back();
  nodes_[node] = Node();
  return node;
}

int Neighbours::new_bucket() {
  if (free_buckets_.empty()) {
    buckets_.add();
    numbers_.add();
    return static_cast<int>(buckets_.count()) - 1;
  }
  const int bucket = free_buckets_.back();
  free_buckets_.pop_back();
  return bucket;
}

void Neighbours::insert(const double* place, int number) {
  if (count_++ == 0) {
    origin_.assign(place, place + size_);
    root_ = new_node();
    nodes_[root_].bucket = new_bucket();
  }
  from_origin(place, inserted_.data());
  const float* const point = inserted_.data();
  int node = root_, parent = -1;
  // Highest node that this insertion makes lopsided, and its parent; a full leaf at the end is split the same
  // way.
  int lopsided = -1, lopsided_parent = -1;
  while (nodes_[node].axis >= 0) {
    Node& n = nodes_[node];
    ++n.count;
    const int child = point[n.axis] < n.split ? n.left : n.right;
    if (lopsided < 0 && nodes_[child].count + 1 > kLopsided * n.count + kBucket) {
      lopsided = node;
      lopsided_parent = parent;
    }
    parent = node;
    node = child;
  }
  if (lopsided < 0 && nodes_[node].count == kBucket) {
    lopsided = node;
    lopsided_parent = parent;
  }
  if (lopsided < 0) {
    Node& leaf = nodes_[node];
    std::copy_n(point, size_, bucket_point(leaf.bucket, leaf.count));
    numbers_[leaf.bucket][leaf.count] = number;
    ++leaf.count;
    return;
  }
  const int replacement = rebuild(lopsided, point, number);
  if (lopsided_parent < 0)
    root_ = replacement;
  else if (Node& above = nodes_[lopsided_parent]; above.left == lopsided)
    above.left = replacement;
  else
    above.right = replacement;
}

int Neighbours::rebuild(int node, const float* point, int number) {
  collected_numbers_.clear();
  collected_points_.clear();
  collect(node);
  collected_numbers_.push_back(number);
  collected_points_.insert(collected_points_.end(), point, point + size_);
  items_.resize(collected_numbers_.size());
  for (std::size_t i = 0; i < items_.size(); ++i)
    items_[i] = {0.0F, collected_numbers_[i], &collected_points_[i * size_]};
  const int built = build(items_.data(), items_.data() + items_.size());
  if (items_.size() > kMostKept) {
    give_up(items_);
    give_up(collected_numbers_);
    give_up(collected_points_);
  }
  return built;
}

void Neighbours::collect(int node) {
  const Node n = nodes_[node];
  if (n.axis < 0) {
    for (int i = 0; i < n.count; ++i) {
      const float* point = bucket_point(n.bucket, i);
      collected_numbers_.push_back(numbers_[n.bucket][i]);
      collected_points_.insert(collected_points_.end(), point, point + size_);
    }
    free_buckets_.push_back(n.bucket);
  } else {
    collect(n.left);
    collect(n.right);
  }
  free_nodes_.push_back(node);
}

int Neighbours::widest_axis(const Item* first, const Item* last) {
  low_.assign(first->point, first->point + size_);
  high_ = low_;
  float *const low = low_.data(), *const high = high_.data();
  for (const Item* item = first + 1; item != last; ++item)
    for (int c = 0; c < size_; ++c) {
      low[c] = std::min(low[c], item->point[c]);
      high[c] = std::max(high[c], item->point[c]);
    }
  int axis = 0;
  for (int c = 1; c < size_; ++c)
    if (high[c] - low[c] > high[axis] - low[axis]) axis = c;
  return axis;
}

int Neighbours::build(Item* first, Item* last) {
  const int node = new_node();
  const int count = static_cast<int>(last - first);
  nodes_[node].count = count;
  if (count <= kBucket) {
    const int bucket = new_bucket();
    nodes_[node].bucket = bucket;
    for (int i = 0; i < count; ++i) {
      std::copy_n(first[i].point, size_, bucket_point(bucket, i));
      numbers_[bucket][i] = first[i].number;
    }
    return node;
  }
  const int axis = widest_axis(first, last);
  for (Item* item = first; item != last; ++item) item->key = item->point[axis];
  Item* middle = first + count / 2;
  std::nth_element(first, middle, last, [](const Item& a, const Item& b) { return a.key < b.key; });
  const float split = middle->key;
  const int left = build(first, middle), right = build(middle, last);
  nodes_[node].axis = axis;
  nodes_[node].split = split;
  nodes_[node].left = left;
  nodes_[node].right = right;
  return node;
}

// Rounding may make points that are kept seem farther away than they are, by `lost` in each direction, and sums of
// squares larger.
void Neighbours::within(const double* point, double distance, std::vector<int>& out, Scratch& scratch) const {
  out.clear();
  if (root_ < 0) return;
  scratch.point.resize(size_);
  scratch.offsets.assign(size_, 0.0);
  const double largest = from_origin(point, scratch.point.data());
  const double lost = kRounding * (largest + distance * scale_);
  const double longest = distance * scale_ + std::sqrt(static_cast<double>(size_)) * lost;
  const double squared = (1.0 + kRounding * (size_ + 4)) * longest * longest;
  search(root_, scratch.point.data(), 0.0, scratch.offsets.data(), squared, out);
}

void Neighbours::search(int node, const float* point, double squared_to_cell, double* offsets, double squared,
                        std::vector<int>& out) const {
  const Node& n = nodes_[node];
  if (n.axis < 0) {
    const int* const numbers = numbers_[n.bucket];
    for (int i = 0; i < n.count; ++i)
      if (is_within(bucket_point(n.bucket, i), point, size_, static_cast<float>(squared))) out.push_back(numbers[i]);
    return;
  }
  // Points equal to the split may lie on either side, so both sides are visited when the offset is zero.
  const double offset = static_cast<double>(point[n.axis]) - static_cast<double>(n.split);
  search(offset < 0.0 ? n.left : n.right, point, squared_to_cell, offsets, squared, out);
  const double old = offsets[n.axis];
  const double farther = squared_to_cell - old * old + offset * offset;
  if (farther > squared) return;
  offsets[n.axis] = offset;
  search(offset < 0.0 ? n.right : n.left, point, farther, offsets, squared, out);
  offsets[n.axis] = old;
}

std::int64_t Neighbours::bytes() const {
  return static_cast<std::int64_t>(nodes_.capacity() * sizeof(Node) + buckets_.bytes() + numbers_.bytes());
}

}  // namespace graspatlas
