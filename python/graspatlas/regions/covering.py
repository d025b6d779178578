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
#: A part that bends fills this share of the rectangle of u and v around it, or it is cut again.
FILLED_PART = 0.4
#: Of rectangles with this share of the largest one's area, the one nearest to the middle and to the shape is taken.
ABOUT_LARGEST = 0.95


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
        u: Interval of u that covers it; None for the circle.
        v: The same of v.
    """
    counts = _counts(surface, points, u, v, CELLS)
    typical = np.array([np.median(row[row > 0]) if (row > 0).any() else 1.0 for row in counts.T])
    full = counts >= np.maximum(FILLED * typical - np.sqrt(typical), 1.0)[None, :]
    (i0, i1), (j0, j1) = largest_rectangle(full, u is None, v is None)
    found: list[Interval | None] = []
    for interval, a, b in ((u, i0, i1), (v, j0, j1)):
        low, high = interval or (-np.pi, np.pi)
        cell = (high - low) / CELLS
        inset = min(0.5, 0.25 * (b - a))  # cells at the rim are full in part
        start, end = (a + inset * (a > 0 or interval is None), b - inset * (b < CELLS or interval is None))
        found.append(None if interval is None and b - a == CELLS else (low + start * cell, low + end * cell))
    return found[0], found[1], float(full.mean())


def largest_rectangle(full: BoolArray, wraps_u: bool = False, wraps_v: bool = False) -> tuple[IntArray, IntArray]:
    """Rows and columns, from and to, of the largest rectangle of true cells; those that wrap may go past the end."""
    n, m = full.shape
    tall = np.concatenate([full, full]) if wraps_u else full
    wide = np.concatenate([tall, tall], axis=1) if wraps_v else tall
    found = []
    for start in range(n):
        every = np.ones(wide.shape[1], bool)
        for end in range(start + 1, min(start + n, len(wide)) + 1):
            every &= wide[end - 1]
            if not every.any():
                break
            a, b = _longest_run(every)
            b = min(b, a + m)
            found.append((start, end, a, b))
    sides = np.array(found or [(0, n, 0, m)])
    areas = (sides[:, 1] - sides[:, 0]) * (sides[:, 3] - sides[:, 2])
    large = sides[areas >= ABOUT_LARGEST * areas.max()]
    aside = (0 if wraps_u else 1) * np.abs(large[:, :2].sum(axis=1) - n) / n + np.abs(large[:, 2:].sum(axis=1) - m) / m
    slender = np.abs((large[:, 1] - large[:, 0]) / n - (large[:, 3] - large[:, 2]) / m)
    best = large[np.argmin(np.round(aside + slender, 9))]
    return best[:2], best[2:]


def _longest_run(values: BoolArray) -> tuple[int, int]:
    """From and to of the longest run of true values."""
    steps = np.flatnonzero(np.diff(np.r_[False, values, False]))
    lengths = steps[1::2] - steps[::2]
    k = int(np.argmax(lengths))
    return int(steps[2 * k]), int(steps[2 * k + 1])


def filled(surface: Surface, points: Array, cells: int = 14) -> float:
    """The share of the cells of the covering rectangle that hold one of the points, about."""
    return float((_counts(surface, points, *covering(surface, points), cells) > 0).mean())


def _counts(surface: Surface, points: Array, u: Interval | None, v: Interval | None, cells: int) -> IntArray:
    """How many points lie in each cell of a rectangle of u and v (cells, cells)."""
    columns = []
    for x, interval, angle in zip(
        surface.parameters(points).T, (u, v), (surface.periodic, surface.kind == "torus"), strict=True
    ):
        low, high = interval or (-np.pi, np.pi)
        along = np.mod(x - low, 2.0 * np.pi) if angle else x - low
        columns.append(np.clip((along / max(high - low, 1e-300) * cells).astype(int), 0, cells - 1))
    return np.bincount(columns[0] * cells + columns[1], minlength=cells**2).reshape(cells, cells)
