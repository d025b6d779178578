#include "graspatlas/collision/convex_hull.hpp"

#include <algorithm>
#include <cstdio>
#include <memory>

extern "C" {
#include <libqhull_r/qhull_ra.h>
}

#include "graspatlas/errors.hpp"

namespace graspatlas {

namespace {

/// A run of Qhull. It is called through its C interface: what coal wraps it with crashes when it has something to say.
class Qhull {
 public:
  explicit Qhull(const std::vector<Eigen::Vector3d>& points)
      : coordinates_(3 * points.size()), messages_(std::tmpfile(), &close) {
    for (std::size_t i = 0; i < points.size(); ++i)
      std::copy(points[i].data(), points[i].data() + 3, coordinates_.begin() + static_cast<std::ptrdiff_t>(3 * i));
    qh_zero(state_.get(), messages_.get());
    char command[] = "qhull Qt";  // faces as triangles
    failed_ = qh_new_qhull(state_.get(), 3, static_cast<int>(points.size()), coordinates_.data(), False, command,
                           nullptr, messages_.get()) != 0;
  }
  Qhull(const Qhull&) = delete;
  Qhull& operator=(const Qhull&) = delete;
  ~Qhull() {
    int size, total;
    qh_freeqhull(state_.get(), !qh_ALL);
    qh_memfreeshort(state_.get(), &size, &total);
  }

  bool failed() const { return failed_; }

  void take(ConvexHull& hull) const {
    qhT* qh = state_.get();
    facetT* facet;
    FORALLfacets {
      std::array<int, 3> triangle{};
      std::size_t k = 0;
      vertexT *vertex, **vertexp;
      FOREACHvertex_(facet->vertices) if (k < 3) triangle[k++] = qh_pointid(qh, vertex->point);
      if (facet->toporient) std::swap(triangle[0], triangle[1]);
      hull.triangles.push_back(triangle);
      hull.planes.emplace_back(facet->normal[0], facet->normal[1], facet->normal[2], facet->offset);
      hull.corners.insert(hull.corners.end(), triangle.begin(), triangle.end());
    }
  }

 private:
  static int close(std::FILE* file) { return file ? std::fclose(file) : 0; }

  std::unique_ptr<qhT> state_ = std::make_unique<qhT>();
  std::vector<double> coordinates_;
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> messages_;
  bool failed_ = true;
};

}  // namespace

ConvexHull convex_hull_of(const std::vector<Eigen::Vector3d>& points) {
  const Qhull run(points);
  if (run.failed()) throw Error("the points have no convex hull: they are too few, or all in one plane");
  ConvexHull hull;
  run.take(hull);
  std::sort(hull.corners.begin(), hull.corners.end());
  hull.corners.erase(std::unique(hull.corners.begin(), hull.corners.end()), hull.corners.end());
  return hull;
}

}  // namespace graspatlas
