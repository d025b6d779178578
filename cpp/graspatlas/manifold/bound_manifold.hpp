#pragma once

#include <vector>

#include "graspatlas/manifold/bound_check.hpp"
#include "graspatlas/manifold/system.hpp"

namespace graspatlas {

/// The part of a manifold on which one bound is met exactly: one equation more, one dimension less.
class BoundManifold : public System {
 public:
  /// The system must outlive it, and is used by it only.
  BoundManifold(System& system, int bound)
      : System(system.configuration_size(), system.tangent_size(), system.equation_count() + 1,
               system.embedding_size()),
        system_(system),
        bound_(bound),
        bounds_(system) {}

  void residual(const double* x, double* R) override {
    system_.residual(x, R);
    R[equation_count() - 1] = slack_of_bound(x);
  }
  void linearize(const double* x, double* R, double* J) override {
    system_.linearize(x, R, J);
    R[equation_count() - 1] = slack_of_bound(x);
    const RowMatrix& B = system_.bound_normals();
    for (int c = 0; c < tangent_size(); ++c)
      J[static_cast<std::size_t>(equation_count() - 1) * tangent_size() + c] = -B(bound_, c);
  }
  void integrate(const double* x, const double* v, double* out) const override { system_.integrate(x, v, out); }
  void difference(const double* x0, const double* x1, double* out) const override { system_.difference(x0, x1, out); }
  void embed(const double* x, double* out) const override { system_.embed(x, out); }

 private:
  double slack_of_bound(const double* x) { return bounds_.slacks(x)[static_cast<std::size_t>(bound_)]; }

  System& system_;
  int bound_;
  BoundCheck bounds_;
};

}  // namespace graspatlas
