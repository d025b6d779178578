#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "graspatlas/manifold/newton.hpp"
#include "graspatlas/manifold/system.hpp"
#include "graspatlas/manifold/tangent.hpp"

namespace graspatlas {

/// What a chart's tangent basis says about another point: the two tests of the paper between neighbours.
///
/// Phi is row-major [k x n]; d = x_j (-) x_i is the displacement from the chart's centre.

/// Projected centre p = Phi d [k]; returns the squared distance of d from the tangent space.
inline double project_displacement(const double* Phi, const double* d, int k, int n, double* p) {
  double squared = 0.0;
  for (int c = 0; c < n; ++c) squared += d[c] * d[c];
  for (int i = 0; i < k; ++i) {
    const double* row = Phi + static_cast<std::size_t>(i) * n;
    double dot = 0.0;
    for (int c = 0; c < n; ++c) dot += row[c] * d[c];
    p[i] = dot;
    squared -= dot * dot;
  }
  return squared > 0.0 ? squared : 0.0;
}

/// Coordinates of one vector in two bases: p_i = Phi_i d, p_j = Phi_j d [k]; returns |d|^2. Here and below K is k where
/// the compiler knows it, which then keeps all sums side by side, else 0.
template <int K>
double project_on_both(const double* Phi_i, const double* Phi_j, const double* d, int k, int n, double* p_i,
                       double* p_j) {
  if constexpr (K == 0) {
    tangent_coordinates(Phi_i, d, k, n, p_i);
    tangent_coordinates(Phi_j, d, k, n, p_j);
    return squared_length(d, n);
  } else {
    double squared = 0.0, sums_i[K] = {}, sums_j[K] = {};
    for (int c = 0; c < n; ++c) {
      squared += d[c] * d[c];
      for (int a = 0; a < K; ++a) {
        sums_i[a] += Phi_i[a * n + c] * d[c];
        sums_j[a] += Phi_j[a * n + c] * d[c];
      }
    }
    std::copy_n(sums_i, K, p_i);
    std::copy_n(sums_j, K, p_j);
    return squared;
  }
}

/// M = Phi_i Phi_j' [k x k].
template <int K>
void multiply_bases(const double* Phi_i, const double* Phi_j, int k, int n, double* M) {
  if constexpr (K == 0) {
    for (int a = 0; a < k; ++a) tangent_coordinates(Phi_j, Phi_i + a * n, k, n, M + a * k);
  } else {
    for (int a = 0; a < K; ++a) {
      double products[K] = {};
      for (int c = 0; c < n; ++c)
        for (int b = 0; b < K; ++b) products[b] += Phi_i[a * n + c] * Phi_j[b * n + c];
      std::copy_n(products, K, M + a * K);
    }
  }
}

/// Eq (18): true when the smallest singular value of M = Phi_i Phi_j' [k x k] is at least `cosine` >= 0, that is when
/// no direction of one tangent space makes a larger angle with the other than its arc cosine. `work` holds k x k
/// numbers.
///
/// The test is that M M' - cosine^2 I has a Cholesky factor, which needs no singular values.
inline bool tangent_spaces_agree(const double* M, int k, double cosine, double* work) {
  double* S = work;
  for (int a = 0; a < k; ++a) {
    for (int b = 0; b <= a; ++b) {
      double sum = a == b ? -cosine * cosine : 0.0;
      for (int c = 0; c < k; ++c) sum += M[a * k + c] * M[b * k + c];
      for (int c = 0; c < b; ++c) sum -= S[a * k + c] * S[b * k + c];
      if (a == b) {
        if (!(sum >= 0.0)) return false;
        S[a * k + a] = std::sqrt(sum);
      } else {
        S[a * k + b] = S[b * k + b] > 0.0 ? sum / S[b * k + b] : 0.0;
      }
    }
  }
  return true;
}

/// How doubtful it is that two charts lie on one sheet: how far d is from the sum of its parts in the two tangent
/// spaces that the trapezoidal rule expects, beside |d|. On one sheet the offsets of d from the tangent spaces at its
/// two ends are opposite, but for third derivatives; from one sheet to another they add up to twice the sheets'
/// distance. Returns the square of that share; below zero only by rounding.
///
/// p_i = Phi_i d, p_j = Phi_j d, M = Phi_i Phi_j' [k x k], squared = |d|^2 > 0.
inline double squared_sheet_doubt(const double* p_i, const double* p_j, const double* M, double squared, int k) {
  double squared_i = 0.0, squared_j = 0.0, mixed = 0.0;
  for (int a = 0; a < k; ++a) {
    squared_i += p_i[a] * p_i[a];
    squared_j += p_j[a] * p_j[a];
    double dot = 0.0;
    for (int b = 0; b < k; ++b) dot += M[a * k + b] * p_j[b];
    mixed += p_i[a] * dot;
  }
  // Offsets n_i = d - Phi_i' p_i and n_j; of their sum the part along d does not count.
  const double both = 2.0 * squared - squared_i - squared_j;
  const double sum = both + 2.0 * (squared - squared_i - squared_j + mixed) - both * both / squared;
  return sum / squared;
}

/// True when the determinant of M [k x k] is negative; M is overwritten.
inline bool determinant_negative(double* M, int k) {
  if (k == 2) return M[0] * M[3] < M[1] * M[2];
  bool negative = false;
  for (int c = 0; c < k; ++c) {
    int pivot = c;
    for (int i = c + 1; i < k; ++i)
      if (std::abs(M[i * k + c]) > std::abs(M[pivot * k + c])) pivot = i;
    if (pivot != c) {
      for (int j = c; j < k; ++j) std::swap(M[c * k + j], M[pivot * k + j]);
      negative = !negative;
    }
    if (M[c * k + c] < 0.0) negative = !negative;
    if (M[c * k + c] == 0.0) continue;
    for (int i = c + 1; i < k; ++i) {
      const double factor = M[i * k + c] / M[c * k + c];
      for (int j = c; j < k; ++j) M[i * k + j] -= factor * M[c * k + j];
    }
  }
  return negative;
}

/// Whether two points of the manifold with their tangent bases are near enough to each other, and on one sheet, to be
/// charts that cut each other; with work space, for one thread.
class NeighbourTest {
 public:
  NeighbourTest(System& system, Newton& newton, double radius, double epsilon);

  /// Eqs (17) and (18) between points i and j, where j is the newer, and the images of each in the other's tangent
  /// space: p_ij = Phi_i (x_j (-) x_i), p_ji = Phi_j (x_i (-) x_j).
  bool passes(const double* x_i, const double* Phi_i, const double* x_j, const double* Phi_j, double* p_ij,
              double* p_ji) {
    return fits(x_i, Phi_i, x_j, Phi_j, p_ij, p_ji) && leads_back(x_i, Phi_i, x_j, Phi_j, p_ij, p_ji);
  }

  /// The two parts of `passes`: what the points and bases say alone, and, where that leaves doubts about the sheets,
  /// projections from one point to the other. These take Newton's factorisation.
  bool fits(const double* x_i, const double* Phi_i, const double* x_j, const double* Phi_j, double* p_ij, double* p_ji);
  bool leads_back(const double* x_i, const double* Phi_i, const double* x_j, const double* Phi_j, const double* p_ij,
                  const double* p_ji);

  /// True when the point of the manifold above p in the tangent space at x_i is x_j, and none of another sheet.
  bool leads_to(const double* x_i, const double* Phi_i, const double* p, const double* x_j, const double* Phi_j);

  /// Of the last call of fits or passes: x_j (-) x_i, and Phi_i Phi_j' [k x k], for the caller to overwrite.
  const double* displacement() const { return displacement_.data(); }
  double* bases_product() { return work_.data(); }
  /// Projections that leads_to has made.
  std::int64_t projections() const { return projections_; }

 private:
  template <int K>
  bool fit(const double* Phi_i, const double* Phi_j, double* p_ij, double* p_ji);

  System& system_;
  Newton& newton_;
  double radius_, epsilon_;
  double squared_doubt_ = 0.0;  // of the points that fitted last
  int n_, k_;
  std::int64_t projections_ = 0;
  std::vector<double> displacement_, work_, step_, above_, miss_, in_chart_;
};

}  // namespace graspatlas
