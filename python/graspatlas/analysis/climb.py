"""Climbs to a local maximum of a quality index on the manifold, by a local optimiser.

The paper argues that "local methods departing from a given configuration are not likely to find a globally optimal
grasp". This module lets you test that on your own result::

    maxima = ga.local_maxima(result)                    # charts that are better than all their neighbours
    ends = [ga.climb(result, chart) for chart in starts]
    peaks = peaks_of(result, ends)                      # where they ended, the best first
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from graspatlas.analysis.local_model import LocalModel, Objective
from graspatlas.analysis.unbounded import followed, is_sharp, levels_around, never_levels_off, rises_towards_one_point
from graspatlas.errors import GraspAtlasError
from graspatlas.quality.evaluation import evaluate
from graspatlas.result.grasp_atlas import GraspAtlas, check_is_result
from graspatlas.support.arrays import Array
from graspatlas.support.deadlines import deadline_after
from graspatlas.support.validation import number_array, shown, whole

__all__ = ["MAX_STEPS", "Climb", "climb"]


#: Steps after which a climb is given up.
MAX_STEPS = 200
#: After so many steps each time a climb checks whether it runs after an index that grows without bound.
CHECK_EVERY = 50
#: A climb ends when nothing at this share of the chart radius is better.
SMALLEST_TRUST = 1e-3
#: Numbers of a grasp are smaller, so that their squares do not overflow.
LARGEST = 1e100
#: How far a start may miss its equations and be outside its bounds.
ON_MANIFOLD = 1e-8


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
            :mod:`graspatlas.analysis.unbounded`.
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
    check_is_result(result)
    whole(max_steps, "max_steps")
    deadline = deadline_after(max_seconds)
    objective = Objective.of(result, all_motions)
    chart, x = _start(result, start)
    residual = float(np.abs(objective.system.evaluate_residual(x)).max(initial=0.0))
    outside = float(-objective.system.slack(x).min(initial=0.0))
    if residual > ON_MANIFOLD or outside > ON_MANIFOLD:
        raise GraspAtlasError(
            f"the grasp misses its equations by {residual:.3g} and its bounds by {max(outside, 0.0):.3g}; "
            "project it before you climb from it, see Atlas.point"
        )
    if not objective.meets(x):
        name = f"chart {chart}" if chart >= 0 else "the grasp"
        raise GraspAtlasError(f"{name} does not meet the requirements; start from one that does, see result.accepted")
    value = float(evaluate(result.quality, objective.grasps(x))[0])
    trust_radius = objective.radius
    qualities = [value]
    while trust_radius > SMALLEST_TRUST * objective.radius and len(qualities) <= max_steps:
        if time.perf_counter() >= deadline:
            break
        model = LocalModel(objective, x, value, trust_radius)
        better = model.optimise() or model.poll()
        if better is None:
            trust_radius *= 0.3
            continue
        x, value = better
        qualities.append(value)
        if (len(qualities) - 1) % CHECK_EVERY == 0 and rises_towards_one_point(_levels(objective, x, value)):
            break
    return _ended(objective, Climb(chart, x, np.array(qualities), trust_radius <= SMALLEST_TRUST * objective.radius))


def _levels(objective: Objective, x: Array, value: float) -> Array:
    return levels_around(partial(LocalModel, objective), x, value, objective.radius)


def _ended(objective: Objective, end: Climb) -> Climb:
    """A climb that ended, with whether the index has a maximum there."""
    levels = _levels(objective, end.x, end.quality)
    if not end.converged:
        return replace(end, unbounded=rises_towards_one_point(levels))
    if is_sharp(levels):
        x, value = followed(partial(LocalModel, objective), end.x, end.quality, objective.radius)
        if value > end.quality:
            end = replace(end, x=x, qualities=np.append(end.qualities, value))
            levels = _levels(objective, x, value)
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
