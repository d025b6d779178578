#include "graspatlas/continuation/neighbour_test.hpp"

#include <algorithm>

namespace graspatlas {

namespace {

// Two charts that are more doubtful than this are neighbours only if the newer leads to the older, and each to the
// other in grave doubt: see squared_sheet_doubt. Charts of smooth manifolds are mostly below a hundredth.
constexpr double kDoubt = 0.05, kGraveDoubt = 0.2;
// A projection from one chart leads to another when it comes as near as this to its centre, and to its tangent space,
// as shares of the displacement. The first is for the curvature of the configuration space, where coordinates above one
// centre are not those above another; sheets are apart by half of kDoubt at least.
constexpr double kMiss = 0.1, kOff = 0.2 * kDoubt;
// To tell that, the projection's last step may be this long, as a share of the displacement: others would be shorter by
// about as much.
constexpr double kNear = 0.02;

}  // namespace

NeighbourTest::NeighbourTest(System& system, Newton& newton, double radius, double epsilon)
    : system_(system),
      newton_(newton),
      radius_(radius),
      epsilon_(epsilon),
      n_(system.tangent_size()),
      k_(system.dimension()),
      displacement_(n_),
      work_(2 * static_cast<std::size_t>(k_) * k_),
      step_(n_),
      above_(system.configuration_size()),
      miss_(n_),
      in_chart_(k_) {}

bool NeighbourTest::fits(const double* x_i, const double* Phi_i, const double* x_j, const double* Phi_j, double* p_ij,
                         double* p_ji) {
  system_.difference(x_i, x_j, displacement_.data());
  switch (k_) {
    case 2:
      return fit<2>(Phi_i, Phi_j, p_ij, p_ji);
    case 3:
      return fit<3>(Phi_i, Phi_j, p_ij, p_ji);
    case 4:
      return fit<4>(Phi_i, Phi_j, p_ij, p_ji);
    case 5:
      return fit<5>(Phi_i, Phi_j, p_ij, p_ji);
    case 6:
      return fit<6>(Phi_i, Phi_j, p_ij, p_ji);
    default:
      return fit<0>(Phi_i, Phi_j, p_ij, p_ji);
  }
}

// Eq (17) is a length, which may exceed a chart's own size: then charts on two sides of a fold would cut each other at
// images far from the middle between them, and leave a gap. So the displacement between the centres, too, may differ
// from either tangent space by no larger an angle than eq (18) allows between the spaces.
template <int K>
bool NeighbourTest::fit(const double* Phi_i, const double* Phi_j, double* p_ij, double* p_ji) {
  const double squared = project_on_both<K>(Phi_i, Phi_j, displacement_.data(), k_, n_, p_ij, p_ji);
  if (squared > 4.0 * radius_ * radius_) return false;
  const double cosine = 1.0 - epsilon_;
  const double limit = std::min(epsilon_ * epsilon_, (1.0 - cosine * cosine) * squared);
  // What of the displacement lies outside a tangent space.
  if (squared - squared_length(p_ij, k_) > limit || squared - squared_length(p_ji, k_) > limit) return false;
  double* const M = work_.data();
  multiply_bases<K>(Phi_i, Phi_j, k_, n_, M);
  if (!tangent_spaces_agree(M, k_, cosine, M + static_cast<std::ptrdiff_t>(k_) * k_)) return false;
  squared_doubt_ = squared > 0.0 ? squared_sheet_doubt(p_ij, p_ji, M, squared, k_) : 0.0;
  for (int a = 0; a < k_; ++a) p_ji[a] = -p_ji[a];
  return true;
}

bool NeighbourTest::leads_back(const double* x_i, const double* Phi_i, const double* x_j, const double* Phi_j,
                               const double* p_ij, const double* p_ji) {
  // The newer chart was reached from an older one: the way back says more.
  if (squared_doubt_ > kDoubt * kDoubt && !leads_to(x_j, Phi_j, p_ji, x_i, Phi_i)) return false;
  return squared_doubt_ <= kGraveDoubt * kGraveDoubt || leads_to(x_i, Phi_i, p_ij, x_j, Phi_j);
}

bool NeighbourTest::leads_to(const double* x_i, const double* Phi_i, const double* p, const double* x_j,
                             const double* Phi_j) {
  tangent_vector(Phi_i, p, k_, n_, step_.data());
  system_.integrate(x_i, step_.data(), above_.data());
  ++projections_;
  const double squared = squared_length(step_.data(), n_);
  if (!(squared > 0.0)) return true;
  if (newton_.project_nearly(above_.data(), Phi_i, kNear * std::sqrt(squared)) != Projection::converged) return false;
  system_.difference(above_.data(), x_j, miss_.data());
  if (squared_length(miss_.data(), n_) > kMiss * kMiss * squared) return false;
  return project_displacement(Phi_j, miss_.data(), k_, n_, in_chart_.data()) <= kOff * kOff * squared;
}

}  // namespace graspatlas
