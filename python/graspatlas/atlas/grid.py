r"""Points of a manifold above a lattice in the polytopes of its atlas: a grid as fine as one wants.

**How close the samples lie.** Lattice points outside a polytope, but no farther from it than half the diagonal of a
lattice cell, are moved to the polytope's nearest point, so every u in a polytope has a sample within

.. math:: \tfrac{1}{2} \sqrt{k} \; \mathrm{spacing}

of it: some lattice point is that near, and moving two points to the nearest points of a convex set brings them no
farther apart. Each chart's lattice contains its origin: the charts' centres are among the samples.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from graspatlas import _core
from graspatlas.atlas.atlas import Atlas, shortest_way
from graspatlas.errors import GraspAtlasError
from graspatlas.support.arrays import Array, IntArray
from graspatlas.support.interrupts import stoppable
from graspatlas.support.pickling import Light
from graspatlas.support.progress import progress_bar
from graspatlas.support.validation import positive

__all__ = ["MOST_SAMPLES", "Grid", "grid_blocks", "joined_grid", "lay_grid", "most_samples"]

#: A grid that may hold more samples than this is not made.
MOST_SAMPLES = 10_000_000
#: Samples that are evaluated at once, and lattice points that are looked at at once.
BLOCK = 4096
#: How far a sample may be outside the bounds [units of the tangent space].
BOUND_TOLERANCE = 1e-9
#: How far a point may be outside a half-space that contains it, by rounding [units of the tangent space].
ROUNDING = 1e-12
#: Points nearer to each other than this share of the spacing are one.
SAME = 1e-6


@dataclass(frozen=True, eq=False)
class Grid(Light):
    """Points of a manifold above the polytopes of an atlas.

    Attributes:
        x: The points [m, configuration_size].
        charts: Chart of each [m]; ascending.
        u: Its coordinates in the chart's tangent space [m, k]: ``x[i]`` is ``atlas.point(charts[i], u[i])``.
        not_converged: How many lattice points had no point of the manifold above them: Newton's method failed, or went
            farther than epsilon, eq (17).
        outside: How many points of the manifold were dropped because they break a bound.
        complete: False when interrupted, so that charts are missing.
    """

    x: Array
    charts: IntArray
    u: Array
    not_converged: int
    outside: int
    complete: bool

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {len(self)} points{'' if self.complete else ', incomplete'}>"

    def __len__(self) -> int:
        return len(self.x)


@stoppable()
def lay_grid(
    atlas: Atlas, spacing: float, *, charts: Sequence[int] | None = None, progress: bool | None = None
) -> Grid:
    """Points of a manifold above a lattice in the polytopes of its atlas; how near they lie stands at the module's top.

    The points that two neighbours have on their common facet are those of both charts.

    Args:
        atlas: Any atlas.
        spacing: Distance between lattice points [units of the tangent space].
        charts: Which charts to fill; all by default.
        progress: Show a progress bar on standard error; by default when it is a terminal.

    Raises:
        GraspAtlasError: If the spacing makes no sense, there is no such chart, or the grid would be too large.

    Source: "Global Optimization of Robotic Grasps", eqs (14) and (15), and the end of Section IV.
    """
    grids: list[Grid] = []
    blocks = grid_blocks(atlas, spacing, None if charts is None else np.unique(charts), progress)
    complete = True
    try:
        for block in blocks:
            grids.append(block)
    except KeyboardInterrupt:
        complete = False
    finally:
        blocks.close()
    return joined_grid(atlas, grids, complete)


def most_samples(atlas: Atlas, spacing: float, charts: ArrayLike | None = None) -> float:
    """Upper limit of the number of samples: lattice points in the boxes round the polytopes.

    Args:
        atlas: The atlas.
        spacing: Distance between lattice points [units of the tangent space].
        charts: Which charts are filled; all by default.
    """
    low, high = _boxes(atlas)
    chosen = slice(None) if charts is None else np.asarray(charts)
    with np.errstate(over="ignore"):
        shape = _last(high[chosen], spacing) - _first(low[chosen], spacing) + 1.0
        return float(shape.prod(axis=1).sum())


def _boxes(atlas: Atlas) -> tuple[Array, Array]:
    """Lowest and highest corner of the box round each polytope [n, k]."""
    if not atlas.lists_all_vertices:
        corners = [atlas.polytope(chart) for chart in range(atlas.n_charts)]
        return np.array([c.min(axis=0) for c in corners]), np.array([c.max(axis=0) for c in corners])
    starts = atlas.vertex_start[:-1]
    return np.minimum.reduceat(atlas.vertices, starts), np.maximum.reduceat(atlas.vertices, starts)


def _first(low: Array, spacing: float) -> Array:
    """First lattice plane that may matter, in each direction; half a cell's diagonal is added at either end."""
    return np.asarray(np.ceil(low / spacing - np.sqrt(low.shape[-1]) / 2.0))


def _last(high: Array, spacing: float) -> Array:
    return np.asarray(np.floor(high / spacing + np.sqrt(high.shape[-1]) / 2.0))


def _checked(atlas: Atlas, spacing: float, charts: Sequence[int] | ArrayLike | None) -> IntArray:
    """The charts to fill, each once and in the order given, when the spacing makes sense for them."""
    positive(spacing, "spacing")
    chosen = np.asarray(np.arange(atlas.n_charts) if charts is None else charts)
    if len(chosen) == 0:
        return np.zeros(0, np.int64)
    chosen = chosen[np.sort(np.unique(chosen, return_index=True)[1])]
    if chosen.dtype.kind not in "iu" or chosen.min() < 0 or chosen.max() >= atlas.n_charts:
        raise GraspAtlasError(f"charts must be whole numbers from 0 to {atlas.n_charts - 1}, got {charts!r}")
    most = most_samples(atlas, spacing, chosen)
    if most > MOST_SAMPLES:
        fits = _spacing_that_fits(atlas, spacing, chosen)
        hint = "fill a smaller share of the charts" + (f", or give {fits:.2g}" if fits else "")
        raise GraspAtlasError(f"spacing {spacing:g} makes up to {most:.2g} samples, over {MOST_SAMPLES:.0e}: {hint}")
    return np.asarray(chosen, np.int64)


def _spacing_that_fits(atlas: Atlas, spacing: float, charts: IntArray) -> float | None:
    """A spacing of two digits, wider than one that makes too many samples, that does not; None if that hardly helps."""
    low, high = np.log10(spacing), np.log10(atlas.radius)
    if low > high or most_samples(atlas, atlas.radius, charts) > MOST_SAMPLES:
        return None
    for _ in range(30):
        middle = (low + high) / 2.0
        too_fine = most_samples(atlas, 10.0**middle, charts) > MOST_SAMPLES
        low, high = (middle, high) if too_fine else (low, middle)
    digit = 10.0 ** (np.floor(high) - 1.0)
    return float(np.ceil(10.0**high / digit) * digit)


def grid_blocks(
    atlas: Atlas, spacing: float, charts: Sequence[int] | ArrayLike | None, progress: bool | None
) -> Generator[Grid]:
    """The grid in pieces of about `BLOCK` points, chart by chart as given, with a progress bar over the charts."""
    chosen = _checked(atlas, spacing, charts)
    bar = progress_bar(f"up to {most_samples(atlas, spacing, chosen):,.0f} samples", "charts", len(chosen), progress)
    low, high = _boxes(atlas)
    with bar:
        block = _Block(atlas)
        for chart in chosen:
            normals, offsets, _ = atlas.facets(int(chart))
            for Z in _lattice(_first(low[chart], spacing), _last(high[chart], spacing)):
                block.add(int(chart), _fitted(spacing * Z, normals, offsets, spacing))
                if block.size >= BLOCK:
                    yield block.grid()
                    block = _Block(atlas)
            bar.update()
        yield block.grid()


def _lattice(first: Array, last: Array) -> Iterator[Array]:
    """All whole numbers between two corners [k], in pieces [at most BLOCK, k]."""
    shape = tuple((last - first + 1.0).astype(np.int64))
    for start in range(0, int(np.prod(shape)), BLOCK):
        numbers = np.arange(start, min(start + BLOCK, int(np.prod(shape))))
        yield first + np.column_stack(np.unravel_index(numbers, shape))


def _fitted(U: Array, normals: Array, offsets: Array, spacing: float) -> Array:
    """Lattice points inside a polytope, then those moved into it from half a cell's diagonal around [m, k]."""
    reach = np.sqrt(U.shape[1]) / 2.0 * spacing
    excess = (U @ normals.T - offsets).max(axis=1)
    inside: Array = U[excess <= ROUNDING]
    around: Array = U[(excess > ROUNDING) & (excess <= reach)]
    if len(around) == 0:
        return inside
    moved = _nearest_points(around, normals, offsets)
    moved = moved[np.linalg.norm(moved - around, axis=1) <= reach]
    first = np.unique(np.round(moved / (SAME * spacing)), axis=0, return_index=True)[1]
    return np.concatenate([inside, moved[np.sort(first)]])


def _nearest_points(U: Array, normals: Array, offsets: Array) -> Array:
    """Nearest points of the polytope {w : normals w <= offsets} to points outside [m, k]."""
    excess = U @ normals.T - offsets
    worst = excess.argmax(axis=1)
    moved = U - excess[np.arange(len(U)), worst, None] * normals[worst]
    # The nearest point of one half-space is that of the polytope if it lies in the polytope; else an edge is nearest.
    for i in np.flatnonzero((moved @ normals.T - offsets).max(axis=1) > ROUNDING):
        moved[i] = U[i] + shortest_way(normals, excess[i])
    return np.asarray(moved)


class _Block:
    """Points of some charts, projected to the manifold as they come."""

    def __init__(self, atlas: Atlas) -> None:
        self.atlas = atlas
        self.x: list[Array] = [np.zeros((0, atlas.system.configuration_size))]
        self.u: list[Array] = [np.zeros((0, atlas.dimension))]
        self.charts: list[IntArray] = [np.zeros(0, np.int64)]
        self.not_converged = self.outside = self.size = 0

    def add(self, chart: int, U: Array) -> None:
        """Project the points above U [m, k] of a chart, and keep those near it and inside the bounds."""
        system, center, Phi = self.atlas.system, self.atlas.centers[chart], self.atlas.bases[chart]
        self.size += len(U)
        points = [_core.project(system, center, Phi, u) for u in U]
        there = np.array([x is not None for x in points], bool)
        if not there.any():
            self.not_converged += len(U)
            return
        x = np.array([x for x in points if x is not None])
        away = np.array([system.difference(center, one) for one in x])
        # Eq (17): the point is no farther than epsilon from the tangent space.
        near = (away**2).sum(axis=1) - ((away @ Phi.T) ** 2).sum(axis=1) <= self.atlas.epsilon**2
        slack = np.array([system.slack(one) for one in x])
        inside = (slack >= -BOUND_TOLERANCE).all(axis=1)
        self.not_converged += len(U) - int(near.sum())
        self.outside += int((near & ~inside).sum())
        keep = near & inside
        self.x.append(x[keep])
        self.u.append(U[there][keep])
        self.charts.append(np.full(int(keep.sum()), chart))

    def grid(self) -> Grid:
        return Grid(
            x=np.concatenate(self.x),
            charts=np.concatenate(self.charts),
            u=np.concatenate(self.u),
            not_converged=self.not_converged,
            outside=self.outside,
            complete=True,
        )


def joined_grid(atlas: Atlas, grids: list[Grid], complete: bool) -> Grid:
    """Pieces as one grid."""
    pieces = [_Block(atlas).grid(), *grids]
    return Grid(
        x=np.concatenate([g.x for g in pieces]),
        charts=np.concatenate([g.charts for g in pieces]),
        u=np.concatenate([g.u for g in pieces]),
        not_converged=sum(g.not_converged for g in pieces),
        outside=sum(g.outside for g in pieces),
        complete=complete,
    )
