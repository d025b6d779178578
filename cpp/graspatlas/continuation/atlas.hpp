#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <vector>

#include "graspatlas/continuation/neighbours.hpp"
#include "graspatlas/continuation/newton.hpp"
#include "graspatlas/continuation/polytope.hpp"
#include "graspatlas/continuation/rows.hpp"
#include "graspatlas/continuation/system.hpp"

namespace graspatlas {

struct AtlasOptions {
  double radius = 0.1;   ///< r: radius of the ball that a chart may cover [units of the tangent space]
  double epsilon = 0.1;  ///< eqs (17) and (18): how far and how different neighbouring charts may be
  NewtonOptions newton;
  double shrink = 0.9;          ///< alpha is multiplied by this after each failed attempt (Algorithm 1, line 11)
  double smallest_step = 0.05;  ///< a vertex is closed when alpha falls below this share of the radius
};

/// Why a vertex could not be expanded. Zero means that it may still be.
enum class Closed : std::uint8_t { open = 0, bounds = 1, curvature = 2, not_converged = 3 };

/// An atlas of the connected part of R(x) = 0 that contains a first point: Algorithm 1, lines 4 to 13.
///
/// Invariants, for charts i and j that are neighbours: the displacement between their centres is at most 2 r long; it
/// is at most epsilon off either tangent space, and its cosine with either is at least 1 - epsilon; the tangent spaces
/// agree to 1 - epsilon; and each polytope lies in the half-space nearer to its own centre than to the other's, both
/// seen in its own tangent space.
class Atlas {
 public:
  /// Starts with one chart at the point of the manifold nearest x0.
  /// Throws when x0 cannot be projected, breaks a bound, or the Jacobian there is rank deficient.
  Atlas(System& system, const double* x0, const AtlasOptions& options);

  /// Expand until the atlas is complete, has `chart_limit` charts, or `seconds` have passed.
  void expand(std::int64_t chart_limit, double seconds);

  bool complete() const { return open_.empty(); }
  std::int64_t open_count() const { return static_cast<std::int64_t>(open_.size()); }
  std::int64_t count() const { return static_cast<std::int64_t>(polytopes_.size()); }

  const double* center(std::int64_t i) const { return centers_[static_cast<std::size_t>(i)]; }
  const double* basis(std::int64_t i) const { return bases_[static_cast<std::size_t>(i)]; }
  double residual(std::int64_t i) const { return residuals_[i]; }
  const Polytope& polytope(std::int64_t i) const { return polytopes_[i]; }
  /// Pairs (i, j), i < j, of charts that cut each other, in the order in which they met.
  const std::vector<std::array<int, 2>>& neighbour_pairs() const { return pairs_; }
  /// Newton projections made so far, those of failed attempts included.
  std::int64_t projections() const { return projections_; }

  const System& system() const { return system_; }
  const AtlasOptions& options() const { return options_; }

 private:
  Closed attempt(int i, const double* direction, double alpha);
  void expand_vertex(int i, int vertex);
  int add_chart();
  void cut_by_bounds(int i);
  void meet_neighbours(int i);
  bool pass_tests(int i, const double* x_j, const double* Phi_j, double* p_ij, double* p_ji);
  bool inside_bounds(const double* x);

  System& system_;
  AtlasOptions options_;
  int x_size_, n_, k_;
  Newton newton_;
  Neighbours index_;
  Rows centers_, bases_;
  std::vector<double> residuals_;
  std::deque<Polytope> polytopes_;
  std::vector<std::array<int, 2>> pairs_;
  std::deque<int> open_;
  std::int64_t projections_ = 0;

  // Scratch: the candidate chart, and work space of the tests.
  std::vector<double> x_new_, Phi_new_, step_, displacement_, p_ij_, p_ji_, work_, slack_, bound_in_chart_, direction_,
      vertex_, embedding_;
  std::vector<int> near_;
};

}  // namespace graspatlas
