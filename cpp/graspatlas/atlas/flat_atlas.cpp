#include "graspatlas/atlas/flat_atlas.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "graspatlas/parallel.hpp"

namespace graspatlas {

namespace {

void copy_facets(const Atlas& atlas, const Polytope& p, std::int64_t first, const FlatAtlas& out) {
  const int k = p.dimension();
  std::int64_t f = first;
  for (int a = 0; a < p.facet_slots(); ++a) {
    if (!p.facet_active(a)) continue;
    std::copy_n(p.normal(a), k, out.facet_normals + f * k);
    out.facet_offsets[f] = p.offset(a);
    out.facet_tags[f++] = p.tag(a) >= 0 ? atlas.number(p.tag(a)) : p.tag(a);
  }
}

// Charts are moved in so many parts, or in parts that take so many bytes.
constexpr std::int64_t kMoves = 64, kLeastMoved = 1 << 20;

std::int64_t count_vertices(const Polytope& p) {
  if (p.listed() == Polytope::Listed::all) return p.vertex_count();
  std::int64_t count = 0;
  for (int v = 0; v < p.vertex_count(); ++v) count += p.state(v) != 0;
  return count;
}

// Of a polytope that does not list all vertices those that were closed, ascending: the others, and the order, depend on
// when it was asked for them.
void copy_vertices(const Polytope& p, std::int64_t first, const FlatAtlas& out) {
  const int k = p.dimension();
  if (p.listed() == Polytope::Listed::all) {
    std::copy_n(p.vertex(0), p.vertex_count() * k, out.vertices + first * k);
    for (int v = 0; v < p.vertex_count(); ++v) out.vertex_closed[first + v] = p.state(v);
    return;
  }
  std::vector<int> order;
  for (int v = 0; v < p.vertex_count(); ++v)
    if (p.state(v) != 0) order.push_back(v);
  std::sort(order.begin(), order.end(), [&p, k](int a, int b) {
    return std::lexicographical_compare(p.vertex(a), p.vertex(a) + k, p.vertex(b), p.vertex(b) + k);
  });
  for (const int v : order) {
    std::copy_n(p.vertex(v), k, out.vertices + first * k);
    out.vertex_closed[first++] = p.state(v);
  }
}

void copy_chart(const Atlas& atlas, std::int64_t i, const FlatStarts& starts, const FlatAtlas& out) {
  const System& system = atlas.system();
  const std::int64_t k = system.dimension(), basis_size = k * system.tangent_size();
  const Chart& chart = atlas.chart(i);
  const Polytope& p = chart.polytope;
  std::copy_n(atlas.center(i), system.configuration_size(), out.centers + i * system.configuration_size());
  std::copy_n(atlas.basis(i), basis_size, out.bases + i * basis_size);
  out.residuals[i] = chart.residual;
  out.regularities[i] = std::abs(chart.regularity);
  out.nearly_singular[i] = chart.rank != Rank::full;
  copy_facets(atlas, p, starts.facets[i], out);
  copy_vertices(p, starts.vertices[i], out);
  std::int32_t* pair = out.neighbour_pairs + 2 * starts.neighbours[i];
  for (int c = 0; c < chart.neighbour_count; ++c) {
    *pair++ = atlas.number(chart.neighbours[c].slot);
    *pair++ = static_cast<std::int32_t>(i);
  }
}

}  // namespace

void write_starts(const Atlas& atlas, const FlatStarts& out) {
  out.facets[0] = out.vertices[0] = out.neighbours[0] = 0;
  parallel_for(atlas.threads(), atlas.count(), [&](int, std::int64_t first, std::int64_t last) {
    for (std::int64_t i = first; i < last; ++i) {
      const Chart& chart = atlas.chart(i);
      const Polytope& p = chart.polytope;
      out.facets[i + 1] = 0;
      for (int a = 0; a < p.facet_slots(); ++a) out.facets[i + 1] += p.facet_active(a);
      out.vertices[i + 1] = count_vertices(p);
      out.neighbours[i + 1] = chart.neighbour_count;
    }
  });
  for (std::int64_t* starts : {out.facets, out.vertices, out.neighbours})
    std::partial_sum(starts, starts + atlas.count() + 1, starts);
}

void flatten(const Atlas& atlas, const FlatStarts& starts, const FlatAtlas& out) {
  parallel_for(atlas.threads(), atlas.count(), [&](int, std::int64_t first, std::int64_t last) {
    for (std::int64_t i = first; i < last; ++i) copy_chart(atlas, i, starts, out);
  });
}

// By slots, in which order the charts lie in memory.
void move_flat(Atlas& atlas, const FlatStarts& starts, const FlatAtlas& out) {
  Charts& charts = atlas.charts_to_give_back();
  const int count = charts.count();
  const auto parts = static_cast<int>(std::clamp<std::int64_t>(atlas.bytes() / kLeastMoved, 1, kMoves));
  const int part = (count + parts - 1) / parts;
  for (int begin = 0; begin < count; begin += part) {
    const int end = std::min(begin + part, count);
    parallel_for(atlas.threads(), end - begin, [&](int, std::int64_t first, std::int64_t last) {
      for (std::int64_t i = first; i < last; ++i)
        copy_chart(atlas, atlas.number(begin + static_cast<int>(i)), starts, out);
    });
    charts.forget_before(end);
  }
}

}  // namespace graspatlas
