"""Where two patches touch: their parameters at a contact, when the hand's point is not given."""

from __future__ import annotations

from itertools import product

import numpy as np

from graspatlas.patches.base import Patch
from graspatlas.problem.contacts import Contact
from graspatlas.support.arrays import Array, BoolArray

__all__ = ["touching_parameters"]

Pair = tuple[float, float]

#: Values of each free parameter of the hand's patch at which a search may start, and how many searches there are.
GRID = 3
STARTS = 4
#: Relative change at which a search ends.
TOLERANCE = 1e-14
#: Residual at which a start touches already: where two planes touch everywhere, it is as good as any other point.
TOUCHING = 1e-9


def touching_parameters(contact: Contact, T_hand_object: Array, length_scale: float) -> tuple[Pair, Pair]:
    """Parameters at which the two patches of a contact come nearest to touching: points coincide, normals oppose.

    Args:
        contact: The contact; its frozen parameters stay.
        T_hand_object: Maps the object's frame to that of the hand's patch (4, 4).
        length_scale: Gap that counts as much as normals that are one radian off [m].

    Returns:
        (u, v) of the hand's patch, and of the object's.
    """
    on_hand, on_object = sides = contact.sides
    cores = [side.patch.core() for side in sides]
    R, t = T_hand_object[:3, :3], T_hand_object[:3, 3]
    values = np.array([[side.frozen.get(name, 0.0) for name in ("u", "v")] for side in sides])
    free = np.array([[name in side.free for name in ("u", "v")] for side in sides])
    limits = np.transpose([patch.interval(name) or (-np.inf, np.inf) for patch, name in contact.free()])

    def filled(w: Array) -> Array:
        out: Array = values.copy()
        out[free] = w
        return out

    def residual(w: Array) -> Array:
        h, o = (core.evaluate(*row) for core, row in zip(cores, filled(w), strict=True))
        return np.concatenate([(h["o"] - R @ o["o"] - t) / length_scale, h["m"] + R @ o["m"]])

    def jacobian(w: Array) -> Array:
        h, o = (core.evaluate(*row) for core, row in zip(cores, filled(w), strict=True))
        columns = [np.concatenate([h[f"o_{n}"] / length_scale, h[f"m_{n}"]]) for n in "uv"]
        columns += [-np.concatenate([R @ o[f"o_{n}"] / length_scale, -R @ o[f"m_{n}"]]) for n in "uv"]
        return np.column_stack([c for c, moves in zip(columns, free.ravel(), strict=True) if moves])

    starts = []
    for point in _starts(on_hand.patch, values[0], free[0], t):
        at = R.T @ (np.asarray(cores[0].evaluate(*point)["o"]) - t)
        both = np.where(free, np.array([point, on_object.patch.locate(at)]), values)[free]
        starts.append(np.clip(both, *limits))
    starts.sort(key=lambda w: float(np.linalg.norm(residual(w))))
    best = starts[0]
    if np.linalg.norm(residual(best)) > TOUCHING:
        from scipy.optimize import least_squares  # slow to import

        found = [
            least_squares(residual, w, jacobian, limits, x_scale="jac", xtol=TOLERANCE, ftol=TOLERANCE, gtol=TOLERANCE)
            for w in starts[:STARTS]
        ]
        best = min(found, key=lambda result: float(result.cost)).x
    (u, v), (body_u, body_v) = filled(best)
    return (float(u), float(v)), (float(body_u), float(body_v))


def _starts(hand: Patch, values: Array, free: BoolArray, object_origin: Array) -> list[Array]:
    """Parameters (u, v) of the hand's patch over its intervals; of endless ones those nearest to the object."""
    near = hand.locate(object_origin)
    choices: list[list[float]] = []
    for name, value, moves, nearest in zip(("u", "v"), values, free, near, strict=True):
        if not moves:
            choices.append([float(value)])
            continue
        low, high = hand.interval(name) or (-np.pi, np.pi)
        inside = np.linspace(low, high, GRID + 2)[1:-1] if np.isfinite(high - low) else np.empty(0)
        choices.append([*map(float, inside), nearest])
    return [np.array(point) for point in product(*choices)]
