"""Problems in which the object stays while the hand stays still.

Between fingertips on two parallel faces an object can slide, and a ball can turn: such grasps are the same to the hand,
but they use up the dimensions of an atlas. So patch parameters that let them happen are frozen where they are, and the
place of the palm that touches.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from graspatlas.problem.problem import Problem
from graspatlas.support.arrays import Array

__all__ = ["pinned"]

#: Singular values below this share of the largest count as zero.
RANK = 1e-6


def pinned(problem: Problem, x: Array) -> tuple[Problem, Array]:
    """The problem with those parameters of patches frozen that keep the object still, and the grasp in it.

    They are all of the hand's, and as few of the object's as do.

    Args:
        problem: The problem, without first grasp.
        x: A feasible grasp (size of x,); frozen parameters keep its values.
    """
    system = problem.full_system
    J = system.evaluate_jacobian(x)
    hand = system.tangent_size - system.object_dof - system.n_parameters
    columns = list(range(hand, system.tangent_size))
    first = system.configuration_size - system.n_parameters
    places = [
        (c, s, name) for c, contact in enumerate(problem.contacts) for s in (0, 1) for name in contact.sides[s].free
    ]
    before = hand + system.object_dof
    frozen = [i for i, (_, side, _) in enumerate(places) if side == 0]
    columns = [column for column in columns if column - before not in frozen]
    while True:
        moving = _still_hand_motions(J[:, columns])
        of_object = [i for i, column in enumerate(columns) if column >= before]
        if not moving.shape[1] or not of_object:
            break
        weights = np.linalg.norm(moving, axis=1)
        i = max(of_object, key=lambda row: float(weights[row]))
        if weights[i] < RANK:
            break
        frozen.append(columns.pop(i) - before)
    contacts = list(problem.contacts)
    for parameter in frozen:
        c, side, name = places[parameter]
        contact, value = contacts[c], {name: float(x[first + parameter])}
        if side == 0:
            contacts[c] = replace(contact, hand_frozen={**contact.hand_frozen, **value})
        else:
            contacts[c] = replace(contact, frozen={**contact.frozen, **value})
    return replace(problem, contacts=tuple(contacts)), np.delete(x, [first + parameter for parameter in frozen])


def _still_hand_motions(J: Array) -> Array:
    """Null space of the columns of object and patch parameters, as orthonormal columns."""
    _, singular, Vt = np.linalg.svd(J)
    rank = int((singular > RANK * singular[0]).sum())
    return np.asarray(Vt[rank:].T)
