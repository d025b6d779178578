"""Local maxima of a quality index: those of an atlas, and those at which a local optimiser ends.

The paper argues that "local methods departing from a given configuration are not likely to find a globally optimal
grasp". This module lets you test that on your own result::

    maxima = ga.local_maxima(result)                    # charts that are better than all their neighbours
    ends = [ga.climb(result, chart) for chart in starts]
    peaks = peaks_of(result, ends)                      # where they ended, the best first
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from graspatlas import _core
from graspatlas.errors import GraspAtlasError
from graspatlas.grasps import Grasps
from graspatlas.quality import evaluate
from graspatlas.result import Result
from graspatlas.tables import checked_instance

__all__ = ["Climb", "Peak", "climb", "local_maxima", "peaks_of"]

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]

#: Steps after which a climb is given up.
MAX_STEPS = 200
#: A climb ends when nothing at this share of the chart radius is better.
SMALLEST_REACH = 1e-3
#: What counts as better, relative to the quality.
LEAST_GAIN = 1e-7
#: How far inside its bounds a climb stays, as a share of the chart radius.
MARGIN = 1e-6
#: How far a point may be outside its bounds [units of the tangent space].
BOUND_TOLERANCE = 1e-9
#: Step of the differences, as a share of the reach.
DIFFERENCE = 1e-3
#: Directions that are tried when the optimiser finds nothing better.
DIRECTIONS = 16
#: Two climbs end on one peak when their ends are no farther apart than this share of the chart radius.
SAME_PEAK = 0.5


def local_maxima(result: Result) -> IntArray:
    """Charts that no neighbour beats, the best first; charts that do not meet the result's requirements do not count.

    Charts of equal quality that are connected count once, by the first of them, and only if none of them has a better
    neighbour.

    Args:
        result: The result.

    Returns:
        Charts [p], by decreasing quality.
    """
    checked_instance(result, Result, "result", "graspatlas.optimize")
    atlas, q = result.atlas, np.where(result.feasible, result.qualities, -np.inf)
    i, j = atlas.neighbour_pairs.T
    equal = q[i] == q[j]
    graph = coo_array((np.ones(equal.sum()), (i[equal], j[equal])), shape=(atlas.n_charts, atlas.n_charts))
    n_groups, group = connected_components(graph, directed=False)
    beaten = np.zeros(n_groups, bool)
    beaten[group[i[q[i] < q[j]]]] = True
    beaten[group[j[q[j] < q[i]]]] = True
    first = np.unique(group, return_index=True)[1]
    charts = first[~beaten & result.feasible[first]]
    return np.asarray(charts[np.argsort(-q[charts], kind="stable")], np.int64)


@dataclass(frozen=True, eq=False)
class Climb:
    """One run of the local optimiser.

    Attributes:
        chart: Chart at whose centre it started.
        x: Where it ended [configuration_size].
        qualities: The index at the start and after each step; never decreasing.
        converged: False when it was given up after the largest number of steps.
    """

    chart: int
    x: Array
    qualities: Array
    converged: bool

    @property
    def quality(self) -> float:
        """The index where it ended."""
        return float(self.qualities[-1])

    @property
    def n_steps(self) -> int:
        """Number of steps taken."""
        return len(self.qualities) - 1


def climb(result: Result, chart: int, *, max_steps: int = MAX_STEPS) -> Climb:
    """Climb from a chart's centre to a local maximum of the index, on the manifold and within its bounds.

    In the tangent space of the current grasp, SLSQP of SciPy maximises the index of the projected point over the k
    tangent coordinates, in a box as wide as the chart radius. Its result becomes the next grasp if it is better; if
    not, the best of a ring of points does; if none is better, the box shrinks. The climb ends when the box is a
    thousandth of the radius. The result's requirements play no part.

    Args:
        result: The result; its index may be any callable.
        chart: Where to start.
        max_steps: Steps after which the climb is given up: an index without bound is climbed for ever.

    Returns:
        The climb.

    Raises:
        GraspAtlasError: If there is no such chart, or the index fails.
    """
    checked_instance(result, Result, "result", "graspatlas.optimize")
    result.grasp(chart)
    if isinstance(max_steps, bool) or not isinstance(max_steps, int | np.integer) or max_steps < 1:
        raise GraspAtlasError(f"max_steps must be a whole number of at least 1, got {max_steps!r}")
    radius = result.atlas.radius
    x, value, reach = result.atlas.centers[chart], float(result.qualities[chart]), radius
    qualities = [value]
    while reach > SMALLEST_REACH * radius and len(qualities) <= max_steps:
        place = _Surroundings(result, x, value, reach)
        better = place.optimised() or place.best_of_ring()
        if better is None:
            reach *= 0.3
            continue
        x, value = better
        qualities.append(value)
    return Climb(int(chart), x, np.array(qualities), reach <= SMALLEST_REACH * radius)


class _Surroundings:
    """The tangent space of a grasp x, in coordinates w [k] between -1 and 1, and the index of the points above it."""

    def __init__(self, result: Result, x: Array, value: float, reach: float) -> None:
        self.result, self.x, self.value, self.reach = result, x, value, reach
        self.system = result.atlas.system
        J = self.system.evaluate_jacobian(x)
        self.Phi = np.ascontiguousarray(np.linalg.svd(J)[2][len(J) :])
        self.margin = MARGIN * result.atlas.radius
        B = self.system.bound_normals
        self.near = self.system.slack(x) < 2.0 * reach * np.sqrt(len(self.Phi)) * np.linalg.norm(B, axis=1)
        self.slopes = -reach * B[self.near] @ self.Phi.T
        self.scale = max(abs(value), 1e-12)

    def point(self, w: Array) -> Array | None:
        """Point of the manifold above w, eqs (14) and (15)."""
        x = _core.project(self.system, self.x, self.Phi, self.reach * np.asarray(w))
        return None if x is None else np.asarray(x)

    def gains(self, W: Array) -> Array:
        """How much better than x the points above W [n, k] are, relatively [n]; -1 where there is none."""
        points = [self.point(w) for w in W]
        found = [p for p in points if p is not None]
        gains = np.full(len(W), -1.0)
        if found:
            grasps = Grasps(self.result.problem, found, self.system)  # type: ignore[arg-type]
            values = evaluate(self.result.quality, grasps)
            gains[[p is not None for p in points]] = (values - self.value) / self.scale
        return gains

    def slope(self, w: Array) -> Array:
        """Derivative of the gain by w [k], by central differences."""
        h = DIFFERENCE * np.eye(len(w))
        gains = self.gains(np.concatenate([w + h, w - h]))
        return np.asarray((gains[: len(w)] - gains[len(w) :]) / (2.0 * DIFFERENCE))

    def inside(self, w: Array) -> Array:
        """Distance of the point above w from each bound that is near, less the margin."""
        x = self.point(w)
        if x is None:
            return np.full(int(self.near.sum()), -1.0)
        return np.asarray(self.system.slack(x)[self.near] - self.margin)

    def optimised(self) -> tuple[Array, float] | None:
        """What SLSQP finds, if it is better."""
        k = len(self.Phi)
        limits = {"type": "ineq", "fun": self.inside, "jac": lambda w: self.slopes}
        found = minimize(
            lambda w: -float(self.gains(w[None])[0]),
            np.zeros(k),
            jac=lambda w: -self.slope(w),
            method="SLSQP",
            bounds=[(-1.0, 1.0)] * k,
            constraints=[limits] if self.near.any() else [],
            options={"maxiter": 8, "ftol": 1e-10},
        )
        return self._better(np.asarray(found.x)[None]) if np.isfinite(found.x).all() else None

    def best_of_ring(self) -> tuple[Array, float] | None:
        """The best of some points at distance 1, if it is better."""
        W = np.random.default_rng(0).normal(size=(DIRECTIONS, len(self.Phi)))
        if W.shape[1] == 2:
            angles = 2.0 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS
            W = np.column_stack([np.cos(angles), np.sin(angles)])
        return self._better(W / np.linalg.norm(W, axis=1, keepdims=True))

    def _better(self, W: Array) -> tuple[Array, float] | None:
        """The best of the points above W that lie within the bounds, and its quality, if that is better."""
        gains = self.gains(W)
        for row in np.argsort(-gains):
            if gains[row] < LEAST_GAIN:
                return None
            x = self.point(W[row])
            if x is not None and self.system.slack(x).min(initial=0.0) >= -BOUND_TOLERANCE:
                return x, self.value + float(gains[row]) * self.scale
        return None


@dataclass(frozen=True, eq=False)
class Peak:
    """A place at which climbs ended.

    Attributes:
        quality: The largest index with which one ended there.
        climbs: Numbers of the climbs, in the order given [n].
        x: End of the best of them [configuration_size].
        converged: True when every climb stopped there by itself.
    """

    quality: float
    climbs: IntArray
    x: Array
    converged: bool


def peaks_of(result: Result, climbs: Sequence[Climb]) -> list[Peak]:
    """Group climbs by where they ended, the best peak first.

    Ends that are linked by distances of at most half a chart radius belong to one peak.

    Args:
        result: The result on which they climbed.
        climbs: The climbs.
    """
    if not climbs:
        return []
    difference = result.atlas.system.difference
    n = len(climbs)
    near = np.zeros((n, n), bool)
    for i in range(n):
        for j in range(i + 1, n):
            near[i, j] = np.linalg.norm(difference(climbs[i].x, climbs[j].x)) <= SAME_PEAK * result.atlas.radius
    n_groups, group = connected_components(coo_array(near), directed=False)
    peaks = []
    for number in range(n_groups):
        members = np.flatnonzero(group == number)
        top = max((climbs[int(m)] for m in members), key=lambda c: c.quality)
        peaks.append(Peak(top.quality, members, top.x, all(climbs[int(m)].converged for m in members)))
    return sorted(peaks, key=lambda peak: -peak.quality)
