#include "graspatlas/climb/surroundings.hpp"

namespace graspatlas {

Surroundings::Surroundings(const System& system)
    : system_(system),
      k_(system.dimension()),
      x_(system.configuration_size()),
      step_(system.tangent_size()),
      Phi_(k_, system.tangent_size()),
      ahead_(k_, system.configuration_size()),
      behind_(ahead_) {}

void Surroundings::set(const double* x, const double* Phi) {
  x_.assign(x, x + system_.configuration_size());
  Phi_ = Eigen::Map<const RowMatrix>(Phi, k_, system_.tangent_size());
  for (int i = 0; i < k_; ++i) {
    for (std::size_t c = 0; c < step_.size(); ++c) step_[c] = h_ * Phi_(i, static_cast<Eigen::Index>(c));
    system_.integrate(x, step_.data(), ahead_.row(i).data());
    for (double& number : step_) number = -number;
    system_.integrate(x, step_.data(), behind_.row(i).data());
  }
}

}  // namespace graspatlas
