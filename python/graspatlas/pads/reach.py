"""How far a patch reaches that was fitted to a small square: as far as the surface keeps to it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from graspatlas.collision.shapes import Shape
from graspatlas.pads.surface import look
from graspatlas.patches.base import AxialPatch, Patch
from graspatlas.patches.flat import Plane
from graspatlas.support.arrays import Array

__all__ = ["FITS", "LARGEST_ANGLE", "LARGEST_TURN", "Dome", "widened"]

#: A patch fits where it is everywhere as near to the surface as this [m].
FITS = 2e-4
#: The surface may turn by this much within the patch [rad], and no two rays meet it farther apart in height.
LARGEST_TURN = np.radians(65.0)
#: Largest longitude and latitude of round patches [rad].
LARGEST_ANGLE = 1.2
#: Steps in which a patch is made wider: of angles [rad], and of lengths as a share of the link's half width.
ANGLE_STEP, LENGTH_STEP = 0.06, 0.04
#: Points along a side that moves outwards.
POINTS = 9
#: Rays along each side of the square through which the surroundings are looked at.
RAYS = 129
#: That square reaches this much farther than the largest patch.
BEYOND = 1.5


@dataclass(frozen=True)
class Dome:
    """A patch and how well it fits.

    Attributes:
        patch: The patch, whose point (0, 0) is the middle.
        error: Largest distance of the surface from it, along the normal [m].
        half: Half the side of the square that was fitted [m].
        rank: Place of its kind in the order from simple to general.
        T: The frame in which it was fitted (4, 4): on the surface, z along the normal.
    """

    patch: Patch
    error: float
    half: float
    rank: int
    T: Array


def widened(shapes: Sequence[Shape], dome: Dome, largest: float) -> Dome:
    """The patch with its sides moved outwards as far as the surface keeps to it; splines stay as they are.

    Args:
        shapes: The shapes of the body.
        dome: The patch.
        largest: Half the side of the largest square that was looked at [m].
    """
    if not isinstance(dome.patch, AxialPatch | Plane):
        return dome
    around = _Surroundings(shapes, dome, largest)
    sides = {name: list(dome.patch.interval(name) or (-np.pi, np.pi)) for name in ("u", "v")}
    moving = [(name, end) for name in ("u", "v") for end in (0, 1)]
    error = dome.error
    while moving:
        for name, end in list(moving):
            angle = isinstance(dome.patch, AxialPatch) and not (name == "v" and dome.patch.kind == "cylinder")
            step = ANGLE_STEP if angle else LENGTH_STEP * largest
            place = sides[name][end] + (step if end else -step)
            gap = around.gap(name, place, sides["v" if name == "u" else "u"])
            if not gap <= FITS or abs(place) > (LARGEST_ANGLE if angle else BEYOND * largest):
                moving.remove((name, end))
                continue
            sides[name][end], error = place, max(error, gap)
    intervals: dict[str, Any] = {f"{name}_interval": (low, high) for name, (low, high) in sides.items()}
    return replace(dome, patch=replace(dome.patch, **intervals), error=error)


class _Surroundings:
    """What lies round a patch."""

    def __init__(self, shapes: Sequence[Shape], dome: Dome, largest: float) -> None:
        self._T, self._core = dome.T, dome.patch.core()
        self._ticks = BEYOND * np.linspace(-largest, largest, RAYS)
        self._heights = look(shapes, dome.T, self._ticks, self._ticks).heights

    def gap(self, name: str, place: float, across: Sequence[float]) -> float:
        """Largest distance of the surface from a side of the patch [m]; NaN where it turns away or ends.

        Args:
            name: The parameter that has one value on the side.
            place: That value.
            across: Interval of the other parameter.
        """
        others = np.linspace(across[0], across[1], POINTS)
        tables = [self._core.evaluate(*((place, other) if name == "u" else (other, place))) for other in others]
        points = (np.array([table["o"] for table in tables]) - self._T[:3, 3]) @ self._T[:3, :3]
        upright = np.array([table["m"] for table in tables]) @ self._T[:3, 2]
        if upright.min() < np.cos(LARGEST_TURN):
            return np.nan
        return float((np.abs(points[:, 2] - self._height(points[:, :2])) * upright).max())

    def _height(self, points: Array) -> Array:
        """Height of the surface over points (n, 2), between the rays; NaN beyond them and where one misses."""
        where = (points - self._ticks[0]) / (self._ticks[1] - self._ticks[0])
        cells = np.floor(where).astype(int)
        outside = ((cells < 0) | (cells >= RAYS - 1)).any(axis=1)
        (i, j), (s, t) = np.clip(cells, 0, RAYS - 2).T, (where - cells).T
        h = self._heights
        mixed = (1 - s) * ((1 - t) * h[i, j] + t * h[i, j + 1]) + s * ((1 - t) * h[i + 1, j] + t * h[i + 1, j + 1])
        return np.asarray(np.where(outside, np.nan, mixed))
