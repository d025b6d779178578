"""Is the manifold really covered? Points of it that are found without the atlas are looked up in its charts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from graspatlas.atlas.atlas import Atlas
from graspatlas.support.arrays import Array
from graspatlas.systems.system import AnySystem

__all__ = ["Coverage", "measure_coverage"]


#: Steps of one walk, and their longest length as a share of the chart radius.
WALK_STEPS = 6
STEP = 1.5
#: Newton's method: iterations, and largest entry of |R(x)| that counts as zero.
MAX_ITERATIONS = 12
ZERO = 1e-11


@dataclass(frozen=True)
class Coverage:
    """How points of the manifold lie to an atlas.

    Attributes:
        points: Number of points.
        inside: Share of them that lie in the polytope of some chart.
        farthest: Largest distance of a point from the nearest polytope, as a share of the chart radius; infinite when a
            point is near no chart.
    """

    points: int
    inside: float
    farthest: float


def measure_coverage(atlas: Atlas, system: AnySystem, points: int = 300, seed: int = 0) -> Coverage:
    """Walk at random on the manifold from random charts, and see whether the charts are where the walks come.

    A walk steps along the null space of the Jacobian and back to the manifold by least-norm Newton steps, in NumPy: it
    uses the equations alone. A hole in the atlas borders on charts, so walks that begin at charts step into it.

    Args:
        atlas: The atlas.
        system: Its system.
        points: How many steps to take; those that leave the bounds give no point.
        seed: Of the random numbers.

    Returns:
        What was found.
    """
    rng = np.random.default_rng(seed)
    distances: list[float] = []
    for _ in range(-(-points // WALK_STEPS)):
        x = atlas.centers[rng.integers(atlas.n_charts)]
        for _ in range(WALK_STEPS):
            moved = _step(system, x, STEP * atlas.radius * rng.uniform(0.2, 1.0), rng)
            if moved is not None:
                x = moved
                distances.append(atlas.locate(x)[1] / atlas.radius)
    found = np.array(distances)
    return Coverage(len(found), float((found == 0.0).mean()) if len(found) else 1.0, float(found.max(initial=0.0)))


def _step(system: AnySystem, x: Array, length: float, rng: np.random.Generator) -> Array | None:
    """A random step [tangent units] along the manifold; None where it leaves the bounds or Newton's method fails."""
    _, _, rows = np.linalg.svd(system.evaluate_jacobian(x))
    tangent = rows[system.n_equations :]
    direction = rng.normal(size=len(tangent)) @ tangent
    moved = system.integrate(x, length * direction / np.linalg.norm(direction))
    for _ in range(MAX_ITERATIONS):
        R = system.evaluate_residual(moved)
        if np.abs(R).max(initial=0.0) <= ZERO:
            break
        moved = system.integrate(moved, -np.linalg.pinv(system.evaluate_jacobian(moved)) @ R)
    else:
        return None
    # Newton's method may have come down on another part of the manifold.
    if np.linalg.norm(system.difference(x, moved)) > 2.0 * length or system.slack(moved).min(initial=0.0) < 0.0:
        return None
    return np.asarray(moved)
