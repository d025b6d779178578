#pragma once

namespace graspatlas {

/// Numbers that embed_rotation writes.
constexpr int kRotationEmbedding = 9;

/// Throws Error unless the four numbers (x, y, z, w) are a quaternion of length one.
void check_quaternion(const double* quaternion);

/// A rotation, given by its unit quaternion (x, y, z, w), as a point of R^9 such that distances between points are at
/// most the angles between rotations [rad]; a quaternion and its negative have one point.
void embed_rotation(const double* quaternion, double* out);

}  // namespace graspatlas
