#include <string>

#include "bindings.hpp"
#include "graspatlas/quality/force_closure.hpp"
#include "graspatlas/quality/manipulability.hpp"

namespace py = pybind11;

namespace graspatlas {

namespace {

/// Rows of X [n x configuration_size], checked.
py::ssize_t checked_rows(const GraspSystem& system, const DoubleArray& X) {
  if (X.ndim() != 2 || X.shape(1) != system.configuration_size())
    throw Error("X must have " + std::to_string(system.configuration_size()) + " columns, one row for each grasp");
  return X.shape(0);
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
        py::array_t<double> out(n);
        const double* x = X.data();
        double* margins = out.mutable_data();
        {
          py::gil_scoped_release release;
          ForceClosure closure(system, friction);
          for (py::ssize_t i = 0; i < n; ++i) margins[i] = closure.margin(x + i * system.configuration_size());
        }
        return out;
      },
      py::arg("system"), py::arg("X"), py::arg("friction"),
      "Force-closure margin of each grasp [n]; zero where a grasp is not force-closed. See force_closure.hpp.");
}

}  // namespace graspatlas
