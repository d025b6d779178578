#pragma once

#include <cstdint>

#include "graspatlas/continuation/polytope.hpp"

namespace graspatlas {

/// Place of a chart in its atlas in the order of the algorithm, as far as it is known.
using ChartKey = std::uint64_t;

/// Whether the Jacobian loses rank within a chart: it may by what neighbours say, to first order, or does.
enum class Rank : std::uint8_t { full, doubtful, lost };

/// Why a vertex could not be expanded. Zero means that it may still be; `covered` that an audit went on there by small
/// steps, and found it covered.
enum class Closed : std::uint8_t { open = 0, bounds = 1, curvature = 2, not_converged = 3, covered = 4 };

/// Half the width of the box that the polytopes of charts are cut from. It encloses the ball of the charts' radius, and
/// on a line the box must be wider than the ball so that it has ends outside.
constexpr double box_half_width(int dimension, double radius) { return dimension == 1 ? 1.5 * radius : radius; }

/// Which vertices the polytopes of charts list: beyond so many dimensions they have too many.
constexpr Polytope::Listed listed_vertices(int dimension) {
  return dimension <= 3 ? Polytope::Listed::all : Polytope::Listed::outer;
}

/// Another chart that a chart cuts, and is cut by.
struct Neighbour {
  int slot;
  float squared_mismatch;  ///< NeighbourTest: how far the two are from lying on one sheet, as far as they say
};

/// A chart: what it covers of its tangent space, and what is known of it. Its centre and tangent basis are in `Charts`.
struct Chart {
  Polytope polytope;                      ///< facets are tagged by the slots of the charts behind them
  const Neighbour* neighbours = nullptr;  ///< those older than the chart itself
  int neighbour_count = 0;
  int number = -1;        ///< in the order of the algorithm; -1 until that is settled
  ChartKey key = 0;       ///< ascends in the order of the algorithm
  double residual = 0.0;  ///< largest entry of |R| at the centre
  /// Newton::regularity at the centre: its size tells how near the Jacobian is to losing rank, and where its sign is
  /// another than a neighbour's, beside the orientations of their bases, it has lost it between the two.
  double regularity = 1.0;
  Rank rank = Rank::full;
  bool done = false;    ///< no vertex was left to expand when it was expanded
  bool closed = false;  ///< vertices of it were closed
};

}  // namespace graspatlas
