"""Climbs to a local maximum of a quality index on the manifold, by a local optimiser.

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
from numpy.typing import ArrayLike

from graspatlas.analysis.objective import BOUND_TOLERANCE, Ends, Objective
from graspatlas.analysis.unbounded import (
    Around,
    followed,
    is_sharp,
    levels_around,
    never_levels_off,
    rises_towards_one_point,
)
from graspatlas.errors import GraspAtlasError
from graspatlas.result.grasp_atlas import GraspAtlas, check_is_result
from graspatlas.support.arrays import Array
from graspatlas.support.deadlines import deadline_after
from graspatlas.support.validation import number_array, positive, shown, whole

__all__ = ["MAX_STEPS", "Climb", "climb", "climbs_from", "climbs_of"]


#: Steps after which a climb is given up.
MAX_STEPS = 200
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
        qualities: The index at the start and after each step. It may fall on the way, where a step makes good what
            the one before missed of a requirement, but not below the start in the end.
        converged: True when it ended at a maximum: the slope of the index is zero there, or held back by bounds and
            requirements, so that ``kkt`` is at most 1e-6. False when it was given up after the largest number of steps,
            or the longest time, came to a place where no step gains but slopes do not agree, or ran after an index that
            has no maximum there.
        unbounded: True when the index grows without bound where it went, as far as numbers can tell; see
            :mod:`graspatlas.analysis.unbounded`.
        kkt: Largest residual of the conditions of Karush, Kuhn and Tucker where it ended, of the logarithm of the index
            [per unit of the tangent space].
        stalled: True when it ended because no smaller step gained anything, though slopes do not vanish.
    """

    chart: int
    x: Array
    qualities: Array
    converged: bool
    unbounded: bool = False
    kkt: float = float("nan")
    stalled: bool = False

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

    The compiled core climbs by sequential quadratic programming in the tangent spaces of the grasps that it passes,
    with bounds and requirements as constraints: see ``cpp/graspatlas/climb/climber.hpp``. It ends where the index has
    no slope that they do not hold back, and where no grasp of a sample around is better. An index or a requirement that
    is a function of yours is asked by the core.

    Args:
        result: The result; its index may be any callable.
        start: Number of the chart at whose centre to start, or a grasp [configuration_size].
        all_motions: Climb in all t dimensions of F, no hand motion frozen but the couplings, instead of in R.
        max_steps: Steps after which the climb is given up.
        max_seconds: Time after which the climb is given up, at the end of a step; none by default.

    Returns:
        The climb.

    Raises:
        GraspAtlasError: If there is no such chart, the start is no feasible grasp or does not meet the requirements, or
            the index fails.
    """
    check_is_result(result)
    whole(max_steps, "max_steps")
    if max_seconds is not None:
        positive(max_seconds, "max_seconds")
    objective = Objective.of(result, all_motions)
    chart, x = _start(result, start)
    residual = float(np.abs(objective.system.evaluate_residual(x)).max(initial=0.0))
    outside = float(-objective.system.slack(x).min(initial=0.0))
    if residual > ON_MANIFOLD or outside > ON_MANIFOLD:
        raise GraspAtlasError(
            f"the grasp misses its equations by {residual:.3g} and its bounds by {max(outside, 0.0):.3g}; "
            "project it before you climb from it, see Atlas.point"
        )
    if outside <= BOUND_TOLERANCE and not objective.meets(x[None])[0]:
        name = f"chart {chart}" if chart >= 0 else "the grasp"
        raise GraspAtlasError(f"{name} does not meet the requirements; start from one that does, see result.accepted")
    return climbs_from(objective, x[None], [chart], max_steps, max_seconds)[0]


def climbs_from(
    objective: Objective, X: Array, charts: Sequence[int], max_steps: int, max_seconds: float | None = None
) -> list[Climb]:
    """Climbs from grasps that meet the requirements, or are so near to them that the climbs repair that.

    Args:
        objective: What is maximised.
        X: The grasps [n, configuration_size].
        charts: Chart of each, -1 for none.
        max_steps: Steps after which a climb is given up.
        max_seconds: Time after which all are; none by default.

    Returns:
        A climb for each; one that never met the requirements stays where it started.
    """
    deadline = deadline_after(max_seconds)
    ends = objective.climbs(X, max_steps, max_seconds)
    return climbs_of(objective, X, charts, ends, deadline)


def climbs_of(
    objective: Objective, X: Array, charts: Sequence[int], ends: Ends, deadline: float = float("inf")
) -> list[Climb]:
    """Ends of climbs in the core as climbs; whether the index has a maximum there is looked at while there is time."""
    values = objective.values(X)
    found = []
    for i, chart in enumerate(charts):
        end = Climb(int(chart), X[i], values[i : i + 1], False)
        # Where it ended is asked again, by the code that says what grasps are accepted.
        if ends.status[i] != "not met" and objective.meets(ends.x[i : i + 1])[0]:
            qualities = np.concatenate([values[i : i + 1], ends.values[i][1:]])
            qualities[-1] = objective.values(ends.x[i : i + 1])[0]
            status = ends.status[i]
            end = Climb(
                int(chart),
                ends.x[i],
                qualities,
                status == "converged",
                kkt=float(ends.kkt[i]),
                stalled=status == "stalled",
            )
        found.append(_judged(objective, end) if time.perf_counter() < deadline else end)
    return found


def _judged(objective: Objective, end: Climb) -> Climb:
    """A climb with whether it ran after an index without a maximum: only one that has not converged can have."""
    if end.converged:
        return end
    near = partial(Around, objective)
    levels = levels_around(near, end.x, end.quality, objective.radius)
    if rises_towards_one_point(levels):
        return replace(end, unbounded=True)
    if is_sharp(levels):
        x, value = followed(near, end.x, end.quality, objective.radius)
        if value > end.quality:
            end = replace(end, x=x, qualities=np.append(end.qualities, value))
            levels = levels_around(near, x, value, objective.radius)
        return replace(end, unbounded=never_levels_off(levels))
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
