"""Problems in which the object stays while the hand stays still.

Between fingertips on two parallel faces an object can slide, and a ball can turn: such grasps are the same to the hand,
but they use up the dimensions of an atlas. So patch parameters that let them happen are frozen where they are.
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
    """The problem with as few parameters of the object's patches frozen as keep the object still, and the grasp in it.

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
    frozen: list[int] = []
    while True:
        moving = _still_hand_motions(J[:, columns])
        of_object = [i for i, column in enumerate(columns) if column >= hand + system.object_dof]
        of_object = [i for i in of_object if places[columns[i] - hand - system.object_dof][1] == 1]
        if not moving.shape[1] or not of_object:
            break
        weights = np.linalg.norm(moving, axis=1)
        i = max(of_object, key=lambda row: float(weights[row]))
        if weights[i] < RANK:
            break
        frozen.append(columns.pop(i) - hand - system.object_dof)
    contacts = list(problem.contacts)
    for parameter in frozen:
        c, _, name = places[parameter]
        value = float(x[first + parameter])
        contacts[c] = replace(contacts[c], frozen={**contacts[c].frozen, name: value})
    return replace(problem, contacts=tuple(contacts)), np.delete(x, [first + parameter for parameter in frozen])


def _still_hand_motions(J: Array) -> Array:
    """Null space of the columns of object and patch parameters, as orthonormal columns."""
    _, singular, Vt = np.linalg.svd(J)
    rank = int((singular > RANK * singular[0]).sum())
    return np.asarray(Vt[rank:].T)
