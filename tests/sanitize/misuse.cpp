#include <limits>
#include <memory>

#include "graspatlas/atlas/atlas.hpp"
#include "graspatlas/manifold/toy_systems.hpp"
#include "strain.hpp"

namespace strain {

namespace {

using graspatlas::Atlas;
using graspatlas::AtlasOptions;
using graspatlas::System;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

void build(System& system, const std::vector<double>& x0, double radius = 0.1, double epsilon = 0.1) {
  AtlasOptions options;
  options.radius = radius;
  options.epsilon = epsilon;
  Atlas(system, x0.data(), options).expand(50, 1.0);
}

/// R(x) = 0 with the same equation twice: the Jacobian has no full rank anywhere.
class Redundant : public System {
 public:
  Redundant() : System(3, 3, 2, 3) {}
  void residual(const double* x, double* R) override {
    R[0] = x[0] * x[0] + x[1] * x[1] + x[2] * x[2] - 1.0;
    R[1] = 3.0 * R[0];
  }
  void linearize(const double* x, double* R, double* J) override {
    residual(x, R);
    for (int i = 0; i < 3; ++i) J[3 + i] = 3.0 * (J[i] = 2.0 * x[i]);
  }
};

/// Throws in the middle of the work.
class Throwing : public graspatlas::Sphere {
 public:
  explicit Throwing(int calls) : Sphere(3), left_(calls) {}
  void residual(const double* x, double* R) override {
    if (--left_ < 0) throw std::length_error("from the system");
    Sphere::residual(x, R);
  }
  std::unique_ptr<System> clone() const override { return std::make_unique<Throwing>(*this); }

 private:
  int left_;
};

}  // namespace

void misuse() {
  graspatlas::Sphere sphere(3);
  const std::vector<double> pole = {0.0, 0.0, 1.0};
  for (double bad : {0.0, -1.0, 1e-300, kNaN, kInfinity, 1e300}) refuse([&] { build(sphere, pole, bad); }, "radius");
  for (double bad : {0.0, -1.0, kNaN, kInfinity, 1.0}) refuse([&] { build(sphere, pole, 0.1, bad); }, "epsilon");
  for (double bad : {kNaN, kInfinity}) refuse([&] { build(sphere, {bad, 0.0, 0.0}); }, "not finite");
  refuse([&] { build(sphere, {0.0, 0.0, 0.0}); }, "rank");
  refuse([&] { build(sphere, {1e200, 1e200, 0.0}); }, "could not be projected");
  Redundant redundant;
  refuse([&] { build(redundant, pole); }, "redundant");
  graspatlas::Rotations rotations;
  refuse([&] { build(rotations, {0.0, 0.0, 0.0, 0.0}); }, "quaternion");
  refuse([&] { build(rotations, {0.0, 0.0, 0.0, 1.0}, 2.0); }, "radius");
  graspatlas::Sphere large(14);
  refuse([&] { build(large, {1.0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0}); }, "dimensions");
  refuse([] { graspatlas::Sphere(1); }, "variable");
  refuse([] { graspatlas::Torus(0.5, 0.5); }, "torus");
  refuse([] { graspatlas::Torus(kNaN, 0.5); }, "torus");
  refuse([] { graspatlas::Polytope(0, 1.0); }, "dimensions");
  for (int calls : {0, 1, 5, 60}) {
    Throwing throwing(calls);
    bool thrown = false;
    try {
      build(throwing, pole);
    } catch (const std::length_error&) {
      thrown = true;
    }
    require(thrown, "an exception of the system comes through");
  }
}

}  // namespace strain
