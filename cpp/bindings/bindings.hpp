#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/typing.h>

#include <vector>

namespace graspatlas {

using DoubleArray = pybind11::array_t<double, pybind11::array::c_style | pybind11::array::forcecast>;

using ArrayTable = pybind11::typing::Dict<pybind11::str, pybind11::array>;

/// Pointer to the numbers of a one-dimensional array of this size; an Error that names it otherwise.
const double* checked_vector(const DoubleArray& array, pybind11::ssize_t size, const char* name);

/// Rows of a batch of grasps X [n x columns]; an Error where it has other columns.
pybind11::ssize_t checked_rows(const DoubleArray& X, pybind11::ssize_t columns);

template <class T>
pybind11::array_t<T> matrix(pybind11::ssize_t rows, pybind11::ssize_t columns) {
  return pybind11::array_t<T>(std::vector<pybind11::ssize_t>{rows, columns});
}

/// What __reduce__ returns.
using Reduced = pybind11::typing::Tuple<pybind11::object, pybind11::ellipsis>;

/// What __reduce__ returns for an object of a compiled class, or of its subclass in Python; see
/// graspatlas/support/pickling.py.
Reduced reduced(const pybind11::object& self, const pybind11::type& base, const pybind11::tuple& arguments);

/// __reduce__ of the class C: its objects are pickled and copied by the arguments of its constructor, which
/// `arguments(object)` returns as a tuple.
template <class C, class Arguments>
auto by_arguments(Arguments arguments) {
  return [arguments](const pybind11::object& self) -> Reduced {
    return reduced(self, pybind11::type::of<C>(), arguments(self.cast<const C&>()));
  };
}

void bind_continuation(pybind11::module_& module);
void bind_atlas(pybind11::module_& module);
void bind_grasp(pybind11::module_& module);
void bind_quality(pybind11::module_& module);
void bind_collision(pybind11::module_& module);
void bind_climb(pybind11::module_& module);
void bind_reach(pybind11::module_& module);
void bind_render(pybind11::module_& module);

}  // namespace graspatlas
