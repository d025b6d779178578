#include <pybind11/stl.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>

#include "bindings.hpp"
#include "graspatlas/continuation/atlas.hpp"
#include "graspatlas/continuation/toy_systems.hpp"

namespace py = pybind11;

namespace graspatlas {

namespace {

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

 private:
  struct Bound {
    int variable;
    double sign, limit;
  };

  void call(const char* method, const double* x, const std::vector<py::ssize_t>& shape, double* out) {
    const py::function function = py::get_override(this, method);
    if (!function) throw Error(std::string("a System needs a method ") + method + "(x)");
    const auto array = py::cast<DoubleArray>(function(py::array_t<double>(configuration_size(), x)));
    bool fits = array.ndim() == static_cast<py::ssize_t>(shape.size());
    for (std::size_t i = 0; fits && i < shape.size(); ++i) fits = array.shape(static_cast<py::ssize_t>(i)) == shape[i];
    if (!fits)
      throw Error(std::string(method) + "(x) must return an array of shape " +
                  py::str(py::cast(shape)).cast<std::string>() + "; it returned shape " +
                  py::str(array.attr("shape")).cast<std::string>());
    std::copy_n(array.data(), array.size(), out);
  }

  std::vector<Bound> bounds_;
};

template <class T>
py::array_t<T> matrix(py::ssize_t rows, py::ssize_t columns) {
  return py::array_t<T>(std::vector<py::ssize_t>{rows, columns});
}

py::array_t<double> copied(const double* data, py::ssize_t rows, py::ssize_t columns) {
  auto out = matrix<double>(rows, columns);
  std::copy_n(data, rows * columns, out.mutable_data());
  return out;
}

/// The whole atlas as arrays; ragged parts (facets, vertices) as values and row offsets.
ArrayTable atlas_arrays(const Atlas& atlas) {
  const py::ssize_t n = atlas.count(), k = atlas.system().dimension(), v = atlas.system().tangent_size();
  py::ssize_t facets = 0, vertices = 0, pair_count = 0;
  for (py::ssize_t i = 0; i < n; ++i) {
    const Polytope& p = atlas.chart(i).polytope;
    for (int f = 0; f < p.facet_slots(); ++f) facets += p.facet_active(f);
    vertices += p.vertex_count();
    pair_count += atlas.chart(i).neighbour_count;
  }
  const py::ssize_t x_size = atlas.system().configuration_size();
  auto centers = matrix<double>(n, x_size);
  auto bases = py::array_t<double>(std::vector<py::ssize_t>{n, k, v});
  auto residuals = py::array_t<double>(n);
  auto facet_start = py::array_t<std::int64_t>(n + 1), vertex_start = py::array_t<std::int64_t>(n + 1);
  auto normals = matrix<double>(facets, k), positions = matrix<double>(vertices, k);
  auto offsets = py::array_t<double>(facets);
  auto tags = py::array_t<std::int32_t>(facets);
  auto closed = py::array_t<std::uint8_t>(vertices);
  py::ssize_t f_at = 0, v_at = 0;
  for (py::ssize_t i = 0; i < n; ++i) {
    std::copy_n(atlas.center(i), x_size, centers.mutable_data(i, 0));
    std::copy_n(atlas.basis(i), k * v, bases.mutable_data(i, 0, 0));
    residuals.mutable_at(i) = atlas.chart(i).residual;
    facet_start.mutable_at(i) = f_at;
    vertex_start.mutable_at(i) = v_at;
    const Polytope& p = atlas.chart(i).polytope;
    for (int f = 0; f < p.facet_slots(); ++f) {
      if (!p.facet_active(f)) continue;
      std::copy_n(p.normal(f), k, normals.mutable_data(f_at, 0));
      offsets.mutable_at(f_at) = p.offset(f);
      tags.mutable_at(f_at++) = p.tag(f) >= 0 ? atlas.number(p.tag(f)) : p.tag(f);
    }
    for (int a = 0; a < p.vertex_count(); ++a) {
      std::copy_n(p.vertex(a), k, positions.mutable_data(v_at, 0));
      closed.mutable_at(v_at++) = p.state(a);
    }
  }
  facet_start.mutable_at(n) = f_at;
  vertex_start.mutable_at(n) = v_at;
  auto pairs = matrix<std::int32_t>(pair_count, 2);
  std::int32_t* pair = pairs.mutable_data();
  for (py::ssize_t j = 0; j < n; ++j) {
    const Chart& chart = atlas.chart(j);
    for (int c = 0; c < chart.neighbour_count; ++c) {
      *pair++ = atlas.number(chart.neighbours[c]);
      *pair++ = static_cast<std::int32_t>(j);
    }
  }
  ArrayTable out;
  out["centers"] = centers;
  out["bases"] = bases;
  out["residuals"] = residuals;
  out["facet_start"] = facet_start;
  out["facet_normals"] = normals;
  out["facet_offsets"] = offsets;
  out["facet_tags"] = tags;
  out["vertex_start"] = vertex_start;
  out["vertices"] = positions;
  out["vertex_closed"] = closed;
  out["neighbour_pairs"] = pairs;
  return out;
}

template <class T>
void read_array(const ArrayTable& table, const char* name, std::vector<T>& out) {
  if (!table.contains(name)) throw Error(std::string("the checkpoint lacks the array '") + name + "'");
  const auto array = py::cast<py::array_t<T, py::array::c_style | py::array::forcecast>>(table[name]);
  out.assign(array.data(), array.data() + array.size());
}

/// The parts of a checkpoint by name.
template <class Table, class Visit>
void visit_checkpoint(Table& table, const Visit& visit) {
  visit("centers", table.centers);
  visit("bases", table.bases);
  visit("residuals", table.residuals);
  visit("keys", table.keys);
  visit("closed_charts", table.closed_charts);
  visit("closed_vertices", table.closed_vertices);
  visit("closed_reasons", table.closed_reasons);
  visit("generation", table.generation);
  visit("again", table.again);
}

Checkpoint read_checkpoint(const ArrayTable& table) {
  Checkpoint out;
  visit_checkpoint(out, [&table](const char* name, auto& part) { read_array(table, name, part); });
  std::vector<std::int64_t> counts;
  read_array(table, "counts", counts);
  if (counts.size() != 3) throw Error("the checkpoint's counts must be three");
  out.position = counts[0];
  out.next_first = counts[1];
  out.task_count = counts[2];
  return out;
}

ArrayTable write_checkpoint(const Checkpoint& checkpoint) {
  ArrayTable out;
  visit_checkpoint(checkpoint, [&out](const char* name, const auto& part) {
    out[name] = py::array_t<typename std::decay_t<decltype(part)>::value_type>(static_cast<py::ssize_t>(part.size()),
                                                                               part.data());
  });
  const std::int64_t counts[] = {checkpoint.position, checkpoint.next_first, checkpoint.task_count};
  out["counts"] = py::array_t<std::int64_t>(3, counts);
  return out;
}

py::array_t<double> vector(const std::vector<double>& values) {
  return py::array_t<double>(static_cast<py::ssize_t>(values.size()), values.data());
}

void bind_systems(py::module_& module) {
  py::class_<System, py::smart_holder>(module, "AnySystem", "Equations R(x) = 0 on a configuration space.")
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
            s.residual(checked_vector(x, s.configuration_size(), "x"), R.data());
            return vector(R);
          },
          py::arg("x"), "R(x) [n_equations].")
      .def(
          "evaluate_jacobian",
          [](System& s, const DoubleArray& x) {
            std::vector<double> R(s.equation_count());
            auto J = matrix<double>(s.equation_count(), s.tangent_size());
            s.linearize(checked_vector(x, s.configuration_size(), "x"), R.data(), J.mutable_data());
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
           py::arg("lower"), py::arg("upper"));
  py::class_<Sphere, System, py::smart_holder>(module, "Sphere", "The unit sphere in R^n.")
      .def(py::init<int>(), py::arg("n"));
  py::class_<Torus, System, py::smart_holder>(module, "Torus", "A torus in R^3.")
      .def(py::init<double, double>(), py::arg("major_radius"), py::arg("minor_radius"));
  py::class_<Angles, System, py::smart_holder>(module, "Angles", "n angles, no equation.")
      .def(py::init<int>(), py::arg("n"));
  py::class_<Rotations, System, py::smart_holder>(module, "Rotations", "All rotations, no equation.").def(py::init<>());
}

void bind_parts(py::module_& module) {
  py::class_<Polytope>(module, "Polytope", "A convex polytope in R^k: a box, cut by half-spaces.")
      .def(py::init<int, double>(), py::arg("dimension"), py::arg("half_width"))
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
      .def_property_readonly(
          "vertices", [](const Polytope& p) { return copied(p.vertex(0), p.vertex_count(), p.dimension()); },
          "Vertices [n x k].");
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
          py::arg("point"), py::arg("distance"), "Numbers of the points within a distance, ascending.");
}

}  // namespace

void bind_continuation(py::module_& module) {
  bind_systems(module);
  bind_parts(module);
  py::class_<Atlas>(module, "AtlasBuilder", "Grows an atlas chart by chart (Algorithm 1, lines 4 to 13).")
      .def(py::init([](System& system, const DoubleArray& x0, double radius, double epsilon, int threads) {
             AtlasOptions options;
             options.radius = radius;
             options.epsilon = epsilon;
             return std::make_unique<Atlas>(system, checked_vector(x0, system.configuration_size(), "x0"), options,
                                            threads);
           }),
           py::arg("system"), py::arg("x0"), py::arg("radius"), py::arg("epsilon"), py::arg("threads") = 1,
           py::keep_alive<1, 2>())
      .def_static(
          "resume",
          [](System& system, const ArrayTable& saved, double radius, double epsilon, int threads) {
            AtlasOptions options;
            options.radius = radius;
            options.epsilon = epsilon;
            const Checkpoint checkpoint = read_checkpoint(saved);
            const py::gil_scoped_release release;
            return std::make_unique<Atlas>(system, checkpoint, options, threads);
          },
          py::arg("system"), py::arg("saved"), py::arg("radius"), py::arg("epsilon"), py::arg("threads") = 1,
          py::keep_alive<0, 1>(), "Goes on from what `save` returned, with all charts, to the same atlas.")
      .def(
          "save", [](const Atlas& atlas, std::int64_t first) { return write_checkpoint(atlas.save(first)); },
          py::arg("first") = 0, "All that is needed to go on later, as arrays, with the charts from `first` on.")
      .def("expand", &Atlas::expand, py::arg("chart_limit"), py::arg("seconds"),
           py::call_guard<py::gil_scoped_release>(),
           "Expand until complete, the limit of charts is reached, or the seconds have passed.")
      .def_property_readonly("complete", &Atlas::complete, "True when no chart is left to expand.")
      .def_property_readonly("n_open", &Atlas::open_count, "Charts still to be expanded.")
      .def_property_readonly("n_charts", &Atlas::count, "Charts so far.")
      .def_property_readonly("n_threads", &Atlas::threads, "Threads that it uses.")
      .def_property_readonly("n_bytes", &Atlas::bytes, "Memory that it holds.")
      .def_property_readonly("n_array_bytes", &Atlas::array_bytes, "Memory that its arrays would take, at most.")
      .def_property_readonly("n_projections", &Atlas::projections, "Newton projections so far.")
      .def("arrays", &atlas_arrays, "The atlas as a dictionary of arrays.");
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
        Newton newton(system, NewtonOptions());
        if (newton.project(out.data(), Phi.data()) != Projection::converged) return py::object(py::none());
        return py::object(vector(out));
      },
      py::arg("system"), py::arg("x"), py::arg("Phi"), py::arg("u"),
      "Point of the manifold above u in the tangent space at x (eqs 14 and 15); None when Newton does not "
      "converge.");
}

}  // namespace graspatlas
