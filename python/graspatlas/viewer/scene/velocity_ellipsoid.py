r"""The ellipsoid of velocities that the fingers can give the object.

Joint velocities of norm one, all contacts kept, move the object's origin with velocities that fill an ellipsoid. With
the twists :math:`t = B c` of the coordinated motions, those fill :math:`\{c : |J^+ G^\top B c| \le 1\}`, and their
linear parts fill :math:`\{v : v = A z, |z| \le 1\}` with :math:`A = [I\; 0] B (J^+ G^\top B)^+`.

Source: Bicchi and Prattichizzo, "Manipulability of cooperating robots with unactuated joints and closed-chain
mechanisms", 2000; "Global Optimization of Robotic Grasps", Section V.
"""

from __future__ import annotations

import numpy as np

from graspatlas.grasps.grasp import Grasp
from graspatlas.grasps.grasps import Grasps
from graspatlas.support.arrays import Array

__all__ = ["coordinated_motions", "velocity_ellipsoid", "velocity_ellipsoids"]

#: Singular values smaller than this share of the largest count as zero.
RANK_TOLERANCE = 1e-9


def velocity_ellipsoid(grasp: Grasp) -> tuple[Array, Array]:
    """Ellipsoid of the linear velocity of the object's origin for joint velocities of norm one.

    Directions in which the object moves without the joints are left out: they have no bound.

    Args:
        grasp: The grasp.

    Returns:
        Directions of its axes as the columns of a rotation (3, 3), in the palm's frame, and its semi-axes (3,), longest
        first, metres a radian; zero where the fingers cannot move the object.
    """
    linear = grasp.problem.object_joint_model.translations
    A = np.zeros((3, 3))
    map_to_velocity = coordinated_motions(grasp)[0][:linear]
    A[:linear, :linear] = map_to_velocity @ map_to_velocity.T
    values, axes = np.linalg.eigh(A)
    axes = axes[:, ::-1]
    if np.linalg.det(axes) < 0.0:
        axes[:, 2] = -axes[:, 2]
    return axes, np.sqrt(np.maximum(values[::-1], 0.0))


def coordinated_motions(grasp: Grasp) -> tuple[Array, Array]:
    """Motions that keep every contact, as images of the unit ball.

    Args:
        grasp: The grasp.

    Returns:
        The object's twists (6, c) (linear, angular) and the least joint velocities that cause them (h, c); the columns
        of the second are orthonormal. There are none where contacts leave the object loose, as two points do.
    """
    G = grasp.G.copy()
    linear = grasp.problem.object_joint_model.translations
    size = max(float(np.abs(grasp.J).max(initial=0.0)), 1e-12)
    G[linear:] /= size  # rotations as lengths, so that ranks do not depend on the unit of length
    if np.linalg.matrix_rank(G, tol=RANK_TOLERANCE * np.linalg.norm(G)) < len(G):
        return np.zeros((len(G), 0)), np.zeros((grasp.J.shape[1], 0))
    J_inverse = np.linalg.pinv(grasp.J, rcond=RANK_TOLERANCE)
    unreached = G.T - grasp.J @ (J_inverse @ G.T)
    _, singular, Vt = np.linalg.svd(unreached)
    B = Vt[int((singular > RANK_TOLERANCE * np.linalg.norm(G)).sum()) :].T
    U, s, Wt = np.linalg.svd(J_inverse @ G.T @ B, full_matrices=False)
    moved = s > RANK_TOLERANCE * s.max(initial=0.0)
    twists = B @ (Wt[moved].T / s[moved])
    twists[linear:] /= size
    return twists, U[:, moved]


def velocity_ellipsoids(grasps: Grasps) -> tuple[Array, Array]:
    """The ellipsoids of a batch; see :func:`velocity_ellipsoid`.

    Args:
        grasps: The grasps.

    Returns:
        Directions of the axes as the columns of rotations (n, 3, 3), and semi-axes (n, 3), longest first.
    """
    linear = grasps.problem.object_joint_model.translations
    A = np.zeros((len(grasps), 3, 3))
    size = np.maximum(np.abs(grasps.J).max(axis=(1, 2), initial=0.0), 1e-12)
    G = grasps.G.copy()
    G[:, linear:] /= size[:, None, None]
    norm = np.linalg.norm(G, axis=(1, 2))
    held = (np.linalg.svd(G, compute_uv=False) > RANK_TOLERANCE * norm[:, None]).sum(axis=1) == G.shape[1]
    GT = G[held].swapaxes(1, 2)
    joint_steps = np.linalg.pinv(grasps.J[held], rcond=RANK_TOLERANCE) @ GT
    _, singular, Vt = np.linalg.svd(GT - grasps.J[held] @ joint_steps, full_matrices=False)
    lost = (singular > RANK_TOLERANCE * norm[held, None]).sum(axis=1)
    velocities = np.zeros((len(GT), 3, 3))
    for count in np.unique(lost):  # as many motions are coordinated in all grasps of a group
        group = lost == count
        B = Vt[group, count:].swapaxes(1, 2)
        _, s, Wt = np.linalg.svd(joint_steps[group] @ B, full_matrices=False)
        moved = s > RANK_TOLERANCE * s.max(axis=1, initial=0.0)[:, None]
        inverse = np.divide(1.0, s, out=np.zeros_like(s), where=moved)
        twists = (B @ (Wt.swapaxes(1, 2) * inverse[:, None, :]))[:, :linear]
        velocities[group, :linear, :linear] = twists @ twists.swapaxes(1, 2)
    A[held] = velocities
    values, axes = np.linalg.eigh(A)
    axes = axes[:, :, ::-1].copy()
    axes[np.linalg.det(axes) < 0.0, :, 2] *= -1.0
    return axes, np.sqrt(np.maximum(values[:, ::-1], 0.0))
