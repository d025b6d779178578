#include "graspatlas/atlas/atlas.hpp"

#include <pybind11/stl.h>

#include <memory>
#include <string>
#include <vector>

#include "bindings.hpp"
#include "graspatlas/atlas/flat_atlas.hpp"
#include "graspatlas/errors.hpp"

namespace py = pybind11;

namespace graspatlas {

namespace {

/// The whole atlas as arrays; ragged parts (facets, vertices) as values and row offsets. `fill` copies or moves it
/// there.
template <class AnyAtlas>
ArrayTable atlas_arrays(AnyAtlas& atlas, void (*fill)(AnyAtlas&, const FlatStarts&, const FlatAtlas&)) {
  const py::ssize_t n = atlas.count(), k = atlas.system().dimension(), v = atlas.system().tangent_size();
  py::array_t<std::int64_t> facet_start(n + 1), vertex_start(n + 1), neighbour_start(n + 1);
  const FlatStarts starts{facet_start.mutable_data(), vertex_start.mutable_data(), neighbour_start.mutable_data()};
  {
    const py::gil_scoped_release release;
    write_starts(atlas, starts);
  }
  auto centers = matrix<double>(n, atlas.system().configuration_size());
  auto bases = py::array_t<double>(std::vector<py::ssize_t>{n, k, v});
  auto residuals = py::array_t<double>(n), regularities = py::array_t<double>(n);
  auto nearly_singular = py::array_t<bool>(n);
  auto normals = matrix<double>(starts.facets[n], k), vertices = matrix<double>(starts.vertices[n], k);
  auto offsets = py::array_t<double>(starts.facets[n]);
  auto tags = py::array_t<std::int32_t>(starts.facets[n]);
  auto closed = py::array_t<std::uint8_t>(starts.vertices[n]);
  auto pairs = matrix<std::int32_t>(starts.neighbours[n], 2);
  const FlatAtlas flat{
      centers.mutable_data(),         bases.mutable_data(),   residuals.mutable_data(), regularities.mutable_data(),
      nearly_singular.mutable_data(), normals.mutable_data(), offsets.mutable_data(),   tags.mutable_data(),
      vertices.mutable_data(),        closed.mutable_data(),  pairs.mutable_data()};
  {
    const py::gil_scoped_release release;
    fill(atlas, starts, flat);
  }
  ArrayTable out;
  out["centers"] = centers;
  out["bases"] = bases;
  out["residuals"] = residuals;
  out["regularities"] = regularities;
  out["nearly_singular"] = nearly_singular;
  out["facet_start"] = facet_start;
  out["facet_normals"] = normals;
  out["facet_offsets"] = offsets;
  out["facet_tags"] = tags;
  out["vertex_start"] = vertex_start;
  out["vertices"] = vertices;
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
  visit("regularities", table.regularities);
  visit("keys", table.keys);
  visit("closed_charts", table.closed_charts);
  visit("closed_vertices", table.closed_vertices);
  visit("closed_reasons", table.closed_reasons);
  visit("generation", table.generation);
  visit("again", table.deferred);
}

Checkpoint read_checkpoint(const ArrayTable& table) {
  Checkpoint out;
  visit_checkpoint(out, [&table](const char* name, auto& part) { read_array(table, name, part); });
  std::vector<std::int64_t> counts;
  read_array(table, "counts", counts);
  if (counts.size() != 7) throw Error("the checkpoint is damaged: it needs seven counts");
  out.position = counts[0];
  out.next_first = counts[1];
  out.expansion_count = counts[2];
  out.audit.rounds = counts[3];
  out.audit.holes = counts[4];
  out.audit.new_first = counts[5];
  out.audit.points = counts[6];
  std::vector<std::int64_t> paused;
  read_array(table, "paused", paused);
  if (paused.size() % 3 != 0) throw Error("the checkpoint is damaged: its paused tasks must be triples");
  for (std::size_t i = 0; i < paused.size(); i += 3)
    out.paused.push_back(
        {paused[i], static_cast<std::int32_t>(paused[i + 1]), static_cast<std::int32_t>(paused[i + 2])});
  return out;
}

/// An array of these numbers themselves, no copy.
template <class T>
py::array_t<T> array_of(std::vector<T>&& numbers) {
  auto owned = std::make_unique<std::vector<T>>(std::move(numbers));
  const py::capsule owner(owned.get(), [](void* vector) { delete static_cast<std::vector<T>*>(vector); });
  const std::vector<T>& kept = *owned.release();
  return py::array_t<T>(static_cast<py::ssize_t>(kept.size()), kept.data(), owner);
}

ArrayTable write_checkpoint(Checkpoint&& checkpoint) {
  ArrayTable out;
  visit_checkpoint(checkpoint, [&out](const char* name, auto& part) { out[name] = array_of(std::move(part)); });
  const std::int64_t counts[] = {checkpoint.position,     checkpoint.next_first,  checkpoint.expansion_count,
                                 checkpoint.audit.rounds, checkpoint.audit.holes, checkpoint.audit.new_first,
                                 checkpoint.audit.points};
  out["counts"] = py::array_t<std::int64_t>(7, counts);
  auto paused = matrix<std::int64_t>(static_cast<py::ssize_t>(checkpoint.paused.size()), 3);
  std::int64_t* numbers = paused.mutable_data();
  for (const Expansion& expansion : checkpoint.paused)
    for (const std::int64_t number : {expansion.number, std::int64_t{expansion.index}, std::int64_t{expansion.made}})
      *numbers++ = number;
  out["paused"] = paused;
  return out;
}

/// What numbers in the atlas's arrays mean.
void bind_codes(py::module_& module) {
  module.def("box_half_width", &box_half_width, py::arg("dimension"), py::arg("radius"),
             "Half the width of the box that the polytopes of charts are cut from.");
  py::enum_<Closed>(module, "Closed", "Why a vertex of a polytope was not expanded.")
      .value("OPEN", Closed::open)
      .value("BOUNDS", Closed::bounds)
      .value("CURVATURE", Closed::curvature)
      .value("NOT_CONVERGED", Closed::not_converged)
      .value("COVERED", Closed::covered);
}

}  // namespace

void bind_atlas(py::module_& module) {
  bind_codes(module);
  py::class_<Atlas>(module, "AtlasBuilder", "Grows an atlas chart by chart (Algorithm 1, lines 4 to 13).")
      .def(py::init([](System& system, const DoubleArray& x0, double radius, double epsilon, int threads) {
             const double* const start = checked_vector(x0, system.configuration_size(), "x0");
             return std::make_unique<Atlas>(system, start, AtlasOptions{radius, epsilon}, threads);
           }),
           py::arg("system"), py::arg("x0"), py::arg("radius"), py::arg("epsilon"), py::arg("threads") = 1,
           py::keep_alive<1, 2>())
      .def_static(
          "resume",
          [](System& system, const ArrayTable& saved, double radius, double epsilon, int threads) {
            const Checkpoint checkpoint = read_checkpoint(saved);
            const py::gil_scoped_release release;
            return std::make_unique<Atlas>(system, checkpoint, AtlasOptions{radius, epsilon}, threads);
          },
          py::arg("system"), py::arg("saved"), py::arg("radius"), py::arg("epsilon"), py::arg("threads") = 1,
          py::keep_alive<0, 1>(), "Goes on from what `save` returned, with all charts, to the same atlas.")
      .def(
          "save", [](const Atlas& atlas, std::int64_t first) { return write_checkpoint(atlas.save(first)); },
          py::arg("first") = 0, "All that is needed to go on later, as arrays, with the charts from `first` on.")
      .def("expand", &Atlas::expand, py::arg("chart_limit"), py::arg("seconds"),
           py::call_guard<py::gil_scoped_release>(),
           "Expand until complete, the limit of charts is reached, or the seconds have passed.")
      .def("audit", &Atlas::audit, py::arg("points"), py::arg("seconds"), py::call_guard<py::gil_scoped_release>(),
           "Look for points that a complete atlas does not cover, until that is done or the seconds have passed; where "
           "there is one the atlas is open again.")
      .def_property_readonly("audited", &Atlas::audited, "True when it is complete, and an audit has ended.")
      .def_property_readonly(
          "audit_points", [](const Atlas& atlas) { return atlas.audit_state().points; },
          "Points of random walks that the last audit found covered; 0 when it was given up.")
      .def_property_readonly(
          "audit_holes", [](const Atlas& atlas) { return atlas.audit_state().holes; },
          "Charts that audits began where nothing was covered.")
      .def_property_readonly("complete", &Atlas::complete, "True when no chart is left to expand.")
      .def_property_readonly("n_open", &Atlas::open_count, "Charts still to be expanded.")
      .def_property_readonly("n_charts", &Atlas::count, "Charts so far.")
      .def_property_readonly("n_settled", &Atlas::settled_count, "Charts, the first ones, whose numbers stay.")
      .def_property_readonly("n_threads", &Atlas::threads, "Threads that it uses.")
      .def_property_readonly("n_bytes", &Atlas::bytes, "Memory that it holds.")
      .def_property_readonly("n_projections", &Atlas::projections, "Newton projections so far.")
      .def(
          "arrays", [](const Atlas& atlas) { return atlas_arrays<const Atlas>(atlas, &flatten); },
          "The atlas as a dictionary of arrays.")
      .def(
          "take_arrays",
          [](Atlas& atlas) {
            atlas.charts_to_give_back().forget_places();
            return atlas_arrays<Atlas>(atlas, &move_flat);
          },
          "The same, for which the builder gives its own memory back: nothing but counts can be asked of it any more.");
}

}  // namespace graspatlas
