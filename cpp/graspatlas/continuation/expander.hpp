#pragma once

#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "graspatlas/clock.hpp"
#include "graspatlas/continuation/charts.hpp"
#include "graspatlas/continuation/neighbour_test.hpp"
#include "graspatlas/continuation/options.hpp"
#include "graspatlas/continuation/polytope.hpp"
#include "graspatlas/manifold/bound_check.hpp"
#include "graspatlas/manifold/newton.hpp"
#include "graspatlas/manifold/system.hpp"

namespace graspatlas {

/// The distance, in radii, of a new chart from the one that it is made from is at most this.
constexpr double kLongestStep = 1.5;
/// Charts at least this many radii apart may be expanded at the same time: each reaches new charts by the longest step,
/// and from there the neighbours within two radii, which it cuts.
/// The last term is for rounding.
constexpr double kIndependent = 2.0 * (kLongestStep + 2.0) + 1e-3;

/// Expands charts: lines 6 to 12 of Algorithm 1, with the work space of one thread.
class Expander {
 public:
  /// The system is used by this expander only.
  Expander(System& system, const AtlasOptions& options, Charts& charts);

  /// Adds the first chart, at the point of the manifold nearest x0.
  /// Throws when x0 cannot be projected, breaks a bound, or the Jacobian there is rank deficient.
  void start(const double* x0);

  /// Expand a chart until no vertex is left: then true. False when it has made `most` charts, which get the keys from
  /// `key` on, or the deadline has passed. `made` is how many it has made, before this call too.
  bool expand(int slot, ChartKey key, int most, int& made, Clock::time_point deadline);
  /// Charts that were done and have got a vertex to expand since the last call: a cut may make one beside a closed
  /// vertex.
  std::vector<int> take_reopened() { return std::exchange(reopened_, {}); }

  /// Adds a chart of an atlas that was saved; all that have smaller keys must be there.
  void put_back(const double* center, const double* basis, double residual, double regularity, ChartKey key);

  /// Adds a chart at a point of the manifold with its tangent basis, which no chart covers.
  void start_at(const double* x, const double* Phi, ChartKey key);

  /// Newton projections made so far, those of failed attempts included.
  std::int64_t projections() const { return projections_ + test_.projections(); }
  /// Memory by which this expander made polytopes grow, and that of the lists of neighbours that it made.
  std::int64_t polytope_bytes() const { return polytope_bytes_; }
  std::int64_t list_bytes() const { return list_bytes_; }

 private:
  double within_bounds(int i, double alpha);
  Closed attempt(int i, const double* direction, double alpha);
  bool expand_vertex(int i, int vertex, ChartKey key);
  void add_chart(ChartKey key);
  void close(int i, int vertex, Closed reason);
  void cut_by_bounds(int j);
  void meet_neighbours(int j);
  void find_near();
  bool fits(int i);
  bool on_one_sheet(int i);
  bool share_neighbour(int i) const;
  void meet(int i, int j);
  void compare_regularity(int i, int j);
  const Neighbour* keep(const std::vector<Neighbour>& list);

  System& system_;
  AtlasOptions options_;
  Charts& charts_;
  int x_size_, n_, k_;
  Newton newton_;
  NeighbourTest test_;
  BoundCheck bounds_;
  std::int64_t projections_ = 0, polytope_bytes_ = 0, list_bytes_ = 0;
  std::vector<std::unique_ptr<Neighbour[]>> lists_;  // of neighbours, one after another
  Neighbour* next_list_ = nullptr;                   // where the next goes
  std::size_t list_room_ = 0;                        // left there

  // Scratch: the candidate chart and its polytope, and work space of the tests.
  double residual_new_ = 0.0, regularity_new_ = 1.0;
  std::vector<double> bound_reach_;  // slack from which on a bound cuts no chart
  std::vector<double> x_new_, Phi_new_, step_, bound_in_chart_, direction_, vertex_, embedding_;
  std::vector<double> slacks_new_;
  Polytope polytope_;
  Polytope::Scratch cut_scratch_;
  Neighbours::Scratch near_scratch_;
  Beside beside_;  // of the candidate and a chart
  std::vector<int> near_, reopened_;
  std::vector<Neighbour> neighbours_;
  int reached_from_ = -1;  // the chart that led to the candidate, if any
  // Charts that the candidate fits, but may be on another sheet than.
  std::vector<std::pair<int, Beside>> doubtful_;
  std::vector<std::pair<ChartKey, int>> sorted_;
};

}  // namespace graspatlas
