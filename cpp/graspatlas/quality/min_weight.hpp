#pragma once

#include <vector>

#include "graspatlas/types.hpp"

namespace graspatlas {

/// Min-weight metric (Li, Culbertson, Burdick and Ames 2023): the largest l such that weights of at least l, which add
/// up to one, make the wrenches w_1 ... w_n cancel. As n l it is at most one.
///
/// Its dual is a linear programme with as many unknowns as a wrench has components, and no equation:
///
///   n l = 1 - max { c . z : (c - w_i) . z <= 1 for all i },   c the mean of the wrenches.
///
/// The simplex method starts at z = 0. In words: from the mean of the wrenches through the origin to the surface of
/// their hull, n l is the part of the way that lies behind the origin.
class MinWeight {
 public:
  /// n l of the rows of `wrenches` [n x components]; zero when the origin is outside their hull, or all lie in one
  /// plane.
  double normalized(const Eigen::Ref<const RowMatrix>& wrenches);

 private:
  int entering(bool first_of_all) const;
  int leaving(int column, double sign) const;
  void pivot(int row, int column);

  RowMatrix table_;                      // basic variables = right side - table * the others
  Vector right_, gain_;                  // gain of c . z with each of the others
  double value_ = 0.0;                   // of c . z
  std::vector<int> in_row_, in_column_;  // which variable: slack i as i, component j of z as -1 - j
};

}  // namespace graspatlas
