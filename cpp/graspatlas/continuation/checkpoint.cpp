#include "graspatlas/continuation/checkpoint.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "graspatlas/errors.hpp"
#include "graspatlas/types.hpp"

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
      all_in_range(saved.generation) && all_in_range(saved.deferred) && saved.position >= 0 &&
      saved.position <= static_cast<std::int64_t>(saved.generation.size()) && saved.next_first >= 0 &&
      saved.next_first <= static_cast<std::int64_t>(n) && saved.expansion_count >= 0 && saved.audit.rounds >= 0 &&
      saved.audit.new_first >= 0 && saved.audit.new_first <= static_cast<std::int64_t>(n);
  const bool paused_in_range = std::all_of(saved.paused.begin(), saved.paused.end(), [&saved](const Expansion& paused) {
    return paused.number > 0 && paused.number <= saved.expansion_count && paused.index >= 0 && paused.made >= 0 &&
           static_cast<std::size_t>(paused.index) < saved.generation.size() && paused.made < Front::kMostCharts;
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

void check_checkpoint(const Checkpoint& saved, const System& system) {
  check_sizes(saved, system);
  check_numbers(saved, system);
}

}  // namespace graspatlas
