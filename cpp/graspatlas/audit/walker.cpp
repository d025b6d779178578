#include "graspatlas/audit/walker.hpp"

#include <algorithm>
#include <cmath>

namespace graspatlas {

Walker::Walker(System& system, const System& bounded, const AtlasOptions& options, int left_out)
    : system_(system),
      bounds_(bounded),
      left_out_(left_out),
      n_(system.tangent_size()),
      k_(system.dimension()),
      newton_(system),
      test_(system, newton_, options.radius, options.epsilon),
      x_(system.configuration_size()),
      Phi_(static_cast<std::size_t>(k_) * n_),
      heading_(n_),
      x_new_(x_.size()),
      Phi_new_(Phi_.size()),
      step_(n_),
      beside_(n_, k_) {}

void Walker::put(const double* point, const double* basis) {
  std::copy_n(point, x_.size(), x_.begin());
  std::copy_n(basis, Phi_.size(), Phi_.begin());
}

bool Walker::put_above(const double* point, const double* basis) {
  put(point, basis);
  return newton_.project(x_.data(), basis) == Projection::converged && bounds_.inside(x_.data(), left_out_) &&
         newton_.tangent_basis(Phi_.data());
}

bool Walker::follow(const double* point) {
  std::copy_n(point, x_.size(), x_.begin());
  return newton_.project(x_.data(), Phi_.data()) == Projection::converged && newton_.tangent_basis(Phi_.data());
}

Walker::Step Walker::step(const double* direction, double length) {
  const double norm = std::sqrt(squared_length(direction, k_));
  if (!(norm > 0.0)) return Step::failed;
  tangent_vector(Phi_.data(), direction, k_, n_, step_.data());
  for (double& s : step_) s *= length / norm;
  system_.integrate(x_.data(), step_.data(), x_new_.data());
  if (newton_.project(x_new_.data(), Phi_.data()) != Projection::converged) return Step::failed;
  if (!bounds_.inside(x_new_.data(), left_out_)) return Step::out_of_bounds;
  if (!newton_.tangent_basis(Phi_new_.data())) return Step::failed;
  test_.put(x_new_.data(), Phi_new_.data());
  if (!test_.passes(x_.data(), Phi_.data(), beside_)) return Step::failed;
  heading_ = beside_.displacement;
  std::swap(x_, x_new_);
  std::swap(Phi_, Phi_new_);
  return Step::taken;
}

Walker::Step Walker::step_halving(const double* direction, double& length, int halvings) {
  Step taken = step(direction, length);
  for (int i = 0; taken != Step::taken && i < halvings; ++i) taken = step(direction, length *= 0.5);
  return taken;
}

}  // namespace graspatlas
