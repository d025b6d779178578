"""Motions that the contacts do not feel: joints that move without moving a contact."""

from __future__ import annotations

import numpy as np

from graspatlas.problem.problem import Problem
from graspatlas.support.arrays import Array

__all__ = ["near_x1", "null_space", "redundant_joints"]

#: A singular value below this share of the largest one is zero.
RANK_TOLERANCE = 1e-8
#: A joint takes part in a motion when it has at least this share of the fastest joint's velocity.
TAKES_PART = 1e-3
#: How far from x1 the freedoms are looked at again, since x1 may be singular [rad, or lengths / length_scale].
AWAY = 0.1


def redundant_joints(problem: Problem) -> list[list[str]]:
    """Joints that can move together without any contact point or normal of the hand moving.

    They are the null space of the contact Jacobian, restricted to the joints, near x1 but not at x1 itself: there a
    straight finger, say, has motions that are felt everywhere else.

    Args:
        problem: A problem with a first grasp.

    Returns:
        For each independent motion the names of the joints that take part.
    """
    actuated = problem.hand.mechanism.actuated
    motions = null_space(problem.full_system.evaluate_jacobian(near_x1(problem))[:, : len(actuated)])
    return [[actuated[j] for j in _taking_part(motion)] for motion in motions]


def near_x1(problem: Problem) -> Array:
    """A configuration near x1 that is not singular; its contacts are open."""
    system = problem.full_system
    step = AWAY * np.random.default_rng(0).uniform(-1.0, 1.0, system.tangent_size)
    return np.asarray(system.integrate(problem.x1_array, step))


def null_space(J: Array) -> Array:
    """Rows that span the null space of J, made sparse by Gauss-Jordan elimination [n, columns]."""
    _, singular, vectors = np.linalg.svd(J)
    rank = int((singular > RANK_TOLERANCE * max(singular[0], 1.0)).sum()) if len(singular) else 0
    rows = vectors[rank:].copy()
    for i in range(len(rows)):
        column = int(np.abs(rows[i]).argmax())
        rows[i] /= rows[i, column]
        for other in range(len(rows)):
            if other != i:
                rows[other] -= rows[other, column] * rows[i]
    return np.asarray(rows)


def _taking_part(motion: Array) -> list[int]:
    return [int(j) for j in np.flatnonzero(np.abs(motion) >= TAKES_PART * np.abs(motion).max())]
