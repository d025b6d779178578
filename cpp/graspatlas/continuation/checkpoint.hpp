#pragma once

#include <cstdint>
#include <vector>

#include "graspatlas/continuation/chart.hpp"
#include "graspatlas/continuation/front.hpp"
#include "graspatlas/manifold/system.hpp"

namespace graspatlas {

/// How far an audit of an atlas has come; the numbers are those before the round that is going on, or was the last.
struct AuditState {
  bool done = false;
  std::int64_t rounds = 0;     ///< rounds that found holes
  std::int64_t holes = 0;      ///< charts that were begun at holes
  std::int64_t new_first = 0;  ///< first chart that came after the last round
  std::int64_t points = 0;     ///< points of random walks, all found covered; 0 before that, or when it was given up
};

/// What an atlas in the making must keep to be made anew, to the bit, without projecting its charts again.
///
/// Polytopes are not kept: charts that are put back in their order cut each other as they did. Charts are named by
/// their numbers.
struct Checkpoint {
  /// Charts, from one on: centres [n x configuration_size], tangent bases [n x dimension x tangent_size].
  std::vector<double> centers, bases, residuals, regularities;
  std::vector<ChartKey> keys;

  /// Vertices that were closed: chart, position [m x dimension], and reason.
  std::vector<std::int32_t> closed_charts;
  std::vector<double> closed_vertices;
  std::vector<std::uint8_t> closed_reasons;

  /// The generation that is being expanded, how much of it is done, and charts that are deferred to the next one: see
  /// Front.
  std::vector<std::int32_t> generation, deferred;
  std::vector<Expansion> paused;
  std::int64_t position = 0, next_first = 0, expansion_count = 0;

  AuditState audit;
};

/// Throws Error when a checkpoint does not fit the system, or holds numbers that no atlas of it has.
void check_checkpoint(const Checkpoint& saved, const System& system);

}  // namespace graspatlas
