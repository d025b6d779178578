#pragma once

#include <vector>

#include "graspatlas/audit/walker.hpp"

namespace graspatlas {

/// Looks for points of a chart where the Jacobian loses rank, with the work space of one thread.
class RankSearch {
 public:
  /// Both are used by one thread; the walker moves.
  RankSearch(const System& system, Walker& walker, double radius);

  /// True when the Jacobian, to a tenth of what it is at the centre of a chart, loses rank within the chart.
  bool loses_rank(const double* center, const double* basis);

 private:
  double regularity_at(const double* x);
  void descent(double value, double h);

  const System& system_;
  Walker& walker_;
  double radius_;
  std::vector<double> u_, step_, x_, direction_;
};

}  // namespace graspatlas
