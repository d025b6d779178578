"""The length by which torques are divided so that they can be weighed against forces: one for one problem.

Indices such as Ferrari and Canny's epsilon compare torques with forces, and change with the length between them. Values
can only be compared when that length is one and the same. It is stated by the problem, or follows from what the problem
says of the object alone: the largest arm that a contact may have, so that the largest torque of a unit force about the
object's origin is about one. No grasp plays a part in it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from graspatlas.problem.contacts import Contact, ContactSide
from graspatlas.problem.object_joint import FREE_FLYER, ObjectJoint
from graspatlas.support.arrays import Array

__all__ = ["largest_arm"]

#: Values of each free parameter at which a patch is looked at; odd, so that the middle is among them.
GRID = 33
#: How often the grid is laid again, a quarter as wide, about the farthest point.
ZOOMS = 6
ZOOM_GRID = 5
ZOOM = 0.25


def largest_arm(contacts: Sequence[Contact], joint: ObjectJoint = FREE_FLYER) -> float:
    """Largest distance from the object's origin that a point of the object may have which a contact may touch [m].

    Frozen parameters keep their value, free ones go through their intervals. One without bounds stays at the point of
    its patch that is nearest to the origin. The distance is found on a grid that is refined about the farthest point.

    Args:
        contacts: The contacts.
        joint: How the object moves: where it stays in its x-y plane distances are those in this plane.

    Returns:
        The length [m]; 0 when all contacts are at the origin.

    Source: dividing torques by the largest arm follows M. A. Roa, R. Suárez, "Grasp Quality Measures: Review and
    Performance", Autonomous Robots 38 (2015), Section 2, there of the points of the object's surface.
    """
    return max(_farthest(contact.sides[1], joint.translations) for contact in contacts)


def _farthest(side: ContactSide, axes: int) -> float:
    """Largest distance of the points of a side's patch from the origin, in the first two or in all three axes [m]."""
    core = side.patch.core()

    def distances(U: Array, V: Array) -> Array:
        return np.array([[np.linalg.norm(core.evaluate(u, v)["o"][:axes]) for v in V] for u in U])

    spans = [_span(side, name) for name in ("u", "v")]
    values = [np.linspace(low, high, GRID) if low < high else np.array([low]) for low, high in spans]
    steps = [(high - low) / (GRID - 1) for low, high in spans]
    best = 0.0
    for _ in range(1 + ZOOMS):
        found = distances(*values)
        at = np.unravel_index(found.argmax(), found.shape)
        best = max(best, float(found[at]))
        middle = [v[i] for v, i in zip(values, at, strict=True)]
        values = [
            np.unique(np.clip(m + step * np.linspace(-1.0, 1.0, ZOOM_GRID), low, high))
            for m, step, (low, high) in zip(middle, steps, spans, strict=True)
        ]
        steps = [ZOOM * step for step in steps]
    return best


def _span(side: ContactSide, parameter: str) -> tuple[float, float]:
    """Smallest and largest value of a parameter; the same when it does not move or has no bounds."""
    if parameter not in side.free:
        return (float(side.frozen.get(parameter, 0.0)),) * 2
    interval = side.patch.interval(parameter)
    if interval is None:
        return -np.pi, np.pi
    low, high = interval
    if np.isfinite([low, high]).all():
        return low, high
    nearest = side.patch.locate(np.zeros(3))[("u", "v").index(parameter)]
    return (float(np.clip(nearest, low, high)),) * 2
