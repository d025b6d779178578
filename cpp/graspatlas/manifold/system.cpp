#include "graspatlas/manifold/system.hpp"

#include <algorithm>
#include <cmath>

#include "graspatlas/errors.hpp"
#include "graspatlas/manifold/tangent.hpp"

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

std::unique_ptr<System> System::Spares::take() {
  const std::lock_guard lock(mutex_);
  if (clones_.empty()) return nullptr;
  auto clone = std::move(clones_.back());
  clones_.pop_back();
  return clone;
}

void System::Spares::put(std::unique_ptr<System> clone) {
  const std::lock_guard lock(mutex_);
  clones_.push_back(std::move(clone));
}

void System::integrate(const double* x, const double* v, double* out) const {
  for (int i = 0; i < tangent_size_; ++i) out[i] = x[i] + v[i];
}

void System::difference(const double* x0, const double* x1, double* out) const {
  for (int i = 0; i < tangent_size_; ++i) out[i] = x1[i] - x0[i];
}

bool System::same_point(const double* x0, const double* x1, double tolerance) const {
  std::vector<double> d(static_cast<std::size_t>(tangent_size_));
  difference(x0, x1, d.data());
  return std::sqrt(squared_length(d.data(), tangent_size_)) <= tolerance;
}

void System::embed(const double* x, double* out) const { std::copy_n(x, embedding_size_, out); }

void System::slack(const double*, double*) const {}

std::string System::bound_name(int i) const { return "bound " + std::to_string(i); }

void System::check_point(const double*) const {}

double System::radius_limit() const { return 1e100; }

}  // namespace graspatlas
