"""The intervals of a surface's parameters that cover a region, and those that lie on it altogether."""

from __future__ import annotations

import numpy as np

from graspatlas.patches.base import Interval
from graspatlas.regions.surfaces import Surface
from graspatlas.support.arrays import Array, BoolArray, IntArray

__all__ = ["covering", "largest_rectangle", "within"]

#: A circle is whole when no gap in it is wider than this [rad]: 12 degrees.
WIDEST_GAP = 0.21
#: Cells along each parameter, and samples of each cell, by which it is seen where a region lies.
CELLS, PER_CELL = 24, 60
#: A cell belongs to a region when it has this share of the samples of the cells beside it.
FILLED = 0.5


def covering(surface: Surface, points: Array) -> tuple[Interval | None, Interval | None]:
    """Intervals of u and v that hold all points; None for a whole circle."""
    u, v = surface.parameters(points).T
    whole = (float(v.min()), float(v.max()))
    across = _arc(v) if surface.kind == "torus" else whole
    return (_arc(u) if surface.periodic else (float(u.min()), float(u.max()))), across


def _arc(angles: Array) -> Interval | None:
    """The shortest arc that holds all angles; None for the circle."""
    ordered = np.sort(angles)
    gaps = np.diff(ordered, append=ordered[0] + 2.0 * np.pi)
    widest = int(np.argmax(gaps))
    if gaps[widest] < WIDEST_GAP:
        return None
    start = float(ordered[(widest + 1) % len(ordered)])
    return (start, start + 2.0 * np.pi - float(gaps[widest]))


def within(
    surface: Surface, points: Array, u: Interval | None, v: Interval | None
) -> tuple[Interval | None, Interval | None, float]:
    """The largest rectangle of u and v that is full of the points, and the share of the whole one that is.

    Args:
        surface: The surface.
        points: Points spread evenly over the region (n, 3), about ``CELLS**2 * PER_CELL``.
        u, v: Intervals that cover it; None for the circle.
    """
    values = surface.parameters(points)
    columns, ends = [], []
    for k, interval in enumerate((u, v)):
        low, high = interval or (-np.pi, np.pi)
        x = values[:, k]
        if k == 0 and surface.periodic or k == 1 and surface.kind == "torus":
            x = low + np.mod(x - low, 2.0 * np.pi)
        columns.append(np.clip(((x - low) / (high - low) * CELLS).astype(int), 0, CELLS - 1))
        ends.append((low, high))
    counts = np.bincount(columns[0] * CELLS + columns[1], minlength=CELLS**2).reshape(CELLS, CELLS)
    typical = np.array([np.median(row[row > 0]) if (row > 0).any() else 1.0 for row in counts.T])
    full = counts >= np.maximum(FILLED * typical[None, :], 1.0)
    full &= counts >= 0.25 * np.median(counts[counts > 0])
    (i0, i1), (j0, j1) = largest_rectangle(full, u is None, v is None)
    found: list[Interval | None] = []
    for (low, high), a, b, whole in zip(ends, (i0, j0), (i1, j1), (u is None, v is None), strict=True):
        cell = (high - low) / CELLS
        found.append(None if whole and b - a == CELLS else (low + a * cell, low + b * cell))
    return found[0], found[1], float(full.mean())


def largest_rectangle(full: BoolArray, wraps_u: bool = False, wraps_v: bool = False) -> tuple[IntArray, IntArray]:
    """Rows and columns, from and to, of the largest rectangle of true cells; those that wrap may go past the end."""
    n, m = full.shape
    tall = np.concatenate([full, full]) if wraps_u else full
    wide = np.concatenate([tall, tall], axis=1) if wraps_v else tall
    best, found = 0, ((0, n), (0, m))
    for start in range(n):
        every = np.ones(wide.shape[1], bool)
        for end in range(start + 1, min(start + n, len(wide)) + 1):
            every &= wide[end - 1]
            if not every.any():
                break
            a, b = _longest_run(every)
            b = min(b, a + m)
            if (end - start) * (b - a) > best:
                best, found = (end - start) * (b - a), ((start, end), (a, b))
    return np.array(found[0]), np.array(found[1])


def _longest_run(values: BoolArray) -> tuple[int, int]:
    """From and to of the longest run of true values."""
    steps = np.flatnonzero(np.diff(np.r_[False, values, False]))
    lengths = steps[1::2] - steps[::2]
    k = int(np.argmax(lengths))
    return int(steps[2 * k]), int(steps[2 * k + 1])
