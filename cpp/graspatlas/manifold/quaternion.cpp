#include "graspatlas/manifold/quaternion.hpp"

#include <Eigen/Geometry>
#include <cmath>

#include "graspatlas/errors.hpp"

namespace graspatlas {

void check_quaternion(const double* q) {
  const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  if (!(std::abs(length - 1.0) < 1e-6)) throw Error("the quaternion in x0 must have length 1, not " + to_text(length));
}

void embed_rotation(const double* quaternion, double* out) {
  // |R1 - R0| in the Frobenius norm is 2 sqrt(2) sin(angle / 2), at most sqrt(2) times the angle.
  const Eigen::Map<const Eigen::Quaterniond> q(quaternion);
  Eigen::Map<Eigen::Matrix3d>{out} = q.toRotationMatrix() * M_SQRT1_2;
}

}  // namespace graspatlas
