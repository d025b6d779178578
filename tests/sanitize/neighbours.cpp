#include "graspatlas/continuation/neighbours.hpp"

#include <algorithm>
#include <cmath>

#include "strain.hpp"

namespace strain {

namespace {

using Point = std::vector<double>;

double distance_between(const Point& a, const Point& b) {
  double squared = 0.0;
  for (std::size_t c = 0; c < a.size(); ++c) squared += (a[c] - b[c]) * (a[c] - b[c]);
  return std::sqrt(squared);
}

// All that are near are found, and of the others those alone that rounding may hold for near: by a millionth of how far
// all this is from the first point, unless that is more than single precision can hold.
void check_found(const std::vector<int>& found, const std::vector<Point>& points, const Point& from, double distance) {
  const double extent = distance_between(from, points.front()) + distance;
  const double rounding = extent > 1e15 ? HUGE_VAL : 1e-6 * extent * static_cast<double>(from.size() + 4) + 1e-20;
  std::size_t next = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const bool listed = next < found.size() && found[next] == static_cast<int>(i);
    next += listed;
    const double length = distance_between(from, points[i]);
    require(listed || !(length <= distance), "the tree finds all that are near");
    require(!listed || length <= distance + rounding, "the tree finds none that is far");
  }
  require(next == found.size(), "the tree finds each point once");
}

// Inserts points one by one and asks about points there and elsewhere on the way.
void compare(int size, int count, unsigned seed, Point (*next)(Random&, int, int)) {
  Random random(seed);
  graspatlas::Neighbours tree(size);
  std::vector<Point> points;
  std::vector<int> found;
  graspatlas::Neighbours::Scratch scratch;
  const Point origin(size, 0.0);
  tree.within(origin.data(), 1.0, found, scratch);
  require(found.empty(), "an empty tree finds nothing");
  for (int i = 0; i < count; ++i) {
    points.push_back(next(random, size, i));
    tree.insert(points.back().data(), i);
    if (random.below(20)) continue;
    const Point& from = points[random.below(i + 1)];
    const double distances[] = {0.0, 1e-9, 0.1, 1.0, 1e200};
    for (double distance : distances) {
      tree.within(from.data(), distance, found, scratch);
      std::sort(found.begin(), found.end());
      check_found(found, points, from, distance);
    }
  }
  require(tree.count() == count, "the tree counts its points");
}

Point anywhere(Random& random, int size, int) {
  Point p(size);
  for (double& c : p) c = random.uniform(-1.0, 1.0);
  return p;
}

Point on_a_line(Random&, int size, int i) { return Point(size, 0.01 * i); }

Point one_place(Random&, int size, int) { return Point(size, 0.25); }

Point two_places_and_neighbours(Random& random, int size, int i) {
  Point p(size, i % 2 ? 0.5 : -0.5);
  p[random.below(size)] += random.uniform(-1e-15, 1e-15);
  return p;
}

Point far_apart(Random& random, int size, int i) {
  Point p = anywhere(random, size, i);
  p[0] *= std::pow(10.0, random.uniform(-150.0, 150.0));
  return p;
}

}  // namespace

void neighbours() {
  for (int size : {1, 2, 3, 9, 24}) {
    compare(size, 1500, 1, anywhere);
    compare(size, 600, 2, on_a_line);
    compare(size, 600, 3, one_place);
    compare(size, 600, 4, two_places_and_neighbours);
    compare(size, 600, 5, far_apart);
  }
}

}  // namespace strain
