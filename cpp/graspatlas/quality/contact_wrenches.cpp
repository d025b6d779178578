#include "graspatlas/quality/contact_wrenches.hpp"

#include <Eigen/Geometry>
#include <cmath>

#include "graspatlas/errors.hpp"

namespace graspatlas {

namespace {

constexpr int kMinEdges = 3;

}  // namespace

ContactWrenches::ContactWrenches(GraspSystem& system, const Pyramids& pyramids)
    : system_(system),
      pyramids_(pyramids),
      planar_(system.object_joint().space_dimension() == 2),
      per_contact_(planar_ ? 2 : pyramids.edges + (pyramids.torsional > 0.0 ? 2 : 0)),
      points_(static_cast<std::size_t>(system.contact_count())) {
  if (!(pyramids.friction > 0.0) || !std::isfinite(pyramids.friction))
    throw Error("friction must be positive, got " + to_text(pyramids.friction));
  if (pyramids.edges < kMinEdges)
    throw Error("edges must be at least " + std::to_string(kMinEdges) + ", got " + std::to_string(pyramids.edges));
  if (!(pyramids.torsional >= 0.0) || !std::isfinite(pyramids.torsional))
    throw Error("torsional friction must not be negative, got " + to_text(pyramids.torsional));
  if (!(pyramids.length > 0.0) || !std::isfinite(pyramids.length))
    throw Error("the length that divides torques must be positive, got " + to_text(pyramids.length));
  wrenches_.resize(components(), static_cast<Eigen::Index>(per_contact_) * system.contact_count());
}

const Matrix& ContactWrenches::at(const double* x) {
  system_.contact_points(x, points_.data());
  const Placement& object = system_.model().placement(system_.model().object_joint_index());
  const Eigen::Matrix3d to_object = object.rotation.transpose();
  Eigen::Index first = 0;
  for (const ContactPoint& point : points_) {
    const Eigen::Vector3d arm = to_object * (point.object_point - object.translation);
    const Eigen::Vector3d normal = to_object * -point.object_normal;
    if (planar_)
      write_planar(arm, normal, first);
    else
      write(arm, normal, first);
    first += per_contact_;
  }
  return wrenches_;
}

void ContactWrenches::write_planar(const Eigen::Vector3d& arm, const Eigen::Vector3d& normal, Eigen::Index first) {
  const Eigen::Vector3d tangent(-normal.y(), normal.x(), 0.0);
  for (int side = 0; side < 2; ++side) {
    const Eigen::Vector3d f = normal + (side == 0 ? 1.0 : -1.0) * pyramids_.friction * tangent;
    wrenches_.col(first + side) << f.head<2>(), (arm.x() * f.y() - arm.y() * f.x()) / pyramids_.length;
  }
}

// The first edge lies along the tangent that is horizontal, or across the x axis where the normal is steep.
void ContactWrenches::write(const Eigen::Vector3d& arm, const Eigen::Vector3d& normal, Eigen::Index first) {
  const bool steep = 2.0 * normal.z() * normal.z() > 1.0;
  const Eigen::Vector3d across = steep ? Eigen::Vector3d::UnitX() : Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d s = across.cross(normal).normalized(), t = normal.cross(s);
  for (int edge = 0; edge < pyramids_.edges; ++edge) {
    const double angle = 2.0 * EIGEN_PI * edge / pyramids_.edges;
    const Eigen::Vector3d f = normal + pyramids_.friction * (std::cos(angle) * s + std::sin(angle) * t);
    wrenches_.col(first + edge) << f, arm.cross(f) / pyramids_.length;
  }
  if (!(pyramids_.torsional > 0.0)) return;
  const Eigen::Vector3d turn = pyramids_.torsional * normal;
  for (int side = 0; side < 2; ++side)
    wrenches_.col(first + pyramids_.edges + side) << normal,
        (arm.cross(normal) + (side == 0 ? 1.0 : -1.0) * turn) / pyramids_.length;
}

}  // namespace graspatlas
