#include "graspatlas/continuation/system.hpp"

#include <algorithm>

namespace graspatlas {

System::System(int configuration_size, int tangent_size, int equation_count, int embedding_size)
    : configuration_size_(configuration_size),
      tangent_size_(tangent_size),
      equation_count_(equation_count),
      embedding_size_(embedding_size),
      bound_normals_(0, tangent_size) {
  if (tangent_size < 1 || equation_count < 0 || equation_count >= tangent_size)
    throw Error("a system needs at least one variable and fewer equations than variables; got " +
                std::to_string(tangent_size) + " variables and " + std::to_string(equation_count) + " equations");
}

void System::integrate(const double* x, const double* v, double* out) const {
  for (int i = 0; i < tangent_size_; ++i) out[i] = x[i] + v[i];
}

void System::difference(const double* x0, const double* x1, double* out) const {
  for (int i = 0; i < tangent_size_; ++i) out[i] = x1[i] - x0[i];
}

void System::embed(const double* x, double* out) const { std::copy_n(x, embedding_size_, out); }

void System::slack(const double*, double*) const {}

}  // namespace graspatlas
