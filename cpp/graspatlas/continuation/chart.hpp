#pragma once

#include <cmath>
#include <cstddef>

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

/// Eq (18): true when the smallest singular value of Phi_i Phi_j' is at least `cosine` >= 0, that is when no
/// direction of one tangent space makes a larger angle with the other than its arc cosine. `work` holds k x k
/// numbers.
///
/// The test is that M M' - cosine^2 I has a Cholesky factor, which needs no singular values.
inline bool tangent_spaces_agree(const double* Phi_i, const double* Phi_j, int k, int n, double cosine, double* work) {
  double* M = work;
  double* S = work + k * k;
  for (int a = 0; a < k; ++a)
    for (int b = 0; b < k; ++b) {
      double dot = 0.0;
      for (int c = 0; c < n; ++c) dot += Phi_i[a * n + c] * Phi_j[b * n + c];
      M[a * k + b] = dot;
    }
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

}  // namespace graspatlas
