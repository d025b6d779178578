#include <pybind11/eigen.h>
#include <pybind11/functional.h>
#include <pybind11/stl.h>

#include <chrono>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bindings.hpp"
#include "graspatlas/climb/climb_batch.hpp"
#include "graspatlas/climb/holding_measures.hpp"
#include "graspatlas/climb/index_measures.hpp"
#include "graspatlas/climb/requirement_measures.hpp"
#include "graspatlas/climb/wrench_measures.hpp"
#include "graspatlas/clock.hpp"
#include "graspatlas/collision/collision_batch.hpp"
#include "graspatlas/errors.hpp"
#include "graspatlas/parallel.hpp"

namespace py = pybind11;

namespace graspatlas {

namespace {

using EndTable = py::typing::Dict<py::str, py::object>;
using PythonFunction = py::typing::Callable<py::array(py::array)>;
/// Of one grasp [1 x configuration_size]: a function of grasps near it that returns rows of numbers.
using NearFunction = py::typing::Callable<PythonFunction(py::array)>;

AxesIndex axes_index_from(const std::string& name) {
  if (name == "volume") return AxesIndex::volume;
  if (name == "inverse_condition_number") return AxesIndex::inverse_condition_number;
  if (name == "smallest") return AxesIndex::smallest;
  throw Error("what is read off semi-axes is 'volume', 'inverse_condition_number' or 'smallest', not '" + name + "'");
}

const char* name_of(ClimbStatus status) {
  switch (status) {
    case ClimbStatus::converged:
      return "converged";
    case ClimbStatus::stalled:
      return "stalled";
    case ClimbStatus::given_up:
      return "given up";
    default:
      return "not met";
  }
}

py::array_t<double> copied_rows(const RowMatrix& X) {
  py::array_t<double> rows = matrix<double>(X.rows(), X.cols());
  std::copy_n(X.data(), X.size(), rows.mutable_data());
  return rows;
}

/// What a function of grasps [n x configuration_size] returns, checked: n rows of numbers; one a row for `flat` ones.
RowMatrix asked(const py::object& function, const RowMatrix& X, bool flat) {
  const DoubleArray values = DoubleArray::ensure(function(copied_rows(X)));
  if (!values || values.ndim() != (flat ? 1 : 2) || values.shape(0) != X.rows())
    throw Error("a function of " + std::to_string(X.rows()) + " grasps must return " + (flat ? "a number" : "a row") +
                " for each");
  return Eigen::Map<const RowMatrix>(values.data(), X.rows(), flat ? 1 : values.shape(1));
}

/// A function of Python that may be kept and let go of by threads that do not hold the GIL.
std::shared_ptr<py::object> kept(const py::object& function) {
  return {new py::object(function), [](py::object* object) {
            const py::gil_scoped_acquire acquire;
            delete object;
          }};
}

RowsFunction rows_function(const py::object& function, bool flat) {
  return [function = kept(function), flat](const RowMatrix& X) {
    const py::gil_scoped_acquire acquire;
    return asked(*function, X, flat);
  };
}

MeasureRecipe axes_recipe(const std::string& index, int connectivity, double length_unit) {
  const AxesIndex kind = axes_index_from(index);
  return {[=](GraspSystem& system) { return std::make_unique<AxesMeasure>(system, kind, connectivity, length_unit); }};
}

MeasureRecipe closure_recipe(double friction, double torsional, double margin) {
  return {[=](GraspSystem& system) { return std::make_unique<ClosureMeasure>(system, friction, torsional, margin); }};
}

MeasureRecipe closure_index_recipe(double friction) {
  return closure_recipe(friction, 0.0, -kInside);  // no margin at all
}

MeasureRecipe holding_recipe(const HoldingLimits& limits, double at_least) {
  return {[=](GraspSystem& system) { return std::make_unique<HoldingMeasure>(system, limits, at_least); }};
}

MeasureRecipe holding_index_recipe(const HoldingLimits& limits) {
  return {[=](GraspSystem& system) { return std::make_unique<HoldingIndex>(system, limits); }};
}

MeasureRecipe epsilon_recipe(double friction, int edges, double torsional, double length) {
  return {[pyramids = Pyramids{friction, edges, torsional, length}](GraspSystem& system) -> std::unique_ptr<Measure> {
    if (system.object_joint().space_dimension() == 2) return std::make_unique<EpsilonMeasure<3>>(system, pyramids);
    return std::make_unique<EpsilonMeasure<6>>(system, pyramids);
  }};
}

MeasureRecipe centrality_recipe(int joints) {
  return {[=](GraspSystem& system) { return std::make_unique<CentralityMeasure>(system, joints); }};
}

MeasureRecipe joint_margin_recipe(double distance) {
  return {[=](GraspSystem& system) { return std::make_unique<JointMarginMeasure>(system, distance); }};
}

MeasureRecipe distances_recipe(const std::shared_ptr<CollisionBatch>& batch) {
  return {[scene = batch->shared_scene()](GraspSystem& system) {
    return std::make_unique<DistancesMeasure>(scene, system.length_scale());
  }};
}

MeasureRecipe numbers_recipe(const PythonFunction& values) {
  return {[rows = rows_function(values, true)](GraspSystem& system) {
            return std::make_unique<BatchMeasure>(system, [rows](const RowMatrix&) { return rows; });
          },
          false};
}

MeasureRecipe slacks_recipe(const NearFunction& near) {
  return {[near = kept(near)](GraspSystem& system) {
            return std::make_unique<BatchMeasure>(system, [near](const RowMatrix& x) {
              const py::gil_scoped_acquire acquire;
              return rows_function((*near)(copied_rows(x)), false);
            });
          },
          false};
}

MeasureRecipe test_recipe(const PythonFunction& met) {
  return {[rows = rows_function(met, true)](GraspSystem& system) {
            return std::make_unique<TestMeasure>([rows, size = system.configuration_size()](const double* x) {
              return rows(Eigen::Map<const Eigen::RowVectorXd>(x, size))(0, 0) != 0.0;
            });
          },
          false};
}

/// The ends of the climbs as arrays, one row or number each; `values` is a list of arrays.
EndTable table_of(const std::vector<ClimbEnd>& ends, int size) {
  const auto n = static_cast<py::ssize_t>(ends.size());
  py::array_t<double> x = matrix<double>(n, size), value(n), missed(n), kkt(n);
  py::array_t<int> evaluations(n);
  py::list statuses, values;
  for (py::ssize_t i = 0; i < n; ++i) {
    const ClimbEnd& end = ends[static_cast<std::size_t>(i)];
    std::copy_n(end.x.data(), size, x.mutable_data(i, 0));
    value.mutable_at(i) = end.value;
    missed.mutable_at(i) = end.missed;
    kkt.mutable_at(i) = end.kkt;
    evaluations.mutable_at(i) = end.evaluations;
    statuses.append(name_of(end.status));
    values.append(py::array_t<double>(static_cast<py::ssize_t>(end.values.size()), end.values.data()));
  }
  EndTable table;
  table["x"] = x;
  table["value"] = value;
  table["missed"] = missed;
  table["kkt"] = kkt;
  table["evaluations"] = evaluations;
  table["status"] = statuses;
  table["values"] = values;
  return table;
}

/// X, checked: rows of a system's size.
void check_rows(const GraspSystem& system, const DoubleArray& X) {
  if (X.ndim() != 2 || X.shape(1) != system.configuration_size())
    throw Error("X must have " + std::to_string(system.configuration_size()) + " columns, one row for each grasp");
}

/// work(on) without the GIL; `on` is false after so many seconds, or after Ctrl-C, which then is raised.
template <class Work>
void until(std::optional<double> max_seconds, const Work& work) {
  const Clock::time_point start = Clock::now();
  Clock::time_point looked = start;
  bool interrupted = false;
  const auto on = [&] {
    const Clock::time_point now = Clock::now();
    if (max_seconds && std::chrono::duration<double>(now - start).count() > *max_seconds) return false;
    if (interrupted || now - looked < std::chrono::milliseconds(50)) return !interrupted;
    looked = now;
    const py::gil_scoped_acquire acquire;
    interrupted = PyErr_CheckSignals() != 0;
    return !interrupted;
  };
  {
    const py::gil_scoped_release release;
    work(on);
  }
  if (interrupted) throw py::error_already_set();
}

EndTable climbs(GraspSystem& system, const DoubleArray& X, const MeasureRecipe& index,
                const std::vector<MeasureRecipe>& requirements, double trust_radius, int max_steps,
                std::optional<double> max_seconds, std::optional<int> threads) {
  check_rows(system, X);
  if (!(trust_radius > 0.0) || !std::isfinite(trust_radius))
    throw Error("trust_radius must be positive, got " + to_text(trust_radius));
  std::vector<ClimbEnd> ends;
  until(max_seconds, [&](const auto& on) {
    ends = climb_all(system, X.data(), X.shape(0), index, requirements, {trust_radius, max_steps},
                     threads.value_or(available_threads()), on);
  });
  return table_of(ends, system.configuration_size());
}

/// Rows of a measure at one grasp on the manifold, for tests; see climb/measure.hpp.
ArrayTable measured(GraspSystem& system, const DoubleArray& x, const MeasureRecipe& recipe, double reach) {
  if (x.size() != system.configuration_size())
    throw Error("x must hold " + std::to_string(system.configuration_size()) + " numbers");
  const int k = system.dimension(), n = system.tangent_size();
  std::vector<double> on(x.data(), x.data() + x.size());
  py::array_t<double> Phi = matrix<double>(k, n);
  if (Newton(system).project_freely(on.data(), Phi.mutable_data()) != Projection::converged)
    throw Error("the grasp cannot be projected onto the manifold; take one that is on it");
  Surroundings at(system);
  at.set(on.data(), Phi.data());
  Rows rows(k);
  recipe.make(system)->linearize(at, reach, rows);
  py::array_t<double> ids(rows.size()), values(rows.size()), slopes = matrix<double>(rows.size(), k);
  for (int row = 0; row < rows.size(); ++row) {
    ids.mutable_at(row) = rows.id(row);
    values.mutable_at(row) = rows.value(row);
    std::copy_n(rows.slopes(row), k, slopes.mutable_data(row, 0));
  }
  ArrayTable table;
  table["x"] = py::array_t<double>(x.size(), on.data());
  table["ids"] = ids;
  table["values"] = values;
  table["slopes"] = slopes;
  table["Phi"] = Phi;
  return table;
}

py::array_t<double> missed(GraspSystem& system, const DoubleArray& X, const std::vector<MeasureRecipe>& requirements) {
  check_rows(system, X);
  std::vector<double> found;
  until(std::nullopt, [&](const auto& on) {
    found = missed_by_all(system, X.data(), X.shape(0), requirements, available_threads(), on);
  });
  return py::array_t<double>(static_cast<py::ssize_t>(found.size()), found.data());
}

}  // namespace

void bind_climb(py::module_& module) {
  py::class_<MeasureRecipe>(module, "Measure", "An index or requirement that climbs follow; see climb/measure.hpp.")
      .def_readonly("any_thread", &MeasureRecipe::any_thread, "False where it asks Python.");
  module.def("axes_measure", &axes_recipe, py::arg("index"), py::arg("connectivity"), py::arg("length_unit"),
             "An index of the manipulability ellipsoid; see climb/index_measures.hpp.");
  module.def("closure_measure", &closure_recipe, py::arg("friction"), py::arg("torsional") = 0.0,
             py::arg("margin") = 0.0, "The force-closure margin beyond one that is asked for.");
  module.def("closure_index_measure", &closure_index_recipe, py::arg("friction"),
             "The force-closure margin as an index, with its sign.");
  module.def("holding_measure", &holding_recipe, py::arg("limits"), py::arg("at_least"),
             "The holding force as a multiple of one that is asked for, less one; see climb/holding_measures.hpp.");
  module.def("holding_index_measure", &holding_index_recipe, py::arg("limits"), "The holding force as an index.");
  module.def("epsilon_measure", &epsilon_recipe, py::arg("friction"), py::arg("edges"), py::arg("torsional"),
             py::arg("length"),
             "Radius of the largest ball in the hull of contact wrenches; see climb/wrench_measures.hpp.");
  module.def("centrality_measure", &centrality_recipe, py::arg("joints"),
             "How near the joints are to the middle of their ranges; `joints` is how many the hand has.");
  module.def("joint_margin_measure", &joint_margin_recipe, py::arg("distance"),
             "Distances of the joints from their limits beyond one that is asked for.");
  module.def("distances_measure", &distances_recipe, py::arg("batch"), "Distances of hand and object.");
  module.def("numbers_measure", &numbers_recipe, py::arg("values"),
             "An index that is a function of grasps [n x configuration_size] that returns numbers [n].");
  module.def(
      "slacks_measure", &slacks_recipe, py::arg("near"),
      "A requirement's slacks: a function of one grasp [1 x configuration_size] that returns a function of grasps "
      "near it [n x configuration_size], which returns slacks [n x c].");
  module.def("test_measure", &test_recipe, py::arg("met"),
             "A requirement that is a function of grasps [n x configuration_size] that returns flags [n].");
  module.def(
      "climbs", &climbs, py::arg("system"), py::arg("X"), py::arg("index"), py::arg("requirements"),
      py::arg("trust_radius"), py::arg("max_steps"), py::arg("max_seconds") = py::none(),
      py::arg("threads") = py::none(),
      "Climbs from each grasp of X [n x configuration_size] to a local maximum of the index within bounds and "
      "requirements: ends x [n x configuration_size], value, missed, kkt and evaluations [n], and lists of status "
      "and of values. See climb/climber.hpp.");
  module.def("measured", &measured, py::arg("system"), py::arg("x"), py::arg("measure"), py::arg("reach"),
             "Rows of a measure at a grasp, projected onto the manifold as x: their ids and values [r], slopes "
             "[r x dimension] along the tangent basis Phi [dimension x tangent_size]. See climb/measure.hpp.");
  module.def("missed", &missed, py::arg("system"), py::arg("X"), py::arg("requirements"),
             "By how much each grasp of X misses the requirement that it misses most, in about units of the tangent "
             "space [n]; infinite where a requirement that is met or not is not met.");
}

}  // namespace graspatlas
