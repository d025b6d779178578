#include "graspatlas/continuation/atlas.hpp"

#include <pybind11/stl.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <string>

#include "bindings.hpp"
#include "graspatlas/parallel.hpp"

namespace py = pybind11;

namespace graspatlas {

namespace {

/// Where the facets, vertices and neighbours of each chart begin, when those of all charts stand one after another.
struct Starts {
  py::array_t<std::int64_t> facets, vertices, neighbours;

  explicit Starts(const Atlas& atlas)
      : facets(atlas.count() + 1), vertices(atlas.count() + 1), neighbours(atlas.count() + 1) {
    std::int64_t* const f = facets.mutable_data();
    std::int64_t* const v = vertices.mutable_data();
    std::int64_t* const c = neighbours.mutable_data();
    const py::gil_scoped_release release;
    f[0] = v[0] = c[0] = 0;
    parallel_for(atlas.threads(), atlas.count(), [&](int, std::int64_t first, std::int64_t last) {
      for (std::int64_t i = first; i < last; ++i) {
        const Polytope& p = atlas.chart(i).polytope;
        f[i + 1] = 0;
        for (int a = 0; a < p.facet_slots(); ++a) f[i + 1] += p.facet_active(a);
        v[i + 1] = p.vertex_count();
        c[i + 1] = atlas.chart(i).neighbour_count;
      }
    });
    for (std::int64_t* starts : {f, v, c}) std::partial_sum(starts, starts + atlas.count() + 1, starts);
  }
};

/// The whole atlas as arrays; ragged parts (facets, vertices) as values and row offsets.
ArrayTable atlas_arrays(const Atlas& atlas) {
  const py::ssize_t n = atlas.count(), k = atlas.system().dimension(), v = atlas.system().tangent_size();
  const py::ssize_t x_size = atlas.system().configuration_size();
  const Starts starts(atlas);
  const std::int64_t* const facet_start = starts.facets.data();
  const std::int64_t* const vertex_start = starts.vertices.data();
  const std::int64_t* const pair_start = starts.neighbours.data();
  auto centers = matrix<double>(n, x_size);
  auto bases = py::array_t<double>(std::vector<py::ssize_t>{n, k, v});
  auto residuals = py::array_t<double>(n), regularities = py::array_t<double>(n);
  auto nearly_singular = py::array_t<bool>(n);
  auto normals = matrix<double>(facet_start[n], k), vertices = matrix<double>(vertex_start[n], k);
  auto offsets = py::array_t<double>(facet_start[n]);
  auto tags = py::array_t<std::int32_t>(facet_start[n]);
  auto closed = py::array_t<std::uint8_t>(vertex_start[n]);
  auto pairs = matrix<std::int32_t>(pair_start[n], 2);
  double *center = centers.mutable_data(), *basis = bases.mutable_data(), *residual = residuals.mutable_data();
  double* const regularity = regularities.mutable_data();
  bool* const singular = nearly_singular.mutable_data();
  double *normal = normals.mutable_data(), *offset = offsets.mutable_data(), *vertex = vertices.mutable_data();
  std::int32_t *tag = tags.mutable_data(), *pair = pairs.mutable_data();
  std::uint8_t* state = closed.mutable_data();
  const auto copy_chart = [&](std::int64_t i) {
    const Chart& chart = atlas.chart(i);
    const Polytope& p = chart.polytope;
    std::copy_n(atlas.center(i), x_size, center + i * x_size);
    std::copy_n(atlas.basis(i), k * v, basis + i * k * v);
    residual[i] = chart.residual;
    regularity[i] = std::abs(chart.regularity);
    singular[i] = chart.rank != Rank::full;
    std::int64_t f = facet_start[i];
    for (int a = 0; a < p.facet_slots(); ++a) {
      if (!p.facet_active(a)) continue;
      std::copy_n(p.normal(a), k, normal + f * k);
      offset[f] = p.offset(a);
      tag[f++] = p.tag(a) >= 0 ? atlas.number(p.tag(a)) : p.tag(a);
    }
    std::copy_n(p.vertex(0), p.vertex_count() * k, vertex + vertex_start[i] * k);
    for (int a = 0; a < p.vertex_count(); ++a) state[vertex_start[i] + a] = p.state(a);
    for (int c = 0; c < chart.neighbour_count; ++c) {
      pair[2 * (pair_start[i] + c)] = atlas.number(chart.neighbours[c]);
      pair[2 * (pair_start[i] + c) + 1] = static_cast<std::int32_t>(i);
    }
  };
  {
    const py::gil_scoped_release release;
    parallel_for(atlas.threads(), n, [&copy_chart](int, std::int64_t first, std::int64_t last) {
      for (std::int64_t i = first; i < last; ++i) copy_chart(i);
    });
  }
  ArrayTable out;
  out["centers"] = centers;
  out["bases"] = bases;
  out["residuals"] = residuals;
  out["regularities"] = regularities;
  out["nearly_singular"] = nearly_singular;
  out["facet_start"] = starts.facets;
  out["facet_normals"] = normals;
  out["facet_offsets"] = offsets;
  out["facet_tags"] = tags;
  out["vertex_start"] = starts.vertices;
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
  visit("again", table.again);
}

Checkpoint read_checkpoint(const ArrayTable& table) {
  Checkpoint out;
  visit_checkpoint(out, [&table](const char* name, auto& part) { read_array(table, name, part); });
  std::vector<std::int64_t> counts;
  read_array(table, "counts", counts);
  if (counts.size() != 7) throw Error("the checkpoint is damaged: it needs seven counts");
  out.position = counts[0];
  out.next_first = counts[1];
  out.task_count = counts[2];
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

ArrayTable write_checkpoint(const Checkpoint& checkpoint) {
  ArrayTable out;
  visit_checkpoint(checkpoint, [&out](const char* name, const auto& part) {
    out[name] = py::array_t<typename std::decay_t<decltype(part)>::value_type>(static_cast<py::ssize_t>(part.size()),
                                                                               part.data());
  });
  const std::int64_t counts[] = {checkpoint.position,     checkpoint.next_first,  checkpoint.task_count,
                                 checkpoint.audit.rounds, checkpoint.audit.holes, checkpoint.audit.new_first,
                                 checkpoint.audit.points};
  out["counts"] = py::array_t<std::int64_t>(7, counts);
  auto paused = matrix<std::int64_t>(static_cast<py::ssize_t>(checkpoint.paused.size()), 3);
  std::int64_t* numbers = paused.mutable_data();
  for (const PausedTask& task : checkpoint.paused)
    for (const std::int64_t number : {task.number, std::int64_t{task.turn}, std::int64_t{task.made}})
      *numbers++ = number;
  out["paused"] = paused;
  return out;
}

}  // namespace

void bind_atlas(py::module_& module) {
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
      .def_property_readonly("n_array_bytes", &Atlas::array_bytes, "Memory that its arrays would take, at most.")
      .def_property_readonly("n_projections", &Atlas::projections, "Newton projections so far.")
      .def("arrays", &atlas_arrays, "The atlas as a dictionary of arrays.");
}

}  // namespace graspatlas
