#include <cmath>
#include <string>

#include "bindings.hpp"
#include "graspatlas/quality/force_closure.hpp"
#include "graspatlas/quality/manipulability.hpp"
#include "graspatlas/quality/min_weight.hpp"
#include "graspatlas/quality/wrench_hull.hpp"

namespace py = pybind11;

namespace graspatlas {

namespace {

/// Rows of X [n x configuration_size], checked.
py::ssize_t checked_rows(const GraspSystem& system, const DoubleArray& X) {
  if (X.ndim() != 2 || X.shape(1) != system.configuration_size())
    throw Error("X must have " + std::to_string(system.configuration_size()) + " columns, one row for each grasp");
  return X.shape(0);
}

/// `wrenches` [n x points x 3 or 6], checked: at most as many points as a hull takes, no infinite or undefined number.
void check_wrenches(const DoubleArray& wrenches) {
  if (wrenches.ndim() != 3 || (wrenches.shape(2) != 3 && wrenches.shape(2) != 6))
    throw Error("wrenches must have the shape [grasps, wrenches of a grasp, 3 or 6]");
  if (wrenches.shape(1) > WrenchHull<6>::kMaxPoints)
    throw Error("a grasp may have at most " + std::to_string(WrenchHull<6>::kMaxPoints) + " wrenches, got " +
                std::to_string(wrenches.shape(1)) + "; take fewer edges");
  for (py::ssize_t i = 0; i < wrenches.size(); ++i)
    if (!std::isfinite(wrenches.data()[i])) throw Error("wrenches must be finite numbers");
}

constexpr py::ssize_t kRowsBetweenSignals = 32;  // so that Ctrl-C is heard

/// One number for each of n rows, without the GIL.
template <class Evaluate>
py::array_t<double> evaluate_rows(py::ssize_t n, Evaluate evaluate) {
  py::array_t<double> out(n);
  double* values = out.mutable_data();
  py::gil_scoped_release release;
  for (py::ssize_t i = 0; i < n; ++i) {
    values[i] = evaluate(i);
    if (i % kRowsBetweenSignals == kRowsBetweenSignals - 1) {
      py::gil_scoped_acquire acquire;
      if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    }
  }
  return out;
}

/// `measure(hull, points)` for each grasp, the points of which are columns.
template <int D, class Measure>
py::array_t<double> measure_hulls(const DoubleArray& wrenches, Measure measure) {
  using Points = typename WrenchHull<D>::Points;
  const double* data = wrenches.data();
  const py::ssize_t count = wrenches.shape(1);
  WrenchHull<D> hull;
  return evaluate_rows(wrenches.shape(0), [&, data, count](py::ssize_t i) {
    return measure(hull, Eigen::Map<const Points>(data + i * count * D, D, count));
  });
}

template <class Measure>
py::array_t<double> measure_hulls(const DoubleArray& wrenches, Measure measure) {
  check_wrenches(wrenches);
  return wrenches.shape(2) == 3 ? measure_hulls<3>(wrenches, measure) : measure_hulls<6>(wrenches, measure);
}

void bind_wrenches(py::module_& module) {
  module.def(
      "ball_radii",
      [](const DoubleArray& wrenches) {
        return measure_hulls(wrenches, [](auto& hull, const auto& points) { return hull.ball_radius(points); });
      },
      py::arg("wrenches"),
      "Radius of the largest ball around the origin in the hull of each grasp's wrenches [n x points x 3 or 6]; see "
      "wrench_hull.hpp.");
  module.def(
      "round_ball_radii",
      [](const DoubleArray& axes, double friction) {
        if (axes.ndim() == 3 && axes.shape(1) % 3 != 0) throw Error("axes must have three wrenches for each contact");
        constexpr py::ssize_t most = WrenchHull<6>::kMaxPoints / WrenchHull<6>::kRoundCorners / 2;
        if (axes.ndim() == 3 && axes.shape(1) > 3 * most)
          throw Error("a grasp may have at most " + std::to_string(most) + " contacts with round cones");
        if (!(friction > 0.0) || !std::isfinite(friction))
          throw Error("friction must be positive, got " + to_text(friction));
        return measure_hulls(axes, [=](auto& hull, const auto& points) { return hull.ball_radius(points, friction); });
      },
      py::arg("axes"), py::arg("friction"),
      "The same for round friction cones, from the wrenches of unit forces along normal and tangents [n x 3 m x 6].");
  module.def(
      "hull_volumes",
      [](const DoubleArray& wrenches) {
        return measure_hulls(wrenches, [](auto& hull, const auto& points) { return hull.volume(points); });
      },
      py::arg("wrenches"), "Volume of the hull of each grasp's wrenches [n x points x 3 or 6]; see wrench_hull.hpp.");
  module.def(
      "min_weights",
      [](const DoubleArray& wrenches) {
        check_wrenches(wrenches);
        const double* data = wrenches.data();
        const py::ssize_t count = wrenches.shape(1), components = wrenches.shape(2);
        MinWeight weight;
        return evaluate_rows(wrenches.shape(0), [&, data, count, components](py::ssize_t i) {
          return weight.normalized(Eigen::Map<const RowMatrix>(data + i * count * components, count, components));
        });
      },
      py::arg("wrenches"),
      "Min-weight metric, between 0 and 1, of each grasp's wrenches [n x points x 3 or 6]; see min_weight.hpp.");
}

}  // namespace

void bind_quality(py::module_& module) {
  module.def(
      "semi_axes",
      [](GraspSystem& system, const DoubleArray& X, double length_unit) {
        const py::ssize_t n = checked_rows(system, X), dof = system.object_dof();
        py::array_t<double> out(std::vector<py::ssize_t>{n, dof});
        const double* x = X.data();
        double* axes = out.mutable_data();
        {
          py::gil_scoped_release release;
          Manipulability manipulability(system, length_unit);
          for (py::ssize_t i = 0; i < n; ++i)
            manipulability.semi_axes(x + i * system.configuration_size(), axes + i * dof);
        }
        return out;
      },
      py::arg("system"), py::arg("X"), py::arg("length_unit"),
      "Ascending semi-axes of the manipulability ellipsoid of each grasp [n x object_dof]; see manipulability.hpp.");
  module.def(
      "force_closure_margins",
      [](GraspSystem& system, const DoubleArray& X, double friction) {
        const py::ssize_t n = checked_rows(system, X);
        const double* x = X.data();
        ForceClosure closure(system, friction);
        return evaluate_rows(n, [&, x](py::ssize_t i) { return closure.margin(x + i * system.configuration_size()); });
      },
      py::arg("system"), py::arg("X"), py::arg("friction"),
      "Force-closure margin of each grasp [n]; zero where a grasp is not force-closed. See force_closure.hpp.");
  module.def(
      "force_closure_slacks",
      [](GraspSystem& system, const DoubleArray& X, double friction) {
        const py::ssize_t n = checked_rows(system, X);
        const double* x = X.data();
        ForceClosure closure(system, friction);
        return evaluate_rows(n, [&, x](py::ssize_t i) { return closure.slack(x + i * system.configuration_size()); });
      },
      py::arg("system"), py::arg("X"), py::arg("friction"),
      "Force-closure margin of each grasp with its sign [n]; -infinity where there are no internal forces. See "
      "force_closure.hpp.");
  bind_wrenches(module);
}

}  // namespace graspatlas
