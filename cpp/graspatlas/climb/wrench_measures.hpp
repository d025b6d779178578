#pragma once

#include "graspatlas/climb/measure.hpp"
#include "graspatlas/quality/contact_wrenches.hpp"
#include "graspatlas/quality/wrench_hull.hpp"

namespace graspatlas {

/// Radius of the largest ball around the origin in the hull of a grasp's contact wrenches (Ferrari and Canny's epsilon)
/// as an index; 0 without force closure. D is 3 in the plane and else 6.
///
/// Its slopes are those of the facet that the ball touches: while that turns, its foot point stays nearest, so only how
/// far the corners move along its normal counts, by their weights in the foot point.
template <int D>
class EpsilonMeasure : public Measure {
 public:
  EpsilonMeasure(GraspSystem& system, const Pyramids& pyramids) : wrenches_(system, pyramids) {}
  void linearize(const Surroundings& at, double reach, Rows& rows) override;
  bool revisit(const double* x, double* values) override;

 private:
  ContactWrenches wrenches_;
  WrenchHull<D> hull_;
};

extern template class EpsilonMeasure<3>;
extern template class EpsilonMeasure<6>;

}  // namespace graspatlas
