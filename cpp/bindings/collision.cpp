#include <pybind11/eigen.h>
#include <pybind11/stl.h>

#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "bindings.hpp"
#include "graspatlas/collision/collision_batch.hpp"
#include "graspatlas/collision/convex_hull.hpp"
#include "graspatlas/errors.hpp"
#include "graspatlas/parallel.hpp"

namespace py = pybind11;

namespace graspatlas {

namespace {

using IntArray = py::array_t<int, py::array::c_style | py::array::forcecast>;
using Map3 = Eigen::Map<Eigen::Vector3d>;
/// name, kind, sizes [3], points [n x 3], triangles [t x 3], joint, placement in the joint [4 x 4].
using ShapeTuple = std::tuple<std::string, std::string, Eigen::Vector3d, DoubleArray, IntArray, int, Eigen::Matrix4d>;

constexpr py::ssize_t kRowsForThreads = 64;  // fewer grasps are done before other threads have started

const std::pair<const char*, ShapeKind> kKinds[] = {
    {"sphere", ShapeKind::sphere},        {"capsule", ShapeKind::capsule},
    {"cylinder", ShapeKind::cylinder},    {"box", ShapeKind::box},
    {"convex", ShapeKind::convex},        {"mesh", ShapeKind::mesh},
    {"half_space", ShapeKind::half_space}};

ShapeKind kind_from(const std::string& name) {
  for (const auto& [text, kind] : kKinds)
    if (name == text) return kind;
  throw Error("a collision shape is a sphere, capsule, cylinder, box, convex, mesh or half_space, not '" + name + "'");
}

std::string name_of(ShapeKind kind) {
  for (const auto& [text, one] : kKinds)
    if (kind == one) return text;
  return "";
}

/// Rows of three numbers, checked.
std::vector<Eigen::Vector3d> points_from(const DoubleArray& rows) {
  if (rows.ndim() != 2 || rows.shape(1) != 3) throw Error("points must have the shape [n, 3]");
  std::vector<Eigen::Vector3d> points(static_cast<std::size_t>(rows.shape(0)));
  for (std::size_t i = 0; i < points.size(); ++i) points[i] = Eigen::Map<const Eigen::Vector3d>(rows.data() + 3 * i);
  return points;
}

template <class T, class Rows>
py::array_t<T> rows_of_three(const Rows& rows) {
  py::array_t<T> out = matrix<T>(static_cast<py::ssize_t>(rows.size()), 3);
  T* to = out.mutable_data();
  for (const auto& row : rows)
    for (int c = 0; c < 3; ++c) *to++ = row[c];
  return out;
}

CollisionShape shape_from(const ShapeTuple& tuple) {
  const auto& [name, kind, sizes, points, triangles, joint, T] = tuple;
  CollisionShape shape;
  shape.name = name;
  shape.kind = kind_from(kind);
  shape.sizes = sizes;
  shape.points = points_from(points);
  if (triangles.ndim() != 2 || triangles.shape(1) != 3) throw Error("triangles must have the shape [t, 3]");
  for (py::ssize_t t = 0; t < triangles.shape(0); ++t)
    shape.triangles.push_back({triangles.at(t, 0), triangles.at(t, 1), triangles.at(t, 2)});
  shape.joint = joint;
  shape.placement = {T.topLeftCorner<3, 3>(), T.topRightCorner<3, 1>()};
  return shape;
}

Eigen::Matrix4d matrix_of(const Placement& placement) {
  Eigen::Matrix4d T = Eigen::Matrix4d::Identity();
  T.topLeftCorner<3, 3>() = placement.rotation;
  T.topRightCorner<3, 1>() = placement.translation;
  return T;
}

py::dict table_of(const LinkShape& shape) {
  py::dict table;
  table["name"] = shape.name;
  table["kind"] = name_of(shape.kind);
  table["sizes"] = Eigen::Vector3d(shape.sizes);
  table["points"] = rows_of_three<double>(shape.points);
  table["triangles"] = rows_of_three<int>(shape.triangles);
  table["joint"] = shape.joint;
  table["placement"] = matrix_of(shape.placement);
  table["link"] = shape.link;
  table["parent_joint"] = shape.parent_joint;
  return table;
}

/// The same of a shape to look at, with its colour and its file.
py::dict table_of(const VisualShape& shape) {
  py::dict table = table_of(static_cast<const LinkShape&>(shape));
  table["in_link"] = matrix_of(shape.in_link);
  table["at_rest"] = matrix_of(shape.at_rest);
  table["colour"] = Eigen::Vector4d(shape.colour);
  table["file"] = shape.file;
  table["scale"] = Eigen::Vector3d(shape.scale);
  return table;
}

using Tables = py::typing::List<py::typing::Dict<py::str, py::object>>;

/// Tables of the shapes that a function of read_shapes.cpp reads.
template <class Shapes>
Tables tables_of(Shapes (*read)(const std::string&, const std::string&, const std::vector<std::string>&),
                 const std::string& tree, const std::string& urdf, const std::vector<std::string>& package_dirs) {
  Shapes shapes;
  {
    py::gil_scoped_release release;
    shapes = read(tree, urdf, package_dirs);
  }
  Tables out;
  for (const auto& shape : shapes) out.append(table_of(shape));
  return out;
}

py::ssize_t checked_rows(const CollisionBatch& batch, const DoubleArray& X) {
  if (X.ndim() != 2 || X.shape(1) < batch.scene().model().q_size())
    throw Error("X must have at least " + std::to_string(batch.scene().model().q_size()) +
                " columns, one row for each grasp");
  for (py::ssize_t i = 0; i < X.size(); ++i)
    if (!std::isfinite(X.data()[i])) throw Error("X must hold finite numbers; row " + std::to_string(i / X.shape(1)));
  return X.shape(0);
}

std::vector<int> checked_numbers(const IntArray& numbers, int count, const char* what) {
  if (numbers.ndim() != 1) throw Error(std::string(what) + " must be numbers in one dimension");
  for (py::ssize_t i = 0; i < numbers.size(); ++i)
    if (numbers.at(i) < 0 || numbers.at(i) >= count)
      throw Error(std::string(what) + " must be below " + std::to_string(count) + ", got " +
                  std::to_string(numbers.at(i)));
  return {numbers.data(), numbers.data() + numbers.size()};
}

/// work(space, row) for each row of X, on all cores, without the GIL.
template <class Work>
void for_rows(CollisionBatch& batch, const DoubleArray& X, const Work& work) {
  const py::ssize_t n = checked_rows(batch, X), columns = X.shape(1);
  const double* x = X.data();
  bool interrupted = false;
  {
    py::gil_scoped_release release;
    batch.for_grasps(n < kRowsForThreads ? 1 : available_threads(), x, n, columns, work, [&interrupted] {
      py::gil_scoped_acquire acquire;
      interrupted = PyErr_CheckSignals() != 0;
      return !interrupted;
    });
  }
  if (interrupted) throw py::error_already_set();
}

py::array_t<int> first_hits(CollisionBatch& batch, const DoubleArray& X) {
  py::array_t<int> out(X.ndim() > 0 ? X.shape(0) : 0);
  int* to = out.mutable_data();
  for_rows(batch, X, [to](CollisionSpace& space, std::int64_t row) { to[row] = space.first_hit(); });
  return out;
}

py::array_t<bool> free_flags(CollisionBatch& batch, const DoubleArray& X) {
  py::array_t<bool> out(X.ndim() > 0 ? X.shape(0) : 0);
  bool* to = out.mutable_data();
  for_rows(batch, X, [to](CollisionSpace& space, std::int64_t row) { to[row] = space.free(); });
  return out;
}

ArrayTable nearest(CollisionBatch& batch, const DoubleArray& X, const IntArray& pairs) {
  const auto chosen = checked_numbers(pairs, static_cast<int>(batch.scene().pairs().size()), "pairs");
  const py::ssize_t n = X.ndim() > 0 ? X.shape(0) : 0, p = static_cast<py::ssize_t>(chosen.size());
  using Stack = py::array_t<double>;
  const std::vector<py::ssize_t> flat = {n, p}, deep = {n, p, 3};
  Stack distances(flat), first(deep), second(deep), normals(deep);
  double *d = distances.mutable_data(), *a = first.mutable_data(), *b = second.mutable_data(),
         *m = normals.mutable_data();
  for_rows(batch, X, [&](CollisionSpace& space, std::int64_t row) {
    for (py::ssize_t i = 0; i < p; ++i) {
      const NearestPoints found = space.nearest(chosen[static_cast<std::size_t>(i)]);
      const std::int64_t at = row * p + i;
      d[at] = found.distance;
      Map3(a + 3 * at) = found.on_first;
      Map3(b + 3 * at) = found.on_second;
      Map3(m + 3 * at) = found.normal;
    }
  });
  ArrayTable out;
  out["distances"] = distances;
  out["on_first"] = first;
  out["on_second"] = second;
  out["normals"] = normals;
  return out;
}

py::array_t<double> point_distances(CollisionBatch& batch, const DoubleArray& X, const IntArray& shapes,
                                    const DoubleArray& points) {
  const auto chosen = checked_numbers(shapes, batch.scene().shape_count(), "shapes");
  const auto at = points_from(points);
  const py::ssize_t n = X.ndim() > 0 ? X.shape(0) : 0, p = static_cast<py::ssize_t>(at.size());
  py::array_t<double> out = matrix<double>(n, p);
  double* to = out.mutable_data();
  for_rows(batch, X, [&](CollisionSpace& space, std::int64_t row) {
    for (py::ssize_t i = 0; i < p; ++i) {
      double least = std::numeric_limits<double>::infinity();
      for (const int shape : chosen) least = std::min(least, space.distance_of(at[static_cast<std::size_t>(i)], shape));
      to[row * p + i] = least;
    }
  });
  return out;
}

std::shared_ptr<CollisionBatch> make_collision_batch(const Model& model, const std::vector<ShapeTuple>& tuples,
                                                     const IntArray& pairs, const DoubleArray& required) {
  std::vector<CollisionShape> shapes;
  for (const ShapeTuple& tuple : tuples) shapes.push_back(shape_from(tuple));
  if (pairs.ndim() != 2 || pairs.shape(1) != 2 || required.ndim() != 1 || required.shape(0) != pairs.shape(0))
    throw Error("pairs must have the shape [p, 2], and required [p]");
  std::vector<CollisionPair> checked;
  for (py::ssize_t i = 0; i < pairs.shape(0); ++i) checked.push_back({pairs.at(i, 0), pairs.at(i, 1), required.at(i)});
  return std::make_shared<CollisionBatch>(std::make_shared<const CollisionScene>(model, shapes, std::move(checked)));
}

}  // namespace

void bind_collision(py::module_& module) {
  py::class_<CollisionBatch, std::shared_ptr<CollisionBatch>>(
      module, "CollisionBatch", "Collision shapes of hand and object; safe to call from any number of threads.")
      .def(py::init(&make_collision_batch), py::arg("model"), py::arg("shapes"), py::arg("pairs"), py::arg("required"),
           "From shapes (name, kind, sizes [3], points [n x 3], triangles [t x 3], joint, placement [4 x 4]), pairs of "
           "them "
           "[p x 2] and the distances that the pairs must keep [p]; see collision_scene.hpp.")
      .def("free", &free_flags, py::arg("X"), "Whether all pairs of each grasp keep their distances [n].")
      .def("first_hits", &first_hits, py::arg("X"), "First pair of each grasp that does not, or -1 [n].")
      .def("nearest", &nearest, py::arg("X"), py::arg("pairs"),
           "Distances [n x p], and on_first, on_second and normals [n x p x 3] of pairs; see NearestPoints.")
      .def("point_distances", &point_distances, py::arg("X"), py::arg("shapes"), py::arg("points"),
           "Distance of each point [palm] from the nearest of some shapes [n x points].");
  module.def(
      "read_collision_shapes",
      [](const std::string& tree, const std::string& urdf, const std::vector<std::string>& package_dirs) {
        return tables_of(read_collision_shapes, tree, urdf, package_dirs);
      },
      py::arg("tree"), py::arg("urdf"), py::arg("package_dirs"),
      "Collision shapes of a URDF, each a table; see collision_shape.hpp.");
  module.def(
      "read_visual_shapes",
      [](const std::string& tree, const std::string& urdf, const std::vector<std::string>& package_dirs) {
        return tables_of(read_visual_shapes, tree, urdf, package_dirs);
      },
      py::arg("tree"), py::arg("urdf"), py::arg("package_dirs"),
      "Shapes of a URDF to look at, each a table; see collision_shape.hpp.");
  module.def(
      "convex_hull",
      [](const DoubleArray& points) {
        const auto of = points_from(points);
        for (const auto& point : of)
          if (!point.allFinite()) throw Error("points must be finite numbers");
        ConvexHull hull;
        {
          py::gil_scoped_release release;
          hull = convex_hull_of(of);
        }
        py::array_t<double> planes = matrix<double>(static_cast<py::ssize_t>(hull.planes.size()), 4);
        for (std::size_t i = 0; i < hull.planes.size(); ++i)
          Eigen::Map<Eigen::Vector4d>(planes.mutable_data() + 4 * i) = hull.planes[i];
        ArrayTable out;
        out["corners"] = py::array_t<int>(static_cast<py::ssize_t>(hull.corners.size()), hull.corners.data());
        out["triangles"] = rows_of_three<int>(hull.triangles);
        out["planes"] = planes;
        return out;
      },
      py::arg("points"),
      "Convex hull of points [n x 3]: numbers of its corners, triangles of its surface [t x 3], and planes [f x 4]; "
      "see "
      "convex_hull.hpp.");
  module.def(
      "distances_from_hull",
      [](const DoubleArray& points, const DoubleArray& corners) {
        const auto from = points_from(points), hull = points_from(corners);
        std::vector<double> distances;
        {
          py::gil_scoped_release release;
          distances = distances_from_hull(from, hull);
        }
        return py::array_t<double>(static_cast<py::ssize_t>(distances.size()), distances.data());
      },
      py::arg("points"), py::arg("corners"), "Distance of each point from the convex hull of others, 0 inside [n].");
}

}  // namespace graspatlas
