"""Rotations as matrices, quaternions, and roll, pitch and yaw; SciPy's take longer to import than to use."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from graspatlas.support.arrays import Array

__all__ = [
    "matrix_from_quaternion",
    "matrix_from_rotvec",
    "matrix_from_rpy",
    "quaternions_from_matrices",
    "rpy_from_matrix",
]

#: Cosine of the pitch below which roll and yaw turn about one axis, and roll alone is told.
GIMBAL_LOCK = 1e-7


def quaternions_from_matrices(R: ArrayLike) -> Array:
    """Unit quaternions x y z w [n, 4] of rotations [n, 3, 3]; the number that is largest in size is positive.

    Source: F. L. Markley, "Unit Quaternion from Rotation Matrix", Journal of Guidance, Control, and Dynamics 2008.
    """
    rotations = np.asarray(R, float).reshape(-1, 3, 3)
    if len(rotations) == 0:
        return np.zeros((0, 4))
    xx, xy, xz, yx, yy, yz, zx, zy, zz = rotations.reshape(-1, 9).T
    products = np.array(  # 4 q q', each row a multiple of q
        [
            [1.0 + xx - yy - zz, xy + yx, xz + zx, zy - yz],
            [xy + yx, 1.0 - xx + yy - zz, yz + zy, xz - zx],
            [xz + zx, yz + zy, 1.0 - xx - yy + zz, yx - xy],
            [zy - yz, xz - zx, yx - xy, 1.0 + xx + yy + zz],
        ]
    )
    largest = np.einsum("iin->in", products).argmax(axis=0)
    found = products[largest, :, np.arange(len(rotations))]
    return np.asarray(found / np.linalg.norm(found, axis=1, keepdims=True))


def matrix_from_rpy(rpy: ArrayLike) -> Array:
    """The rotation (3, 3) of a URDF's roll, pitch and yaw (3,): about the fixed axes x, y and z in this order [rad]."""
    (sr, sp, sy), (cr, cp, cy) = np.sin(rpy), np.cos(rpy)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def matrix_from_quaternion(xyzw: ArrayLike) -> Array:
    """The rotation (3, 3) of a quaternion x y z w (4,), which is normalised."""
    x, y, z, w = np.asarray(xyzw, float) / np.linalg.norm(xyzw)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def rpy_from_matrix(R: Array) -> Array:
    """Roll, pitch and yaw (3,) of a rotation (3, 3), see :func:`matrix_from_rpy`; at a pitch of 90 degrees yaw is 0."""
    level = float(np.hypot(R[0, 0], R[1, 0]))
    pitch = np.arctan2(-R[2, 0], level)
    if level < GIMBAL_LOCK:
        return np.array([np.arctan2(-R[1, 2], R[1, 1]), pitch, 0.0])
    return np.array([np.arctan2(R[2, 1], R[2, 2]), pitch, np.arctan2(R[1, 0], R[0, 0])])


def matrix_from_rotvec(rotvec: ArrayLike) -> Array:
    """The rotation (3, 3) about a vector (3,) by its length [rad]: Rodrigues' formula."""
    x, y, z = vector = np.asarray(rotvec, float)
    angle = float(np.linalg.norm(vector))
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    # sin(a) / a and (1 - cos(a)) / a^2, which are 1 and 1/2 at a = 0
    first, second = np.sinc(angle / np.pi), 0.5 * np.sinc(0.5 * angle / np.pi) ** 2
    return np.asarray(np.eye(3) + first * K + second * (K @ K))
