#include <string>

#include "bindings.hpp"
#include "graspatlas/quality/manipulability.hpp"

namespace py = pybind11;

namespace graspatlas {

void bind_quality(py::module_& module) {
  module.def(
      "semi_axes",
      [](GraspSystem& system, const DoubleArray& X, double length_unit) {
        if (X.ndim() != 2 || X.shape(1) != system.configuration_size())
          throw Error("X must have " + std::to_string(system.configuration_size()) +
                      " columns, one row for each grasp");
        const py::ssize_t n = X.shape(0), dof = system.object_dof();
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
      "Ascending semi-axes of the manipulability ellipsoid of each grasp [n x object_dof]; see "
      "manipulability.hpp.");
}

}  // namespace graspatlas
