#pragma once

#include <cstdint>
#include <vector>

#include "graspatlas/manifold/newton.hpp"
#include "graspatlas/manifold/system.hpp"

namespace graspatlas {

/// A point j of the manifold beside a point i, as their tangent spaces see each other; n numbers in a tangent vector.
struct Beside {
  Beside(int n, int k) : displacement(n), p_ij(k), p_ji(k), product(static_cast<std::size_t>(k) * k) {}

  std::vector<double> displacement;  ///< x_j (-) x_i [n]
  /// The image of each centre in the other's tangent space: Phi_i (x_j (-) x_i), Phi_j (x_i (-) x_j) [k].
  std::vector<double> p_ij, p_ji;
  std::vector<double> product;  ///< Phi_i Phi_j' [k x k]
  double squared = 0.0;         ///< squared length of the displacement
  /// Square of how far the displacement is from what the tangent spaces expect of points on one sheet: of two sheets it
  /// is twice their distance. See neighbour_test.cpp.
  double squared_mismatch = 0.0;
};

/// Whether two points of the manifold with their tangent bases are near enough to each other, and on one sheet, to be
/// charts that cut each other: the two tests of the paper between neighbours, and what tells sheets apart. With work
/// space, for one thread.
class NeighbourTest {
 public:
  /// `newton` is for projections from one point to another, which overwrite its factorisation.
  NeighbourTest(System& system, Newton& newton, double radius, double epsilon);

  /// The point j of the tests that follow, with its basis, which must stay where they are: the newer of two.
  void put(const double* x_j, const double* Phi_j);

  /// Eqs (17) and (18) between points i and j, and whether they are on one sheet.
  bool passes(const double* x_i, const double* Phi_i, Beside& beside) {
    return fits(x_i, Phi_i, beside) && leads_back(x_i, Phi_i, beside);
  }

  /// The two parts of `passes`: what the points and bases say alone, and, where that leaves doubts about the sheets,
  /// projections from one point to the other, much more work.
  bool fits(const double* x_i, const double* Phi_i, Beside& beside);
  bool leads_back(const double* x_i, const double* Phi_i, const Beside& beside);

  /// Of points that fit: whether they are on one sheet beyond doubt, and whether their bases are oriented differently.
  bool beyond_doubt(const Beside& beside) const;
  bool turned(const Beside& beside);

  /// True when the point of the manifold above p in the tangent space at x_i is x_j, and none of another sheet.
  bool leads_to(const double* x_i, const double* Phi_i, const double* p, const double* x_j, const double* Phi_j);

  /// Projections that leads_to has made.
  std::int64_t projections() const { return projections_; }

 private:
  template <int K>
  bool fit(const double* Phi_i, Beside& beside);

  System& system_;
  Newton& newton_;
  double radius_, epsilon_;
  int n_, k_;
  std::int64_t projections_ = 0;
  const double *x_j_ = nullptr, *Phi_j_ = nullptr;
  std::vector<double> by_number_;  // Phi_j transposed [n x k]
  std::vector<double> work_, step_, above_, miss_, in_chart_;
};

}  // namespace graspatlas
