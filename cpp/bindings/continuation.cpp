#include <pybind11/stl.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <utility>

#include "bindings.hpp"
#include "graspatlas/continuation/chart.hpp"
#include "graspatlas/continuation/neighbours.hpp"
#include "graspatlas/continuation/polytope.hpp"
#include "graspatlas/errors.hpp"
#include "graspatlas/manifold/far_projection.hpp"
#include "graspatlas/manifold/lease.hpp"
#include "graspatlas/manifold/newton.hpp"
#include "graspatlas/manifold/toy_systems.hpp"
#include "graspatlas/parallel.hpp"

namespace py = pybind11;

namespace graspatlas {

namespace {

py::array_t<double> differences(const System& system, const DoubleArray& X0, const DoubleArray& X1) {
  const int size = system.configuration_size(), columns = system.tangent_size();
  for (const auto& [X, name] : {std::pair(&X0, "X0"), std::pair(&X1, "X1")}) {
    if (X->ndim() != 2 || X->shape(1) != size || X->shape(0) != X0.shape(0))
      throw Error(std::string(name) + " must have " + std::to_string(size) + " columns, one row for each pair");
  }
  auto out = matrix<double>(X0.shape(0), columns);
  double* to = out.mutable_data();
  const double *from = X0.data(), *towards = X1.data();
  for (py::ssize_t i = 0; i < X0.shape(0); ++i)
    system.difference(from + i * size, towards + i * size, to + i * columns);
  return out;
}

/// A system whose residual and Jacobian are methods of a Python object.
class PythonSystem : public System, public py::trampoline_self_life_support {
 public:
  PythonSystem(int n_variables, int n_equations, const DoubleArray& lower, const DoubleArray& upper)
      : System(n_variables, n_variables, n_equations, n_variables) {
    const double* low = checked_vector(lower, n_variables, "lower");
    const double* high = checked_vector(upper, n_variables, "upper");
    for (int i = 0; i < n_variables; ++i) {
      if (!(low[i] < high[i]))
        throw Error("lower must be below upper; variable " + std::to_string(i) + " has " + to_text(low[i]) + " and " +
                    to_text(high[i]));
      if (std::isfinite(high[i])) bounds_.push_back({i, 1.0, high[i]});
      if (std::isfinite(low[i])) bounds_.push_back({i, -1.0, -low[i]});
    }
    RowMatrix B = RowMatrix::Zero(static_cast<Eigen::Index>(bounds_.size()), n_variables);
    for (std::size_t b = 0; b < bounds_.size(); ++b)
      B(static_cast<Eigen::Index>(b), bounds_[b].variable) = bounds_[b].sign;
    set_bound_normals(B);
  }

  void residual(const double* x, double* R) override {
    py::gil_scoped_acquire gil;
    call("residual", x, {equation_count()}, R);
  }

  void linearize(const double* x, double* R, double* J) override {
    py::gil_scoped_acquire gil;
    call("residual", x, {equation_count()}, R);
    call("jacobian", x, {equation_count(), tangent_size()}, J);
  }

  std::string bound_name(int i) const override {
    const Bound& bound = bounds_[static_cast<std::size_t>(i)];
    return std::string(bound.sign > 0.0 ? "upper" : "lower") + " bound of variable " + std::to_string(bound.variable);
  }

  void slack(const double* x, double* out) const override {
    for (std::size_t b = 0; b < bounds_.size(); ++b)
      out[b] = bounds_[b].limit - bounds_[b].sign * x[bounds_[b].variable];
  }

  /// sign x <= limit for one variable.
  struct Bound {
    int variable;
    double sign, limit;
  };
  const std::vector<Bound>& bounds() const { return bounds_; }

 private:
  void call(const char* method, const double* x, const std::vector<py::ssize_t>& shape, double* out) {
    const py::function function = py::get_override(this, method);
    if (!function) throw Error(std::string("a System needs a method ") + method + "(x)");
    const DoubleArray array = numbers(method, function(py::array_t<double>(configuration_size(), x)));
    bool fits = array.ndim() == static_cast<py::ssize_t>(shape.size());
    for (std::size_t i = 0; fits && i < shape.size(); ++i) fits = array.shape(static_cast<py::ssize_t>(i)) == shape[i];
    if (!fits)
      throw Error(std::string(method) + "(x) must return an array of shape " +
                  py::str(py::cast(shape)).cast<std::string>() + "; it returned shape " +
                  py::str(array.attr("shape")).cast<std::string>());
    std::copy_n(array.data(), array.size(), out);
  }

  /// What a method returned as numbers; an Error that says what it was when that would lose a part or invent one.
  static DoubleArray numbers(const char* method, const py::object& returned) {
    if (Py_TYPE(returned.ptr()) == py::detail::npy_api::get().PyArray_Type_ && py::isinstance<DoubleArray>(returned))
      return py::cast<DoubleArray>(returned);
    const py::array array = py::array::ensure(returned);
    const char kind = array ? array.dtype().kind() : 'O';
    std::string hint;
    if (kind == 'c')
      hint = "; take the real part";
    else if (is_masked(returned))
      hint = " with masked entries; fill them";
    else if (kind == 'b' || kind == 'i' || kind == 'u' || kind == 'f')
      return py::cast<DoubleArray>(array);
    else if (returned.is_none())
      hint = "; a return statement may be missing";
    throw Error(std::string(method) + "(x) must return real numbers; it returned " + kind_of(returned, kind) + hint);
  }

  /// What an object is, whose array is of this kind, in words.
  static std::string kind_of(const py::object& object, char kind) {
    if (kind == 'c') return "complex numbers";
    if (kind == 'U' || kind == 'S') return "text";
    if (object.is_none()) return "None";
    return "something of type " + py::type::of(object).attr("__name__").cast<std::string>();
  }

  /// True for a masked array with a masked entry, and for a list of such: as plain arrays they would have numbers
  /// there.
  static bool is_masked(const py::object& object) {
    if (py::isinstance<py::list>(object) || py::isinstance<py::tuple>(object)) {
      for (const py::handle item : object)
        if (!PyFloat_Check(item.ptr()) && is_masked(py::reinterpret_borrow<py::object>(item))) return true;
      return false;
    }
    return py::isinstance<py::array>(object) && py::module_::import("numpy.ma").attr("is_masked")(object).cast<bool>();
  }

  std::vector<Bound> bounds_;
};

/// Lower or upper bounds of all variables [n].
py::array_t<double> bounds_of(const PythonSystem& system, double sign) {
  std::vector<double> out(static_cast<std::size_t>(system.tangent_size()), sign * HUGE_VAL);
  for (const PythonSystem::Bound& bound : system.bounds())
    if (bound.sign == sign) out[static_cast<std::size_t>(bound.variable)] = sign * bound.limit;
  return py::array_t<double>(static_cast<py::ssize_t>(out.size()), out.data());
}

py::array_t<double> copied(const double* data, py::ssize_t rows, py::ssize_t columns) {
  auto out = matrix<double>(rows, columns);
  std::copy_n(data, rows * columns, out.mutable_data());
  return out;
}

py::array_t<double> vector(const std::vector<double>& values) {
  return py::array_t<double>(static_cast<py::ssize_t>(values.size()), values.data());
}

void bind_systems(py::module_& module) {
  py::class_<System, py::smart_holder>(module, "AnySystem", "Equations R(x) = 0 on a configuration space.")
      .def("__repr__",
           [](const py::object& self) {
             const System& s = self.cast<const System&>();
             return "<" + py::type::of(self).attr("__name__").cast<std::string>() + ": " +
                    std::to_string(s.tangent_size()) + " unknowns, " + std::to_string(s.equation_count()) +
                    " equations>";
           })
      .def_property_readonly("configuration_size", &System::configuration_size, "Numbers in a point x.")
      .def_property_readonly("tangent_size", &System::tangent_size, "Numbers in a tangent vector v.")
      .def_property_readonly("n_equations", &System::equation_count, "Numbers in R(x).")
      .def_property_readonly("dimension", &System::dimension, "k: tangent_size - n_equations.")
      .def_property_readonly(
          "bound_normals",
          [](const System& s) { return copied(s.bound_normals().data(), s.bound_count(), s.tangent_size()); },
          "B [n_bounds x tangent_size]: slack(x (+) v) = slack(x) - B v to first order.")
      .def(
          "evaluate_residual",
          [](System& s, const DoubleArray& x) {
            std::vector<double> R(s.equation_count());
            Lease(s)->residual(checked_vector(x, s.configuration_size(), "x"), R.data());
            return vector(R);
          },
          py::arg("x"), "R(x) [n_equations].")
      .def(
          "evaluate_jacobian",
          [](System& s, const DoubleArray& x) {
            std::vector<double> R(s.equation_count());
            auto J = matrix<double>(s.equation_count(), s.tangent_size());
            Lease(s)->linearize(checked_vector(x, s.configuration_size(), "x"), R.data(), J.mutable_data());
            return J;
          },
          py::arg("x"), "J(x) [n_equations x tangent_size], derivative of R(x (+) v) at v = 0.")
      .def(
          "integrate",
          [](const System& s, const DoubleArray& x, const DoubleArray& v) {
            std::vector<double> out(s.configuration_size());
            s.integrate(checked_vector(x, s.configuration_size(), "x"), checked_vector(v, s.tangent_size(), "v"),
                        out.data());
            return vector(out);
          },
          py::arg("x"), py::arg("v"), "x (+) v [configuration_size].")
      .def(
          "difference",
          [](const System& s, const DoubleArray& x0, const DoubleArray& x1) {
            std::vector<double> out(s.tangent_size());
            s.difference(checked_vector(x0, s.configuration_size(), "x0"),
                         checked_vector(x1, s.configuration_size(), "x1"), out.data());
            return vector(out);
          },
          py::arg("x0"), py::arg("x1"), "x1 (-) x0 [tangent_size].")
      .def("differences", &differences, py::arg("X0"), py::arg("X1"),
           "x1 (-) x0 of n pairs of points [n x tangent_size], each a row of X0 and X1 [n x configuration_size].")
      .def(
          "same_point",
          [](const System& s, const DoubleArray& x0, const DoubleArray& x1, double tolerance) {
            return s.same_point(checked_vector(x0, s.configuration_size(), "x0"),
                                checked_vector(x1, s.configuration_size(), "x1"), tolerance);
          },
          py::arg("x0"), py::arg("x1"), py::arg("tolerance"),
          "True when two points are one, to within a tolerance [units of the tangent space].")
      .def(
          "embed",
          [](const System& s, const DoubleArray& x) {
            std::vector<double> out(s.embedding_size());
            s.embed(checked_vector(x, s.configuration_size(), "x"), out.data());
            return vector(out);
          },
          py::arg("x"), "Euclidean image of x, by which charts are looked up.")
      .def(
          "slack",
          [](const System& s, const DoubleArray& x) {
            std::vector<double> out(s.bound_count());
            s.slack(checked_vector(x, s.configuration_size(), "x"), out.data());
            return vector(out);
          },
          py::arg("x"), "Distance of x from each bound; negative outside.");
  py::class_<PythonSystem, System, py::smart_holder>(module, "PythonSystem", "Base of systems written in Python.")
      .def(py::init<int, int, const DoubleArray&, const DoubleArray&>(), py::arg("n_variables"), py::arg("n_equations"),
           py::arg("lower"), py::arg("upper"))
      .def("__reduce__", by_arguments<PythonSystem>([](const PythonSystem& s) {
             return py::make_tuple(s.tangent_size(), s.equation_count(), bounds_of(s, -1.0), bounds_of(s, 1.0));
           }));
  py::class_<Sphere, System, py::smart_holder>(module, "Sphere", "The unit sphere in R^n.")
      .def(py::init<int>(), py::arg("n"))
      .def("__reduce__", by_arguments<Sphere>([](const Sphere& s) { return py::make_tuple(s.tangent_size()); }));
  py::class_<Torus, System, py::smart_holder>(module, "Torus", "A torus in R^3.")
      .def(py::init<double, double>(), py::arg("major_radius"), py::arg("minor_radius"))
      .def("__reduce__",
           by_arguments<Torus>([](const Torus& s) { return py::make_tuple(s.major_radius(), s.minor_radius()); }));
  py::class_<Angles, System, py::smart_holder>(module, "Angles", "n angles, no equation.")
      .def(py::init<int>(), py::arg("n"))
      .def("__reduce__", by_arguments<Angles>([](const Angles& s) { return py::make_tuple(s.tangent_size()); }));
  py::class_<Rotations, System, py::smart_holder>(module, "Rotations", "All rotations, no equation.")
      .def(py::init<>())
      .def("__reduce__", by_arguments<Rotations>([](const Rotations&) { return py::make_tuple(); }));
}

py::array_t<double> vertices_of(double half_width, const DoubleArray& normals, const DoubleArray& offsets) {
  if (normals.ndim() != 2) throw Error("normals must be of shape (m, k)");
  const auto m = normals.shape(0), k = normals.shape(1);
  const double* offset = checked_vector(offsets, m, "offsets");
  if (!std::all_of(offset, offset + m, [](double o) { return o >= 0.0; })) throw Error("offsets must not be negative");
  Polytope polytope(static_cast<int>(k), half_width);
  Polytope::Scratch scratch;
  for (py::ssize_t i = 0; i < m; ++i) polytope.cut(normals.data() + i * k, offset[i], static_cast<int>(i), scratch);
  return copied(polytope.vertex(0), polytope.vertex_count(), k);
}

void bind_parts(py::module_& module) {
  py::class_<Polytope> polytope(module, "Polytope", "A convex polytope in R^k: a box, cut by half-spaces.");
  polytope.attr("BOX_TAG") = Polytope::kBoxTag;
  polytope.def_static("bound_tag", &Polytope::bound_tag, py::arg("bound"), "Tag of the facets that a bound makes.")
      .def_static("bound_of_tag", &Polytope::bound_of, py::arg("tag"), "The bound whose facets have a tag below -1.")
      .def(py::init([](int dimension, double half_width, bool outer) {
             return Polytope(dimension, half_width, outer ? Polytope::Listed::outer : Polytope::Listed::all);
           }),
           py::arg("dimension"), py::arg("half_width"), py::arg("outer") = false,
           "The box [-half_width, half_width]^dimension; with `outer`, vertices outside a ball alone are listed.")
      .def(
          "cut",
          [](Polytope& p, const DoubleArray& normal, double offset, int tag) {
            const double* n = checked_vector(normal, p.dimension(), "normal");
            if (!(offset >= 0.0)) throw Error("offset must not be negative: a polytope keeps the origin");
            Polytope::Scratch scratch;
            return p.cut(n, offset, tag, scratch);
          },
          py::arg("normal"), py::arg("offset"), py::arg("tag"),
          "Keep normal . u <= offset; False if nothing is cut off.")
      .def(
          "contains",
          [](const Polytope& p, const DoubleArray& u, double tolerance) {
            return p.contains(checked_vector(u, p.dimension(), "u"), tolerance);
          },
          py::arg("u"), py::arg("tolerance") = 0.0, "True when u is inside all half-spaces.")
      .def(
          "expandable_vertex",
          [](Polytope& p, double radius) {
            Polytope::Scratch scratch;
            return p.expandable_vertex(radius, scratch);
          },
          py::arg("radius"),
          "Index of the farthest vertex outside the ball that was not closed, or -1; where `outer` vertices are listed "
          "this lists them first: all of them if they are closed.")
      .def(
          "close",
          [](Polytope& p, int vertex) {
            if (vertex < 0 || vertex >= p.vertex_count()) throw Error("there is no vertex " + std::to_string(vertex));
            p.close(vertex, 1);
          },
          py::arg("vertex"), "The vertex is not to be expanded.")
      .def_property_readonly(
          "vertices", [](const Polytope& p) { return copied(p.vertex(0), p.vertex_count(), p.dimension()); },
          "Vertices [n x k].");
  polytope.def_static(
      "lists_all", [](int dimension) { return listed_vertices(dimension) == Polytope::Listed::all; },
      py::arg("dimension"), "Whether the polytopes of an atlas of this dimension list all vertices.");
  polytope.def_static("vertices_of", &vertices_of, py::arg("half_width"), py::arg("normals"), py::arg("offsets"),
                      "Vertices [n x k] of a box that half-spaces cut: unit normals [m x k], offsets [m].");
  py::class_<Neighbours>(module, "Neighbours", "Points that come one by one, and those within a distance of any point.")
      .def(py::init<int>(), py::arg("size"))
      .def(
          "insert",
          [](Neighbours& t, const DoubleArray& point) {
            t.insert(checked_vector(point, t.size(), "point"), t.count());
          },
          py::arg("point"), "Add a point [size]; points are numbered 0, 1, 2, ... as they come.")
      .def(
          "within",
          [](const Neighbours& t, const DoubleArray& point, double distance) {
            std::vector<int> out;
            Neighbours::Scratch scratch;
            t.within(checked_vector(point, t.size(), "point"), distance, out, scratch);
            std::sort(out.begin(), out.end());
            return out;
          },
          py::arg("point"), py::arg("distance"),
          "Numbers of the points within a distance, and maybe of some farther by a millionth of how far the points are "
          "from "
          "the first one, ascending.");
}

/// Rows that did not get there are left where the method ended.
py::typing::Tuple<py::array_t<double>, py::array_t<bool>> project_far(System& system, const DoubleArray& X) {
  const py::ssize_t n = X.ndim() == 2 ? X.shape(0) : 0, size = system.configuration_size();
  if (X.ndim() != 2 || X.shape(1) != size)
    throw Error("X must have " + std::to_string(size) + " columns, one row for each point");
  py::array_t<double> out = matrix<double>(n, size);
  py::array_t<bool> there(n);
  double* x = out.mutable_data();
  bool* flags = there.mutable_data();
  std::copy_n(X.data(), n * size, x);
  const bool clones = system.clone() != nullptr;
  const auto work = [&](int, std::int64_t first, std::int64_t last) {
    const Lease own(system);
    FarProjection projection(*own);
    for (std::int64_t row = first; row < last; ++row) flags[row] = projection.project(x + row * size);
  };
  if (clones) {
    const py::gil_scoped_release release;
    parallel_for(n > 1 ? available_threads() : 1, n, work);
  } else {
    work(0, 0, n);
  }
  return py::make_tuple(out, there);
}

}  // namespace

void bind_continuation(py::module_& module) {
  bind_systems(module);
  bind_parts(module);
  module.def("available_threads", &available_threads, "Cores that this process may use.");
  module.def(
      "project",
      [](System& system, const DoubleArray& x, const DoubleArray& Phi, const DoubleArray& u) {
        const int n = system.tangent_size(), k = system.dimension();
        const double* center = checked_vector(x, system.configuration_size(), "x");
        if (Phi.ndim() != 2 || Phi.shape(0) != k || Phi.shape(1) != n)
          throw Error("the tangent basis must have shape (" + std::to_string(k) + ", " + std::to_string(n) + ")");
        const double* coordinates = checked_vector(u, k, "u");
        std::vector<double> step(n, 0.0), out(system.configuration_size());
        for (int a = 0; a < k; ++a)
          for (int c = 0; c < n; ++c) step[c] += coordinates[a] * Phi.data()[static_cast<py::ssize_t>(a) * n + c];
        system.integrate(center, step.data(), out.data());
        const Lease own(system);
        Newton newton(*own);
        if (newton.project(out.data(), Phi.data()) != Projection::converged) return py::object(py::none());
        return py::object(vector(out));
      },
      py::arg("system"), py::arg("x"), py::arg("Phi"), py::arg("u"),
      "Point of the manifold above u in the tangent space at x (eqs 14 and 15); None when Newton does not "
      "converge.");
  module.def(
      "project_far", &project_far, py::arg("system"), py::arg("X"),
      "Points X [n x configuration_size], which may be far off, moved to the manifold and within the bounds; and "
      "whether each got there [n]. See manifold/far_projection.hpp.");
}

}  // namespace graspatlas
