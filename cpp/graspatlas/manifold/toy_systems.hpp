#pragma once

#include <memory>

#include "graspatlas/manifold/system.hpp"

namespace graspatlas {

/// The unit sphere |x|^2 = 1 in R^n: dimension n - 1.
class Sphere : public System {
 public:
  explicit Sphere(int n);
  void residual(const double* x, double* R) override;
  void linearize(const double* x, double* R, double* J) override;
  std::unique_ptr<System> clone() const override { return std::make_unique<Sphere>(*this); }
};

/// The torus (sqrt(x^2 + y^2) - major)^2 + z^2 = minor^2 in R^3.
class Torus : public System {
 public:
  Torus(double major_radius, double minor_radius);
  double major_radius() const { return major_; }
  double minor_radius() const { return minor_; }
  void residual(const double* x, double* R) override;
  void linearize(const double* x, double* R, double* J) override;
  std::unique_ptr<System> clone() const override { return std::make_unique<Torus>(*this); }

 private:
  double major_, minor_;
};

/// n angles and no equation: a flat torus of dimension n. Angles lie in [-pi, pi).
class Angles : public System {
 public:
  explicit Angles(int n);
  void residual(const double*, double*) override {}
  void linearize(const double*, double*, double*) override {}
  void integrate(const double* x, const double* v, double* out) const override;
  void difference(const double* x0, const double* x1, double* out) const override;
  void embed(const double* x, double* out) const override;
  double radius_limit() const override;
  std::unique_ptr<System> clone() const override { return std::make_unique<Angles>(*this); }
};

/// All rotations and no equation: SO(3) as unit quaternions (x, y, z, w), tangent vectors are body rotation
/// vectors.
class Rotations : public System {
 public:
  Rotations();
  void residual(const double*, double*) override {}
  void linearize(const double*, double*, double*) override {}
  void integrate(const double* x, const double* v, double* out) const override;
  void difference(const double* x0, const double* x1, double* out) const override;
  void embed(const double* x, double* out) const override;
  void check_point(const double* x) const override;
  double radius_limit() const override;
  std::unique_ptr<System> clone() const override { return std::make_unique<Rotations>(*this); }
};

}  // namespace graspatlas
