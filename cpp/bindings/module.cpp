#include <string>

#include "bindings.hpp"
#include "graspatlas/errors.hpp"

namespace graspatlas {

const double* checked_vector(const DoubleArray& array, pybind11::ssize_t size, const char* name) {
  if (array.ndim() != 1 || array.shape(0) != size) {
    std::string shape;
    for (pybind11::ssize_t i = 0; i < array.ndim(); ++i) shape += (i ? ", " : "") + std::to_string(array.shape(i));
    throw Error(std::string(name) + " must hold " + std::to_string(size) + " numbers in one dimension; its shape is (" +
                shape + ")");
  }
  return array.data();
}

pybind11::ssize_t checked_rows(const DoubleArray& X, pybind11::ssize_t columns) {
  if (X.ndim() != 2 || X.shape(1) != columns)
    throw Error("X must have " + std::to_string(columns) + " columns, one row for each grasp");
  return X.shape(0);
}

Reduced reduced(const pybind11::object& self, const pybind11::type& base, const pybind11::tuple& arguments) {
  return pybind11::module_::import("graspatlas.support.pickling").attr("reduced")(self, base, arguments);
}

}  // namespace graspatlas

PYBIND11_MODULE(_core, module) {
  module.doc() = "Compiled core of graspatlas: continuation, grasp systems and quality indices.";
  pybind11::register_exception<graspatlas::Error>(module, "GraspAtlasError", PyExc_ValueError);
  graspatlas::bind_continuation(module);
  graspatlas::bind_atlas(module);
  graspatlas::bind_grasp(module);
  graspatlas::bind_quality(module);
  graspatlas::bind_collision(module);
  graspatlas::bind_climb(module);
  graspatlas::bind_reach(module);
  graspatlas::bind_render(module);
}
