#include "graspatlas/continuation/checkpoint.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "graspatlas/continuation/atlas.hpp"

namespace graspatlas {

namespace {

/// Products of a stored basis's rows may be off those of an orthonormal one by this.
constexpr double kOrthonormal = 1e-6;

void check_sizes(const Checkpoint& saved, const System& system) {
  const auto n = saved.keys.size(), m = saved.closed_charts.size();
  const auto k = static_cast<std::size_t>(system.dimension());
  const auto in_range = [n](std::int32_t chart) { return chart >= 0 && static_cast<std::size_t>(chart) < n; };
  const auto all_in_range = [&](const std::vector<std::int32_t>& charts) {
    return std::all_of(charts.begin(), charts.end(), in_range);
  };
  const bool sound =
      n > 0 && saved.centers.size() == n * static_cast<std::size_t>(system.configuration_size()) &&
      saved.bases.size() == n * k * static_cast<std::size_t>(system.tangent_size()) && saved.residuals.size() == n &&
      saved.regularities.size() == n && std::is_sorted(saved.keys.begin(), saved.keys.end()) &&
      saved.closed_vertices.size() == m * k && saved.closed_reasons.size() == m && all_in_range(saved.closed_charts) &&
      all_in_range(saved.generation) && all_in_range(saved.again) && saved.position >= 0 &&
      saved.position <= static_cast<std::int64_t>(saved.generation.size()) && saved.next_first >= 0 &&
      saved.next_first <= static_cast<std::int64_t>(n) && saved.task_count >= 0 && saved.audit.rounds >= 0 &&
      saved.audit.new_first >= 0 && saved.audit.new_first <= static_cast<std::int64_t>(n);
  const bool paused_in_range = std::all_of(saved.paused.begin(), saved.paused.end(), [&saved](const PausedTask& task) {
    return task.number > 0 && task.number <= saved.task_count && task.turn >= 0 && task.made >= 0 &&
           static_cast<std::size_t>(task.turn) < saved.generation.size() && task.made < Atlas::kMostCharts;
  });
  if (!sound || !paused_in_range) throw Error("the checkpoint is damaged, or of another system");
}

bool all_finite(const std::vector<double>& numbers) {
  return std::all_of(numbers.begin(), numbers.end(), [](double number) { return std::isfinite(number); });
}

/// True when the rows of each basis are unit vectors at right angles.
bool all_orthonormal(const std::vector<double>& bases, int k, int v) {
  for (std::size_t at = 0; at < bases.size(); at += static_cast<std::size_t>(k) * v) {
    const Eigen::Map<const RowMatrix> basis(&bases[at], k, v);
    const Eigen::MatrixXd gram = basis * basis.transpose();
    if (!gram.isIdentity(kOrthonormal)) return false;
  }
  return true;
}

/// Refuses numbers that no atlas holds, from which growth would go on to a wrong one.
void check_numbers(const Checkpoint& saved, const System& system) {
  const bool twice = std::adjacent_find(saved.keys.begin(), saved.keys.end()) != saved.keys.end();
  const bool reasons = std::all_of(saved.closed_reasons.begin(), saved.closed_reasons.end(), [](std::uint8_t reason) {
    return reason >= 1 && reason <= static_cast<std::uint8_t>(Closed::covered);
  });
  const bool sound = !twice && reasons && all_finite(saved.centers) && all_finite(saved.residuals) &&
                     all_finite(saved.closed_vertices) && all_finite(saved.regularities) &&
                     all_orthonormal(saved.bases, system.dimension(), system.tangent_size());
  if (!sound) throw Error("the checkpoint is damaged: it holds numbers that no atlas has");
}

}  // namespace

Checkpoint Atlas::save(std::int64_t first) const {
  const int x_size = system_.configuration_size(), k = system_.dimension(), basis_size = k * system_.tangent_size();
  Checkpoint out;
  for (std::int64_t i = first; i < count(); ++i) {
    out.centers.insert(out.centers.end(), center(i), center(i) + x_size);
    out.bases.insert(out.bases.end(), basis(i), basis(i) + basis_size);
    out.residuals.push_back(chart(i).residual);
    out.regularities.push_back(chart(i).regularity);
    out.keys.push_back(chart(i).key);
  }
  for (std::int64_t i = 0; i < count(); ++i) {
    if (!chart(i).closed) continue;
    const Polytope& polytope = chart(i).polytope;
    for (int v = 0; v < polytope.vertex_count(); ++v) {
      if (polytope.state(v) == 0) continue;
      out.closed_charts.push_back(static_cast<std::int32_t>(i));
      out.closed_vertices.insert(out.closed_vertices.end(), polytope.vertex(v), polytope.vertex(v) + k);
      out.closed_reasons.push_back(polytope.state(v));
    }
  }
  for (const int slot : generation_) out.generation.push_back(number(slot));
  for (const int slot : again_) out.again.push_back(number(slot));
  out.paused = paused_;
  out.audit = audit_;
  out.position = static_cast<std::int64_t>(position_);
  out.next_first = static_cast<std::int64_t>(next_first_);
  out.task_count = task_count_;
  return out;
}

void Atlas::restore(const Checkpoint& saved) {
  check_sizes(saved, system_);
  check_numbers(saved, system_);
  const int x_size = system_.configuration_size(), k = system_.dimension(), basis_size = k * system_.tangent_size();
  Worker& worker = *workers_.front();
  for (std::size_t i = 0; i < saved.keys.size(); ++i) {
    system_.check_point(&saved.centers[i * x_size]);
    worker.expander->put_back(&saved.centers[i * x_size], &saved.bases[i * basis_size], saved.residuals[i],
                              saved.regularities[i], saved.keys[i]);
    charts_[static_cast<int>(i)].done = true;
  }
  // A slot is a chart's number now.
  settle_order();
  for (std::size_t i = 0; i < saved.closed_charts.size(); ++i) {
    Chart& chart = charts_[saved.closed_charts[i]];
    const double* u = &saved.closed_vertices[i * k];
    int v = 0;
    while (v < chart.polytope.vertex_count() && !std::equal(u, u + k, chart.polytope.vertex(v))) ++v;
    if (v == chart.polytope.vertex_count()) throw Error("the checkpoint is damaged, or of another version");
    chart.polytope.close(v, saved.closed_reasons[i]);
    chart.closed = true;
  }
  generation_.assign(saved.generation.begin(), saved.generation.end());
  again_.assign(saved.again.begin(), saved.again.end());
  choose_order(worker);
  position_ = static_cast<std::size_t>(saved.position);
  next_first_ = static_cast<std::size_t>(saved.next_first);
  task_count_ = saved.task_count;
  paused_ = saved.paused;
  // Which charts lose rank is not kept: the last round is made again.
  audit_ = saved.audit;
  audit_.done = false;
  settle_order();  // by the tasks that are paused
  for (const PausedTask& task : paused_) charts_[generation_[static_cast<std::size_t>(task.turn)]].done = false;
  for (std::size_t turn = position_; turn < turns_.size(); ++turn) charts_[generation_[turns_[turn]]].done = false;
  for (std::size_t i = next_first_; i < order_.size(); ++i) charts_[order_[i]].done = false;
  for (const int slot : again_) charts_[slot].done = false;
}

}  // namespace graspatlas
