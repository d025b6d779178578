#include <pybind11/eigen.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bindings.hpp"
#include "graspatlas/errors.hpp"
#include "graspatlas/quality/batch.hpp"
#include "graspatlas/quality/force_closure.hpp"
#include "graspatlas/quality/holding_force.hpp"
#include "graspatlas/quality/manipulability.hpp"
#include "graspatlas/quality/min_weight.hpp"
#include "graspatlas/quality/wrench_hull.hpp"

namespace py = pybind11;

namespace graspatlas {

namespace {

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

/// Work on rows without the GIL: work(on) is false when on() was, that is after Ctrl-C.
template <class Work>
void interruptible(const Work& work) {
  const auto on = [] {
    const py::gil_scoped_acquire acquire;
    return PyErr_CheckSignals() == 0;
  };
  bool done = false;
  {
    const py::gil_scoped_release release;
    done = work(on);
  }
  if (!done) throw py::error_already_set();
}

/// One number for each of n rows; see batch.hpp.
template <class Make>
py::array_t<double> numbers_of_rows(py::ssize_t n, const Make& make) {
  py::array_t<double> out(n);
  double* values = out.mutable_data();
  interruptible([&](const auto& on) { return evaluate_rows(n, make, values, on); });
  return out;
}

/// closure.`measure`(x) for each row of X.
py::array_t<double> evaluate_closure(GraspSystem& system, const DoubleArray& X, double friction, double torsional,
                                     double (ForceClosure::*measure)(const double*)) {
  const double* x = X.data();
  const int size = system.configuration_size();
  return numbers_of_rows(
      checked_rows(X, system.configuration_size()), [&system, x, size, friction, torsional, measure](int) {
        auto own = std::make_shared<OwnMeasure<ForceClosure>>(system, friction, torsional);
        return [own, x, size, measure](std::int64_t row) { return (own->measure.*measure)(x + row * size); };
      });
}

/// Contact forces of each grasp, of total normal force one, that balance its load; see force_closure.hpp.
ArrayTable contact_forces(GraspSystem& system, const DoubleArray& X, double friction, double torsional,
                          const std::optional<DoubleArray>& loads) {
  const py::ssize_t n = checked_rows(X, system.configuration_size()), m = system.contact_count(),
                    a = system.actuated_count();
  const int size = system.configuration_size(), dof = system.object_dof();
  if (loads && (loads->ndim() != 2 || loads->shape(0) != n || loads->shape(1) != dof))
    throw Error("loads must have " + std::to_string(dof) + " columns, one row for each grasp");
  py::array_t<double> forces(std::vector<py::ssize_t>{n, m, 3}), margins(n);
  py::array_t<double> torques = matrix<double>(n, m), joint_torques = matrix<double>(n, a);
  double *f = forces.mutable_data(), *t = torques.mutable_data(), *tau = joint_torques.mutable_data();
  double* margin = margins.mutable_data();
  const double *x = X.data(), *load = loads ? loads->data() : nullptr;
  const auto make = [&](int) {
    auto own = std::make_shared<OwnMeasure<ForceClosure>>(system, friction, torsional);
    return [=, found = ForceClosure::Forces()](std::int64_t row) mutable {
      margin[row] = own->measure.forces(x + row * size, load ? load + row * dof : nullptr, found);
      std::copy_n(found.forces.data(), 3 * m, f + row * 3 * m);
      std::copy_n(found.torques.data(), m, t + row * m);
      std::copy_n(found.joint_torques.data(), a, tau + row * a);
    };
  };
  interruptible([&](const auto& on) { return for_rows(n, make, on); });
  ArrayTable out;
  out["forces"] = forces;
  out["torques"] = torques;
  out["joint_torques"] = joint_torques;
  out["margin"] = margins;
  return out;
}

/// `measure(hull, points)` for each grasp, the points of which are columns.
template <int D, class Measure>
py::array_t<double> measure_hulls(const DoubleArray& wrenches, Measure measure) {
  using Points = typename WrenchHull<D>::Points;
  const double* data = wrenches.data();
  const py::ssize_t count = wrenches.shape(1);
  return numbers_of_rows(wrenches.shape(0), [measure, data, count](int) {
    return [hull = std::make_shared<WrenchHull<D>>(), measure, data, count](std::int64_t row) {
      return measure(*hull, Eigen::Map<const Points>(data + row * count * D, D, count));
    };
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
        return numbers_of_rows(wrenches.shape(0), [data, count, components](int) {
          return [weight = std::make_shared<MinWeight>(), data, count, components](std::int64_t row) {
            return weight->normalized(Eigen::Map<const RowMatrix>(data + row * count * components, count, components));
          };
        });
      },
      py::arg("wrenches"),
      "Min-weight metric, between 0 and 1, of each grasp's wrenches [n x points x 3 or 6]; see min_weight.hpp.");
}

void bind_holding_force(py::module_& module) {
  py::class_<HoldingLimits>(module, "HoldingLimits", "What holds an object; see holding_force.hpp.")
      .def(py::init([](double friction, double torsional, double normal_force, const Vector& efforts,
                       const Eigen::Vector3d& center_of_mass, double torque_length, double gap) {
             return HoldingLimits{friction, torsional, normal_force, efforts, center_of_mass, torque_length, gap};
           }),
           py::arg("friction"), py::arg("torsional"), py::arg("normal_force"), py::arg("efforts"),
           py::arg("center_of_mass"), py::arg("torque_length"), py::arg("gap"));
  module.def(
      "holding_forces",
      [](GraspSystem& system, const DoubleArray& X, const HoldingLimits& limits) {
        const double* x = X.data();
        const int size = system.configuration_size();
        return numbers_of_rows(checked_rows(X, system.configuration_size()), [&system, &limits, x, size](int) {
          auto own = std::make_shared<OwnMeasure<HoldingForce>>(system, limits);
          return [own, x, size](std::int64_t row) { return own->measure.largest(x + row * size); };
        });
      },
      py::arg("system"), py::arg("X"), py::arg("limits"),
      "Largest disturbance from whatever side that each grasp withstands [n], newtons; see holding_force.hpp.");
  module.def(
      "resisted_loads",
      [](GraspSystem& system, const DoubleArray& X, const DoubleArray& directions, const HoldingLimits& limits) {
        const py::ssize_t n = checked_rows(X, system.configuration_size()),
                          axes = system.object_joint().space_dimension();
        if (directions.ndim() != 2 || directions.shape(0) != n || directions.shape(1) != axes)
          throw Error("directions must have " + std::to_string(axes) + " columns, one row for each grasp");
        const double *x = X.data(), *d = directions.data();
        const int size = system.configuration_size();
        return numbers_of_rows(n, [&system, &limits, x, d, axes, size](int) {
          auto own = std::make_shared<OwnMeasure<HoldingForce>>(system, limits);
          return
              [own, x, d, axes, size](std::int64_t row) { return own->measure.along(x + row * size, d + row * axes); };
        });
      },
      py::arg("system"), py::arg("X"), py::arg("directions"), py::arg("limits"),
      "Largest force along unit vectors in the object's frame [n x 3, in the plane 2] that each grasp withstands [n].");
}

}  // namespace

void bind_quality(py::module_& module) {
  module.def(
      "semi_axes",
      [](GraspSystem& system, const DoubleArray& X, double length_unit) {
        const py::ssize_t n = checked_rows(X, system.configuration_size()), dof = system.object_dof();
        py::array_t<double> out(std::vector<py::ssize_t>{n, dof});
        const double* x = X.data();
        double* axes = out.mutable_data();
        const int size = system.configuration_size();
        const auto make = [&system, x, axes, dof, size, length_unit](int) {
          auto own = std::make_shared<OwnMeasure<Manipulability>>(system, length_unit);
          return
              [own, x, axes, dof, size](std::int64_t row) { own->measure.semi_axes(x + row * size, axes + row * dof); };
        };
        interruptible([&](const auto& on) { return for_rows(n, make, on); });
        return out;
      },
      py::arg("system"), py::arg("X"), py::arg("length_unit"),
      "Ascending semi-axes of the manipulability ellipsoid of each grasp [n x object_dof]; see manipulability.hpp.");
  module.def(
      "force_closure_margins",
      [](GraspSystem& system, const DoubleArray& X, double friction, double torsional) {
        return evaluate_closure(system, X, friction, torsional, &ForceClosure::margin);
      },
      py::arg("system"), py::arg("X"), py::arg("friction"), py::arg("torsional") = 0.0,
      "Force-closure margin of each grasp [n]; zero where a grasp is not force-closed. See force_closure.hpp.");
  module.def(
      "force_closure_slacks",
      [](GraspSystem& system, const DoubleArray& X, double friction, double torsional) {
        return evaluate_closure(system, X, friction, torsional, &ForceClosure::slack);
      },
      py::arg("system"), py::arg("X"), py::arg("friction"), py::arg("torsional") = 0.0,
      "Force-closure margin of each grasp with its sign [n]; -infinity where there are no internal forces. See "
      "force_closure.hpp.");
  module.def(
      "contact_forces", &contact_forces, py::arg("system"), py::arg("X"), py::arg("friction"),
      py::arg("torsional") = 0.0, py::arg("loads") = py::none(),
      "Contact forces on the object of each grasp that stay farthest from their friction cones: forces [n x m x 3] "
      "and torques about the normals into the object [n x m], world axes, for a total normal force of one; "
      "joint_torques of the actuated joints [n x a], and margin [n]. Loads [n x object_dof] are wrenches at the "
      "object's origin to balance. NaN where the margin is 0. See force_closure.hpp.");
  bind_wrenches(module);
  bind_holding_force(module);
}

}  // namespace graspatlas
