#include <algorithm>
#include <memory>
#include <vector>

#include "graspatlas/atlas/atlas.hpp"
#include "graspatlas/manifold/lease.hpp"
#include "graspatlas/manifold/newton.hpp"
#include "graspatlas/manifold/toy_systems.hpp"
#include "strain.hpp"

namespace strain {

namespace {

using namespace graspatlas;

/// The unit sphere by way of scratch, as systems of grasps have it.
class SphereWithScratch : public Sphere {
 public:
  explicit SphereWithScratch(int n) : Sphere(n), squares_(n) {}
  void residual(const double* x, double* R) override {
    for (int i = 0; i < tangent_size(); ++i) squares_[i] = x[i] * x[i];
    R[0] = -1.0;
    for (double square : squares_) R[0] += square;
  }
  std::unique_ptr<System> clone() const override { return std::make_unique<SphereWithScratch>(*this); }

 private:
  std::vector<double> squares_;
};

std::vector<double> centers_of(const Atlas& atlas) {
  std::vector<double> out;
  for (std::int64_t i = 0; i < atlas.count(); ++i)
    out.insert(out.end(), atlas.center(i), atlas.center(i) + atlas.system().configuration_size());
  return out;
}

std::vector<double> grow(System& system, int threads) {
  AtlasOptions options;
  options.radius = 0.25;
  options.epsilon = 0.1;
  const double x0[] = {0.0, 0.0, 1.0};
  Atlas atlas(system, x0, options, threads);
  atlas.expand(1 << 20, 1e9);
  return centers_of(atlas);
}

// Projections of random points, each with a lease of its own.
std::vector<double> project(System& system, unsigned seed) {
  Random random(seed);
  std::vector<double> out, Phi(6);
  for (int i = 0; i < 200; ++i) {
    std::vector<double> x = random.direction(3);
    for (double& c : x) c *= 1.05;
    const Lease own(system);
    Newton newton(*own);
    require(newton.project_freely(x.data(), Phi.data()) == Projection::converged,
            "a point near the sphere is projected");
    out.insert(out.end(), x.begin(), x.end());
  }
  return out;
}

// A clone comes back and serves again; two leases at one time are two systems.
void leases_are_reused() {
  SphereWithScratch system(3);
  System* first = nullptr;
  {
    const Lease<System> a(system), b(system);
    require(&*a != &*b && &*a != &system && &*b != &system, "leases at the same time are systems of their own");
    first = &*a;
  }
  const Lease<System> again(system);
  require(&*again == first, "a clone that came back serves the next lease");
  const std::unique_ptr<System> copy = system.clone();
  const Lease<System> of_copy(*copy);
  require(&*of_copy != first && &*of_copy != copy.get(), "a copy has leases of its own");
}

}  // namespace

void users() {
  leases_are_reused();
  SphereWithScratch system(3);
  const std::vector<double> atlas = grow(system, 1), points = project(system, 7);
  together(6, [&](int user) {
    if (user % 2 == 0)
      require(grow(system, 1 + user / 2) == atlas, "atlases on one system are those of one user, to the bit");
    else
      require(project(system, 7) == points, "projections on one system are those of one user, to the bit");
  });
}

}  // namespace strain
