"""The parameters of a patch's point nearest to a given point, for patches without a formula for it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from graspatlas import _core
from graspatlas.patches.base import Interval
from graspatlas.support.arrays import Array

__all__ = ["nearest_parameters"]

#: Points of the grid along each parameter among which the search starts, and how many of them it starts from.
GRID = 16
STARTS = 4
#: Relative change of the parameters and of the distance at which the search ends.
TOLERANCE = 1e-15


def nearest_parameters(
    core: _core.Patch, point: ArrayLike, search: Sequence[Interval], limits: Sequence[Interval]
) -> Array:
    """Parameters of the nearest point: least squares from the best points of a grid.

    Args:
        core: The patch.
        point: A point in its frame (3,).
        search: Finite interval of each free parameter, u or u and v, in which the grid lies.
        limits: Intervals that the answer must keep.

    Returns:
        The parameters [1 or 2].
    """
    from scipy.optimize import least_squares  # slow to import

    target = np.asarray(point, float)
    n = len(search)
    axes = [np.linspace(low, high, GRID) for low, high in search]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, n)

    def evaluate(w: Array) -> dict[str, Array]:
        return core.evaluate(float(w[0]), float(w[1]) if n == 2 else 0.0)

    distances = np.array([np.linalg.norm(evaluate(w)["o"] - target) for w in grid])
    scale = max(float(np.ptp(distances)), 1e-12)
    spans = np.array([high - low for low, high in search])
    found = [
        least_squares(
            lambda w: (evaluate(w)["o"] - target) / scale,
            grid[start],
            jac=lambda w: np.column_stack([evaluate(w)[name] for name in ("o_u", "o_v")[:n]]) / scale,
            bounds=np.transpose(limits),
            x_scale=spans,
            xtol=TOLERANCE,
            ftol=TOLERANCE,
            gtol=TOLERANCE,
        )
        for start in np.argsort(distances)[:STARTS]
    ]
    return np.asarray(min(found, key=lambda result: float(result.cost)).x)
