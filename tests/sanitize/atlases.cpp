#include <algorithm>
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

constexpr double kForever = 1e9;
constexpr std::int64_t kNoLimit = std::numeric_limits<std::int64_t>::max();
constexpr double kPi = 3.14159265358979323846;

AtlasOptions options(double radius, double epsilon) {
  AtlasOptions out;
  out.radius = radius;
  out.epsilon = epsilon;
  return out;
}

/// The part of a unit sphere below a height: bounds, and points where the residual is no number.
class Bowl : public graspatlas::Sphere {
 public:
  Bowl(int n, double height, double hole) : Sphere(n), height_(height), hole_(hole) {
    graspatlas::RowMatrix B = graspatlas::RowMatrix::Zero(1, n);
    B(0, n - 1) = 1.0;
    set_bound_normals(B);
  }
  void residual(const double* x, double* R) override {
    Sphere::residual(x, R);
    if (x[0] > hole_) R[0] = std::numeric_limits<double>::quiet_NaN();
  }
  void slack(const double* x, double* out) const override { out[0] = height_ - x[tangent_size() - 1]; }
  std::unique_ptr<System> clone() const override { return std::make_unique<Bowl>(*this); }

 private:
  double height_, hole_;
};

/// Two unit spheres in R^n; they meet in a sphere of n - 2 dimensions, where the Jacobian nearly loses rank when they
/// hardly touch.
class TwoSpheres : public System {
 public:
  TwoSpheres(int n, double distance) : System(n, n, 2, n), distance_(distance) {}
  void residual(const double* x, double* R) override {
    R[0] = R[1] = -1.0;
    for (int i = 0; i < tangent_size(); ++i) {
      const double y = i == 0 ? x[i] - distance_ : x[i];
      R[0] += x[i] * x[i];
      R[1] += y * y;
    }
  }
  void linearize(const double* x, double* R, double* J) override {
    residual(x, R);
    for (int i = 0; i < tangent_size(); ++i) {
      J[i] = 2.0 * x[i];
      J[tangent_size() + i] = 2.0 * (i == 0 ? x[i] - distance_ : x[i]);
    }
  }

 private:
  double distance_;
};

// Lengths (k = 1) or areas (k = 2) of all polytopes.
double covered(const Atlas& atlas) {
  double sum = 0.0;
  for (std::int64_t i = 0; i < atlas.count(); ++i) {
    const auto& p = atlas.chart(i).polytope;
    if (p.dimension() == 1) {
      double low = 0.0, high = 0.0;
      for (int v = 0; v < p.vertex_count(); ++v) {
        low = std::min(low, *p.vertex(v));
        high = std::max(high, *p.vertex(v));
      }
      sum += high - low;
      continue;
    }
    std::vector<std::array<double, 3>> corners;
    for (int v = 0; v < p.vertex_count(); ++v) {
      const double x = p.vertex(v)[0], y = p.vertex(v)[1];
      corners.push_back({std::atan2(y, x), x, y});
    }
    std::sort(corners.begin(), corners.end());
    for (std::size_t a = 0; a < corners.size(); ++a) {
      const auto& [t, x, y] = corners[a];
      const auto& [t_next, x_next, y_next] = corners[(a + 1) % corners.size()];
      sum += 0.5 * (x * y_next - x_next * y);
    }
  }
  return sum;
}

void check(const Atlas& atlas, double radius) {
  System& system = const_cast<System&>(atlas.system());
  const int n = system.tangent_size(), k = system.dimension();
  std::vector<double> R(system.equation_count()), J(static_cast<std::size_t>(system.equation_count()) * n), d(n);
  for (std::int64_t i = 0; i < atlas.count(); ++i) {
    system.linearize(atlas.center(i), R.data(), J.data());
    for (double r : R) require(std::abs(r) <= 1e-9, "centres lie on the manifold");
    for (int a = 0; a < k; ++a) {
      const double* row = atlas.basis(i) + static_cast<std::ptrdiff_t>(a) * n;
      for (int e = 0; e < system.equation_count(); ++e) {
        double slope = 0.0;
        for (int c = 0; c < n; ++c) slope += J[static_cast<std::size_t>(e) * n + c] * row[c];
        require(std::abs(slope) <= 1e-6, "tangent bases lie in the null space of the Jacobian");
      }
    }
    if (graspatlas::listed_vertices(k) == graspatlas::Polytope::Listed::all)
      require(atlas.chart(i).polytope.vertex_count() > k, "polytopes have vertices");
  }
  for (std::int64_t j = 0; j < atlas.count(); ++j)
    for (int a = 0; a < atlas.chart(j).neighbour_count; ++a) {
      const int i = atlas.number(atlas.chart(j).neighbours[a].slot);
      require(0 <= i && i < j, "neighbours are older charts");
      system.difference(atlas.center(i), atlas.center(j), d.data());
      double squared = 0.0;
      for (double c : d) squared += c * c;
      require(std::sqrt(squared) <= 2.0 * radius + 1e-12, "neighbours are at most 2 r apart");
    }
}

void require_same(const Atlas& a, const Atlas& b, const char* what) {
  require(a.count() == b.count(), what);
  for (std::int64_t i = 0; i < a.count(); ++i) {
    require(std::equal(a.center(i), a.center(i) + a.system().configuration_size(), b.center(i)), what);
    const auto &p = a.chart(i).polytope, &q = b.chart(i).polytope;
    require(p.vertex_count() == q.vertex_count(), what);
    for (int v = 0; v < p.vertex_count(); ++v)
      require(std::equal(p.vertex(v), p.vertex(v) + p.dimension(), q.vertex(v)) && p.state(v) == q.state(v), what);
  }
}

// The same atlas, made anew from a checkpoint after every few charts.
void from_checkpoints(System& system, const std::vector<double>& x0, double radius, double epsilon,
                      const Atlas& whole) {
  auto atlas = std::make_unique<Atlas>(system, x0.data(), options(radius, epsilon));
  while (!atlas->complete()) {
    atlas->expand(atlas->count() + 13, kForever);
    atlas = std::make_unique<Atlas>(system, atlas->save(0), options(radius, epsilon), 2);
  }
  require_same(whole, *atlas, "an atlas from checkpoints is the atlas in one go");
  graspatlas::Checkpoint damaged = whole.save(0);
  damaged.centers.pop_back();
  bool refused = false;
  try {
    Atlas(system, damaged, options(radius, epsilon));
  } catch (const graspatlas::Error&) {
    refused = true;
  }
  require(refused, "a damaged checkpoint is refused");
}

// Expands and audits in turn until neither has anything left to do.
void finish(Atlas& atlas) {
  while (!atlas.audited()) {
    if (atlas.complete())
      atlas.audit(300, kForever);
    else
      atlas.expand(kNoLimit, kForever);
  }
}

std::int64_t trace(System& system, const std::vector<double>& x0, double radius, double epsilon, double size = 0.0) {
  Atlas atlas(system, x0.data(), options(radius, epsilon));
  finish(atlas);
  check(atlas, radius);
  Atlas other(system, x0.data(), options(radius, epsilon), 3);
  // In slices that grow, so that they come to be longer than threads take to start, however slow that is.
  double seconds = 1e-4;
  for (std::int64_t limit = 50; !other.complete(); limit += 50, seconds *= 1.1) other.expand(limit, seconds);
  finish(other);
  require_same(atlas, other, "threads make the same atlas");
  if (size > 0.0) require(std::abs(covered(atlas) / size - 1.0) < 0.05, "the charts cover the whole");
  return atlas.count();
}

// The same atlas in slices, by number and by time, and one that is cut short.
void in_slices(System& system, const std::vector<double>& x0, double radius, double epsilon) {
  Atlas whole(system, x0.data(), options(radius, epsilon));
  whole.expand(kNoLimit, kForever);
  const std::int64_t count = whole.count();
  Atlas atlas(system, x0.data(), options(radius, epsilon));
  for (std::int64_t limit = 1; !atlas.complete(); limit += 7) {
    atlas.expand(limit, limit % 2 ? kForever : 0.0);
    require(atlas.count() <= limit || limit == 1, "the limit of charts holds");
    check(atlas, radius);
  }
  require(atlas.count() == count, "an atlas in slices is the atlas in one go");
  from_checkpoints(system, x0, radius, epsilon, atlas);
  atlas.expand(kNoLimit, kForever);
  atlas.expand(-1, -1.0);
  require(atlas.count() == count, "a complete atlas stays as it is");
}

}  // namespace

void atlases() {
  const double eps = 0.1;
  graspatlas::Sphere circle(2), sphere(3), sphere_3(4), sphere_4(5);
  trace(circle, {1.0, 0.0}, 0.1, eps, 2.0 * kPi);
  trace(sphere, {0.0, 0.0, 1.0}, 0.1, eps, 4.0 * kPi);
  trace(sphere_3, {0.0, 0.0, 0.0, 1.0}, 0.35, 0.2);
  trace(sphere_4, {0.0, 0.0, 0.0, 0.0, 1.0}, 0.6, 0.4);
  graspatlas::Torus torus(0.8, 0.5), thin(1.0, 0.02);
  trace(torus, {1.3, 0.0, 0.0}, 0.1, eps, 4.0 * kPi * kPi * 0.8 * 0.5);
  trace(thin, {1.02, 0.0, 0.0}, 0.1, eps);
  graspatlas::Angles angle(1), angles(2), angles_3(3);
  trace(angle, {3.1}, 0.2, eps, 2.0 * kPi);
  trace(angles, {3.1, -3.1}, 0.3, eps, 4.0 * kPi * kPi);
  trace(angles_3, {0.0, 3.0, -3.0}, 0.9, 0.5);
  graspatlas::Rotations rotations;
  trace(rotations, {0.0, 0.0, 0.0, 1.0}, 0.5, 0.5);

  Bowl bowl(3, 0.3, 2.0), broken(3, 0.3, 0.5), rim(3, -0.999999, 2.0);
  trace(bowl, {0.0, 0.0, -1.0}, 0.2, eps);
  trace(broken, {0.0, 0.0, -1.0}, 0.2, eps);
  trace(rim, {0.0, 0.0, -1.0}, 0.2, eps);
  TwoSpheres ring(3, 1.0), shell(4, 1.0), needle(3, 1.9999999), pinhead(4, 1.9999999);
  trace(ring, {0.5, std::sqrt(0.75), 0.0}, 0.1, eps, 2.0 * kPi * std::sqrt(0.75));
  trace(shell, {0.5, std::sqrt(0.75), 0.0, 0.0}, 0.1, eps, 4.0 * kPi * 0.75);
  const double r = std::sqrt(1.0 - 0.25 * 1.9999999 * 1.9999999);
  trace(needle, {0.99999995, r, 0.0}, 0.1, eps);
  trace(pinhead, {0.99999995, r, 0.0, 0.0}, 0.1, eps);

  in_slices(sphere, {0.0, 0.0, 1.0}, 0.2, eps);
  in_slices(broken, {0.0, 0.0, -1.0}, 0.2, eps);
  in_slices(sphere_3, {0.0, 0.0, 0.0, 1.0}, 0.6, 0.4);

  // Charts far larger than the manifold, far smaller, and thresholds at their ends.
  for (double radius : {1e-7, 3.0, 1e6, 1e99})
    for (double epsilon : {1e-12, 0.5, 1.0 - 1e-12}) {
      Atlas atlas(sphere, std::vector<double>{0.0, 0.6, 0.8}.data(), options(radius, epsilon));
      atlas.expand(200, 0.2);
      check(atlas, radius);
    }
}

}  // namespace strain
