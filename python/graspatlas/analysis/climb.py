"""Local maxima of a quality index: those of an atlas, and those at which a local optimiser ends.

The paper argues that "local methods departing from a given configuration are not likely to find a globally optimal
grasp". This module lets you test that on your own result::

    maxima = ga.local_maxima(result)                    # charts that are better than all their neighbours
    ends = [ga.climb(result, chart) for chart in starts]
    peaks = peaks_of(result, ends)                      # where they ended, the best first
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import minimize
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from graspatlas import _core
from graspatlas.analysis.runaways import climbs_a_needle, followed, is_sharp, levels_around, never_levels_off
from graspatlas.errors import GraspAtlasError
from graspatlas.grasps.grasps import Grasps
from graspatlas.problem.problem import Problem
from graspatlas.quality.evaluation import Quality, evaluate
from graspatlas.requirements.screening import Require, Requirement, screen
from graspatlas.result.grasp_atlas import GraspAtlas
from graspatlas.support.deadlines import deadline_after
from graspatlas.support.validation import checked_instance, number_array, shown, whole

__all__ = ["Climb", "Peak", "climb", "local_maxima", "peaks_of"]

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]

#: Steps after which a climb is given up.
MAX_STEPS = 200
#: After so many steps each time a climb looks whether it runs after an index that grows without bound.
LOOK_AROUND = 50
#: A climb ends when nothing at this share of the chart radius is better.
SMALLEST_REACH = 1e-3
#: What counts as better, relative to the quality.
LEAST_GAIN = 1e-7
#: How far inside its bounds and requirements a climb stays, as a share of the reach.
MARGIN = 1e-6
#: Shares of the optimiser's step that are tried: requirements may have been seen too late.
SHARES = np.array([1.0, 0.99, 0.9, 0.6, 0.3, 0.1])
#: How far a point may be outside its bounds [units of the tangent space].
BOUND_TOLERANCE = 1e-9
#: Numbers of a grasp are smaller, so that their squares do not overflow.
LARGEST = 1e100
#: How far a start may miss its equations and be outside its bounds.
ON_MANIFOLD = 1e-8
#: Step of the differences, as a share of the reach.
DIFFERENCE = 1e-3
#: Directions that are tried when the optimiser finds nothing better.
DIRECTIONS = 16
#: Two climbs end on one peak when their ends are no farther apart than this share of the chart radius.
SAME_PEAK = 0.5


def local_maxima(result: GraspAtlas) -> IntArray:
    """Charts that no neighbour beats, the best first; charts that do not meet the result's requirements do not count.

    Charts of equal quality that are connected count once, by the first of them, and only if none of them has a better
    neighbour.

    Args:
        result: The result.

    Returns:
        Charts [p], by decreasing quality.
    """
    checked_instance(result, GraspAtlas, "result", "graspatlas.optimize")
    atlas, q = result.atlas, np.where(result.accepted, result.qualities, -np.inf)
    i, j = atlas.neighbour_pairs.T
    equal = q[i] == q[j]
    graph = coo_array((np.ones(equal.sum()), (i[equal], j[equal])), shape=(atlas.n_charts, atlas.n_charts))
    n_groups, group = connected_components(graph, directed=False)
    beaten = np.zeros(n_groups, bool)
    beaten[group[i[q[i] < q[j]]]] = True
    beaten[group[j[q[j] < q[i]]]] = True
    first = np.unique(group, return_index=True)[1]
    charts = first[~beaten & result.accepted[first]]
    return np.asarray(charts[np.argsort(-q[charts], kind="stable")], np.int64)


@dataclass(frozen=True, eq=False)
class Climb:
    """One run of the local optimiser.

    Attributes:
        chart: Chart at whose centre it started; -1 when it started elsewhere.
        x: Where it ended [configuration_size].
        qualities: The index at the start and after each step; never decreasing.
        converged: True when it ended at a maximum; False when it was given up after the largest number of steps, or the
            longest time, or ran after an index that has no maximum there.
        unbounded: True when the index grows without bound where it went, as far as numbers can tell; see
            :mod:`graspatlas.analysis.runaways`.
    """

    chart: int
    x: Array
    qualities: Array
    converged: bool
    unbounded: bool = False

    def __repr__(self) -> str:
        end = "converged" if self.converged else "given up"
        return f"<Climb from chart {self.chart}: {self.n_steps} steps to {self.quality:.6g}, {end}>"

    @property
    def quality(self) -> float:
        """The index where it ended."""
        return float(self.qualities[-1])

    @property
    def n_steps(self) -> int:
        """Number of steps taken."""
        return len(self.qualities) - 1


def climb(
    result: GraspAtlas,
    start: int | ArrayLike,
    *,
    all_motions: bool = False,
    max_steps: int = MAX_STEPS,
    max_seconds: float | None = None,
) -> Climb:
    """Climb to a local maximum of the index, on the manifold, within its bounds and the result's requirements.

    In the tangent space of the current grasp, SLSQP of SciPy maximises the index of the projected point over the
    tangent coordinates, in a box as wide as the chart radius. Its result becomes the next grasp if it is better; if
    not, the best of a ring of points does; if none is better, the box shrinks. The climb ends when the box is a
    thousandth of the radius. Where it ends the index is looked at on ever smaller rings, which tell a maximum from an
    index that grows without bound.

    Args:
        result: The result; its index may be any callable.
        start: Number of the chart at whose centre to start, or a grasp [configuration_size].
        all_motions: Climb in all t dimensions of F, no hand motion frozen but the couplings, instead of in R.
        max_steps: Steps after which the climb is given up; earlier where the index grows without bound.
        max_seconds: Time after which the climb is given up, at the end of a step; none by default.

    Returns:
        The climb.

    Raises:
        GraspAtlasError: If there is no such chart, the start is no feasible grasp or does not meet the requirements, or
            the index fails.
    """
    checked_instance(result, GraspAtlas, "result", "graspatlas.optimize")
    whole(max_steps, "max_steps")
    deadline = deadline_after(max_seconds)
    hill = _Hill.of(result, all_motions)
    chart, x = _start(result, start)
    residual = float(np.abs(hill.system.evaluate_residual(x)).max(initial=0.0))
    outside = float(-hill.system.slack(x).min(initial=0.0))
    if residual > ON_MANIFOLD or outside > ON_MANIFOLD:
        raise GraspAtlasError(
            f"the grasp misses its equations by {residual:.3g} and its bounds by {max(outside, 0.0):.3g}; "
            "project it before you climb from it, see Atlas.point"
        )
    if not hill.meets(x):
        name = f"chart {chart}" if chart >= 0 else "the grasp"
        raise GraspAtlasError(f"{name} does not meet the requirements; start from one that does, see result.accepted")
    value = float(evaluate(result.quality, hill.grasps(x))[0])
    reach = hill.radius
    qualities = [value]
    while reach > SMALLEST_REACH * hill.radius and len(qualities) <= max_steps:
        if time.perf_counter() >= deadline:
            break
        place = _Surroundings(hill, x, value, reach)
        better = place.optimised() or place.best_of_ring()
        if better is None:
            reach *= 0.3
            continue
        x, value = better
        qualities.append(value)
        if (len(qualities) - 1) % LOOK_AROUND == 0 and climbs_a_needle(_levels(hill, x, value)):
            break
    return _ended(hill, Climb(chart, x, np.array(qualities), reach <= SMALLEST_REACH * hill.radius))


def _levels(hill: _Hill, x: Array, value: float) -> Array:
    return levels_around(partial(_Surroundings, hill), x, value, hill.radius)


def _ended(hill: _Hill, end: Climb) -> Climb:
    """A climb that ended, with whether the index has a maximum there."""
    levels = _levels(hill, end.x, end.quality)
    if not end.converged:
        return replace(end, unbounded=climbs_a_needle(levels))
    if is_sharp(levels):
        x, value = followed(partial(_Surroundings, hill), end.x, end.quality, hill.radius)
        if value > end.quality:
            end = replace(end, x=x, qualities=np.append(end.qualities, value))
            levels = _levels(hill, x, value)
        unbounded = never_levels_off(levels)
        return replace(end, converged=not unbounded, unbounded=unbounded)
    return end


def _start(result: GraspAtlas, start: int | ArrayLike) -> tuple[int, Array]:
    """Chart and grasp that a climb starts from; chart -1 for a grasp that was given."""
    atlas = result.atlas
    if isinstance(start, int | np.integer) and not isinstance(start, bool):
        return int(start), result.grasp(int(start)).x
    x = number_array(start, "a grasp to climb from")
    if x.shape != (atlas.system.configuration_size,) or not (np.abs(x) < LARGEST).all():
        raise GraspAtlasError(
            f"a climb starts from the number of a chart or a grasp of {atlas.system.configuration_size} numbers, "
            f"got {shown(start)}"
        )
    return -1, x


@dataclass(frozen=True)
class _Hill:
    """What is climbed: the index over the grasps of a system that meet the requirements."""

    problem: Problem
    system: _core.GraspSystem
    quality: Quality
    requirements: tuple[Require, ...]
    radius: float

    @classmethod
    def of(cls, result: GraspAtlas, all_motions: bool) -> _Hill:
        system = result.problem.system(result.problem.largest_dimension if all_motions else result.dimension)
        return cls(result.problem, system, result.quality, result.requirements, result.atlas.radius)

    def grasps(self, X: ArrayLike) -> Grasps:
        return Grasps(self.problem, X, self.system)

    def meets(self, x: Array) -> bool:
        return bool(screen(self.requirements, self.grasps(x))[0][0])


class _Surroundings:
    """The tangent space of a grasp x, in coordinates w [k] between -1 and 1, and the points of the manifold above it.

    What optimisers ask for is the gain, by how much better than x a point is, relatively; and its slacks, all positive
    inside: those of the bounds and of the requirements that are near.
    """

    def __init__(self, hill: _Hill, x: Array, value: float, reach: float) -> None:
        self.hill, self.x, self.value, self.reach = hill, x, value, reach
        J = hill.system.evaluate_jacobian(x)
        self.Phi = np.ascontiguousarray(np.linalg.svd(J)[2][len(J) :])
        B = hill.system.bound_normals
        self.near = hill.system.slack(x) < 2.0 * reach * np.sqrt(len(self.Phi)) * np.linalg.norm(B, axis=1)
        here = hill.grasps(x)
        named = [r.slacks_near(here) for r in hill.requirements if isinstance(r, Requirement)]
        self.required = [slacks for slacks in named if slacks is not None]
        self.scale = max(abs(value), 1e-12)
        self._seen: dict[bytes, tuple[Array, Array]] = {}

    def point(self, w: Array) -> Array | None:
        """Point of the manifold above w, eqs (14) and (15)."""
        x = _core.project(self.hill.system, self.x, self.Phi, self.reach * np.asarray(w))
        return None if x is None else np.asarray(x)

    def look(self, W: Array) -> tuple[Array, Array]:
        """Gains [n] and slacks [n, c] of the points above W [n, k]; -1 where there is none."""
        key = W.tobytes()
        if key not in self._seen:
            self._seen[key] = self._look(W)
        return self._seen[key]

    def _look(self, W: Array) -> tuple[Array, Array]:
        points = [self.point(w) for w in W]
        there = np.array([p is not None for p in points])
        rows = [p for p in points if p is not None] or [self.x]
        grasps = self.hill.grasps(np.array(rows))
        values = (evaluate(self.hill.quality, grasps) - self.value) / self.scale
        bounds = np.array([self.hill.system.slack(p)[self.near] for p in rows]) / self.reach
        inside = np.hstack([bounds, *(slacks(grasps) / self.reach for slacks in self.required)]) - MARGIN
        gains, slacks = np.full(len(W), -1.0), np.full((len(W), inside.shape[1]), -1.0)
        gains[there], slacks[there] = values[: there.sum()], inside[: there.sum()]
        return gains, slacks

    def slopes(self, w: Array) -> tuple[Array, Array]:
        """Derivatives by w of the gain [k] and the slacks [c, k], by central differences."""
        h = DIFFERENCE * np.eye(len(w))
        gains, slacks = self.look(np.concatenate([w + h, w - h]))
        k = len(w)
        step = 2.0 * DIFFERENCE
        return (gains[:k] - gains[k:]) / step, (slacks[:k] - slacks[k:]).T / step

    def optimised(self) -> tuple[Array, float] | None:
        """What SLSQP finds, or something on the way there, if it is better."""
        k = len(self.Phi)
        limits = {"type": "ineq", "fun": lambda w: self.look(w[None])[1][0], "jac": lambda w: self.slopes(w)[1]}
        found = minimize(
            lambda w: -float(self.look(w[None])[0][0]),
            np.zeros(k),
            jac=lambda w: -self.slopes(w)[0],
            method="SLSQP",
            bounds=[(-1.0, 1.0)] * k,
            constraints=[limits] if self.near.any() or self.required else [],
            options={"maxiter": 8, "ftol": 1e-10},
        )
        w = np.asarray(found.x)
        return self.better(SHARES[:, None] * w) if np.isfinite(w).all() else None

    def best_of_ring(self) -> tuple[Array, float] | None:
        """The best of some points at distance 1, if it is better."""
        W = np.random.default_rng(0).normal(size=(DIRECTIONS, len(self.Phi)))
        if W.shape[1] == 2:
            angles = 2.0 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS
            W = np.column_stack([np.cos(angles), np.sin(angles)])
        return self.better(W / np.linalg.norm(W, axis=1, keepdims=True))

    def better(self, W: Array) -> tuple[Array, float] | None:
        """The best of the points above W that meet everything, and its quality, if that is better."""
        gains, slacks = self.look(W)
        for row in np.argsort(-gains, kind="stable"):
            if gains[row] < LEAST_GAIN:
                return None
            x = self.point(W[row]) if (slacks[row] > -MARGIN).all() else None
            if x is None or self.hill.system.slack(x).min(initial=0.0) < -BOUND_TOLERANCE or not self.hill.meets(x):
                continue
            return x, self.value + float(gains[row]) * self.scale
        return None


@dataclass(frozen=True, eq=False)
class Peak:
    """A place at which climbs ended.

    Attributes:
        quality: The largest index with which one ended there.
        climbs: Numbers of the climbs, in the order given [n].
        x: End of the best of them [configuration_size].
        converged: True when every climb stopped there by itself, at a maximum.
        unbounded: True when the best of them ran after an index that grows without bound there.
    """

    quality: float
    climbs: IntArray
    x: Array
    converged: bool
    unbounded: bool = False

    def __repr__(self) -> str:
        return f"<Peak of quality {self.quality:.6g}, where {len(self.climbs)} climbs ended>"


def peaks_of(result: GraspAtlas, climbs: Sequence[Climb]) -> list[Peak]:
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
        peaks.append(Peak(top.quality, members, top.x, all(climbs[int(m)].converged for m in members), top.unbounded))
    return sorted(peaks, key=lambda peak: -peak.quality)
