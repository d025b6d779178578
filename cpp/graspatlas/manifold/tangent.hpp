#pragma once

#include <algorithm>
#include <cstddef>

namespace graspatlas {

/// Tangent vectors [n], and their coordinates [k] in a tangent basis Phi, row-major [k x n].

inline double squared_length(const double* v, int size) {
  double sum = 0.0;
  for (int c = 0; c < size; ++c) sum += v[c] * v[c];
  return sum;
}

/// out [n] = Phi' u: the tangent vector with coordinates u [k].
inline void tangent_vector(const double* Phi, const double* u, int k, int n, double* out) {
  for (int c = 0; c < n; ++c) {
    double sum = 0.0;
    for (int a = 0; a < k; ++a) sum += Phi[static_cast<std::size_t>(a) * n + c] * u[a];
    out[c] = sum;
  }
}

/// u [k] = Phi v: the coordinates of a tangent vector v [n], or of its projection.
inline void tangent_coordinates(const double* Phi, const double* v, int k, int n, double* u) {
  for (int a = 0; a < k; ++a) {
    const double* row = Phi + static_cast<std::size_t>(a) * n;
    double dot = 0.0;
    for (int c = 0; c < n; ++c) dot += row[c] * v[c];
    u[a] = dot;
  }
}

/// The same; returns the squared distance of v from the tangent space.
inline double project_on_tangent_space(const double* Phi, const double* v, int k, int n, double* u) {
  tangent_coordinates(Phi, v, k, n, u);
  return std::max(squared_length(v, n) - squared_length(u, k), 0.0);
}

}  // namespace graspatlas
