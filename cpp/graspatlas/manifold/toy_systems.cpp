#include "graspatlas/manifold/toy_systems.hpp"

#include <Eigen/Geometry>
#include <cmath>

#include "graspatlas/errors.hpp"
#include "graspatlas/manifold/angle.hpp"
#include "graspatlas/manifold/quaternion.hpp"

namespace graspatlas {

Sphere::Sphere(int n) : System(n, n, 1, n) {}

void Sphere::residual(const double* x, double* R) {
  double sum = -1.0;
  for (int i = 0; i < tangent_size(); ++i) sum += x[i] * x[i];
  R[0] = sum;
}

void Sphere::linearize(const double* x, double* R, double* J) {
  residual(x, R);
  for (int i = 0; i < tangent_size(); ++i) J[i] = 2.0 * x[i];
}

Torus::Torus(double major_radius, double minor_radius)
    : System(3, 3, 1, 3), major_(major_radius), minor_(minor_radius) {
  if (!(minor_radius > 0.0) || !(major_radius > minor_radius) || !std::isfinite(major_radius))
    throw Error("a torus needs 0 < minor radius < major radius; got major " + to_text(major_radius) + ", minor " +
                to_text(minor_radius));
}

void Torus::residual(const double* x, double* R) {
  const double d = std::hypot(x[0], x[1]) - major_;
  R[0] = d * d + x[2] * x[2] - minor_ * minor_;
}

void Torus::linearize(const double* x, double* R, double* J) {
  residual(x, R);
  const double rho = std::hypot(x[0], x[1]);
  const double factor = 2.0 * (rho - major_) / rho;
  J[0] = factor * x[0];
  J[1] = factor * x[1];
  J[2] = 2.0 * x[2];
}

Angles::Angles(int n) : System(n, n, 0, 2 * n) {}

void Angles::integrate(const double* x, const double* v, double* out) const {
  for (int i = 0; i < tangent_size(); ++i) out[i] = wrap_angle(x[i] + v[i]);
}

void Angles::difference(const double* x0, const double* x1, double* out) const {
  for (int i = 0; i < tangent_size(); ++i) out[i] = wrap_angle(x1[i] - x0[i]);
}

void Angles::embed(const double* x, double* out) const {
  for (int i = 0; i < tangent_size(); ++i) {
    out[2 * i] = std::cos(x[i]);
    out[2 * i + 1] = std::sin(x[i]);
  }
}

double Angles::radius_limit() const { return kLargestAngularRadius; }

Rotations::Rotations() : System(4, 3, 0, kRotationEmbedding) {}

double Rotations::radius_limit() const { return kLargestAngularRadius; }

void Rotations::check_point(const double* x) const { check_quaternion(x); }

void Rotations::integrate(const double* x, const double* v, double* out) const {
  const Eigen::Map<const Eigen::Quaterniond> q(x);
  const Eigen::Vector3d w(v[0], v[1], v[2]);
  const double angle = w.norm();
  const double half = 0.5 * angle;
  const double sinc = angle > 1e-8 ? std::sin(half) / angle : 0.5 - angle * angle / 48.0;
  const Eigen::Quaterniond step(std::cos(half), sinc * w.x(), sinc * w.y(), sinc * w.z());
  const Eigen::Quaterniond moved = (q * step).normalized();
  Eigen::Map<Eigen::Vector4d>{out} = moved.coeffs();
}

void Rotations::difference(const double* x0, const double* x1, double* out) const {
  const Eigen::Map<const Eigen::Quaterniond> q0(x0), q1(x1);
  Eigen::Quaterniond d = q0.conjugate() * q1;
  if (d.w() < 0.0) d.coeffs() *= -1.0;
  const double sine = d.vec().norm();
  const double scale = sine > 1e-8 ? 2.0 * std::atan2(sine, d.w()) / sine : 2.0 / d.w();
  Eigen::Map<Eigen::Vector3d>{out} = scale * d.vec();
}

void Rotations::embed(const double* x, double* out) const { embed_rotation(x, out); }

}  // namespace graspatlas
