#include "graspatlas/continuation/neighbour_test.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "graspatlas/continuation/options.hpp"
#include "graspatlas/manifold/tangent.hpp"

namespace graspatlas {

namespace {

// Doubt is the mismatch as a share of the displacement. Two charts that are more doubtful than this are neighbours only
// if the newer leads to the older, and each to the other in grave doubt. Charts of smooth manifolds are mostly below a
// hundredth.
constexpr double kDoubt = 0.05, kGraveDoubt = 0.2;
// A projection from one chart leads to another when it comes as near as this to its centre, and to its tangent space,
// as shares of the displacement. The first is for the curvature of the configuration space, where coordinates above one
// centre are not those above another; sheets are apart by half of kDoubt at least.
constexpr double kMiss = 0.1, kOff = 0.2 * kDoubt;
// To tell that, the projection's last step may be this long, as a share of the displacement: others would be shorter by
// about as much.
constexpr double kNear = 0.02;

// Numbers for coordinates in a tangent space.
template <int K>
constexpr int kRoom = K > 0 ? K : kMostDimensions;

// Coordinates of d in two bases, p_i = Phi_i d and p_j = Phi_j d [k], of which the second is transposed [n x k]. Here
// and below K is k where the compiler knows it, which then keeps all sums side by side, else 0.
template <int K>
void project_on_both(const double* Phi_i, const double* by_number_j, const double* d, int dimension, int n, double* p_i,
                     double* p_j) {
  const int k = K > 0 ? K : dimension;
  double sums_i[kRoom<K>] = {}, sums_j[kRoom<K>] = {};
  for (int c = 0; c < n; ++c)
    for (int a = 0; a < k; ++a) {
      sums_i[a] += Phi_i[a * n + c] * d[c];
      sums_j[a] += by_number_j[c * k + a] * d[c];
    }
  std::copy_n(sums_i, k, p_i);
  std::copy_n(sums_j, k, p_j);
}

// M = Phi_i Phi_j' [k x k], the second transposed again.
template <int K>
void multiply_bases(const double* Phi_i, const double* by_number_j, int dimension, int n, double* M) {
  const int k = K > 0 ? K : dimension;
  for (int a = 0; a < k; ++a) {
    double sums[kRoom<K>] = {};
    for (int c = 0; c < n; ++c)
      for (int b = 0; b < k; ++b) sums[b] += Phi_i[a * n + c] * by_number_j[c * k + b];
    std::copy_n(sums, k, M + a * k);
  }
}

// Eq (18): true when the smallest singular value of M = Phi_i Phi_j' [k x k] is at least `cosine` >= 0, that is when no
// direction of one tangent space makes a larger angle with the other than its arc cosine. S is work space [k x k].
//
// The test is that M M' - cosine^2 I has a Cholesky factor, which needs no singular values.
template <int K>
bool tangent_spaces_agree(const double* M, int dimension, double cosine, double* S) {
  const int k = K > 0 ? K : dimension;
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

// How far d is from the sum of its parts in two tangent spaces that the trapezoidal rule expects, squared. On one sheet
// the offsets of d from the tangent spaces at its two ends are opposite, but for third derivatives; from one sheet to
// another they add up to twice the sheets' distance. Below zero only by rounding.
//
// p_i = Phi_i d, p_j = Phi_j d, M = Phi_i Phi_j' [k x k], squared = |d|^2 > 0.
template <int K>
double squared_sheet_mismatch(const double* p_i, const double* p_j, const double* M, double squared, int dimension) {
  const int k = K > 0 ? K : dimension;
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
  return both + 2.0 * (squared - squared_i - squared_j + mixed) - both * both / squared;
}

}  // namespace

NeighbourTest::NeighbourTest(System& system, Newton& newton, double radius, double epsilon)
    : system_(system),
      newton_(newton),
      radius_(radius),
      epsilon_(epsilon),
      n_(system.tangent_size()),
      k_(system.dimension()),
      by_number_(static_cast<std::size_t>(n_) * k_),
      work_(static_cast<std::size_t>(k_) * k_),
      step_(n_),
      above_(system.configuration_size()),
      miss_(n_),
      in_chart_(k_) {}

void NeighbourTest::put(const double* x_j, const double* Phi_j) {
  x_j_ = x_j;
  Phi_j_ = Phi_j;
  double* to = by_number_.data();
  for (int c = 0; c < n_; ++c)
    for (int a = 0; a < k_; ++a) *to++ = Phi_j[a * n_ + c];
}

bool NeighbourTest::fits(const double* x_i, const double* Phi_i, Beside& beside) {
  system_.difference(x_i, x_j_, beside.displacement.data());
  switch (k_) {
    case 2:
      return fit<2>(Phi_i, beside);
    case 3:
      return fit<3>(Phi_i, beside);
    case 4:
      return fit<4>(Phi_i, beside);
    case 5:
      return fit<5>(Phi_i, beside);
    case 6:
      return fit<6>(Phi_i, beside);
    default:
      return fit<0>(Phi_i, beside);
  }
}

// Eq (17) is a length, which may exceed a chart's own size: then charts on two sides of a fold would cut each other at
// images far from the middle between them, and leave a gap. So the displacement between the centres, too, may differ
// from either tangent space by no larger an angle than eq (18) allows between the spaces.
template <int K>
bool NeighbourTest::fit(const double* Phi_i, Beside& beside) {
  const int k = K > 0 ? K : k_;
  const double squared = beside.squared = squared_length(beside.displacement.data(), n_);
  if (squared > 4.0 * radius_ * radius_) return false;
  double *const p_ij = beside.p_ij.data(), *const p_ji = beside.p_ji.data(), *const M = beside.product.data();
  project_on_both<K>(Phi_i, by_number_.data(), beside.displacement.data(), k_, n_, p_ij, p_ji);
  const double cosine = 1.0 - epsilon_;
  const double limit = std::min(epsilon_ * epsilon_, (1.0 - cosine * cosine) * squared);
  // What of the displacement lies outside a tangent space.
  if (squared - squared_length(p_ij, k) > limit || squared - squared_length(p_ji, k) > limit) return false;
  multiply_bases<K>(Phi_i, by_number_.data(), k_, n_, M);
  if (!tangent_spaces_agree<K>(M, k, cosine, work_.data())) return false;
  beside.squared_mismatch = squared > 0.0 ? squared_sheet_mismatch<K>(p_ij, p_ji, M, squared, k) : 0.0;
  for (int a = 0; a < k; ++a) p_ji[a] = -p_ji[a];
  return true;
}

bool NeighbourTest::beyond_doubt(const Beside& beside) const {
  return beside.squared_mismatch <= kDoubt * kDoubt * beside.squared;
}

// By the sign of the product's determinant.
bool NeighbourTest::turned(const Beside& beside) {
  const int k = k_;
  double* const M = work_.data();
  std::copy(beside.product.begin(), beside.product.end(), M);
  if (k == 2) return M[0] * M[3] < M[1] * M[2];
  if (k == 3)
    return M[0] * (M[4] * M[8] - M[5] * M[7]) + M[1] * (M[5] * M[6] - M[3] * M[8]) +
               M[2] * (M[3] * M[7] - M[4] * M[6]) <
           0.0;
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

bool NeighbourTest::leads_back(const double* x_i, const double* Phi_i, const Beside& beside) {
  // The newer chart was reached from an older one: the way back says more.
  if (!beyond_doubt(beside) && !leads_to(x_j_, Phi_j_, beside.p_ji.data(), x_i, Phi_i)) return false;
  return beside.squared_mismatch <= kGraveDoubt * kGraveDoubt * beside.squared ||
         leads_to(x_i, Phi_i, beside.p_ij.data(), x_j_, Phi_j_);
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
  return project_on_tangent_space(Phi_j, miss_.data(), k_, n_, in_chart_.data()) <= kOff * kOff * squared;
}

}  // namespace graspatlas
