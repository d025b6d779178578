"""One round of a search over all feasible grasps: where its climbs start, and where they end.

A round is a function of the search's seed and its own number, whatever machine runs it and whenever. Rounds of two
kinds alternate. One draws random grasps. The other lays an atlas through one of them, in the slice of F that freezes
the hand motions there, and takes its charts. Of both the climbs start where the requirements are missed least, far from
each other: of grasps drawn at random nearly none meets them, and climbs from those that nearly do repair them most
often.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from graspatlas import _core
from graspatlas.analysis.climb import MAX_STEPS
from graspatlas.analysis.objective import Objective
from graspatlas.errors import GraspAtlasError
from graspatlas.problem.problem import Problem
from graspatlas.quality.batched import Quality
from graspatlas.requirements.base import RequirementLike
from graspatlas.search.grasp_search import GraspSearch
from graspatlas.support.arrays import Array, BoolArray
from graspatlas.support.deadlines import deadline_after, seconds_until
from graspatlas.support.pickling import Light
from graspatlas.support.words import Word

__all__ = ["FIRST_STEP", "Plan", "Round", "RoundKind", "Starts", "climbed", "run_round"]

#: Tries at random grasps in a round.
TRIES = 400
#: Climbs of a round.
CLIMBS = 16
#: Starts of a round are farther apart than this [units of the tangent space].
APART = 0.2
#: Charts of the atlas of a slice.
SLICE_CHARTS = 600
#: Longest time that it may take, far more than it needs [s].
SLICE_SECONDS = 10.0
#: Time that climbs are given where none is left [s].
SHORTEST = 1e-3
#: Largest entry of the first step of a climb [units of the tangent space].
FIRST_STEP = 0.1


class RoundKind(Word):
    """Where the climbs of a round start."""

    STATED = "stated"
    RANDOM = "random"
    SLICE = "slice"


@dataclass(frozen=True)
class Plan(Light):
    """What a search over all feasible grasps maximises, and the numbers that fix it.

    Attributes:
        problem: The problem.
        quality: The index.
        requirements: What grasps must meet.
        dimension: k, of slices.
        radius: r, of their charts.
        epsilon: See :func:`graspatlas.build_atlas`.
        seed: Of the random numbers.
        max_steps: Steps after which a climb is given up.
        threads: Threads on which climbs run; all cores by default. They find the same, whatever it is.
    """

    problem: Problem
    quality: Quality
    requirements: tuple[RequirementLike, ...]
    dimension: int
    radius: float
    epsilon: float
    seed: int = 0
    max_steps: int = MAX_STEPS
    threads: int | None = None

    @cached_property
    def objective(self) -> Objective:
        """The index over all feasible grasps that meet the requirements."""
        system = self.problem.system(self.problem.largest_dimension)
        return Objective(self.problem, system, self.quality, self.requirements, FIRST_STEP, self.threads)


@dataclass(frozen=True, eq=False)
class Round:
    """Where the climbs of a round ended.

    Attributes:
        number: Of the round.
        kind: Where they started.
        x: The ends [n, configuration_size].
        value: The index there [n].
        kkt: Largest residual of the conditions of Karush, Kuhn and Tucker [n].
        met: Whether the end is a grasp that meets bounds and requirements [n].
        converged: Whether it is a local maximum, by ``kkt`` [n].
        stalled: Whether it is none, but no smaller step gained anything [n].
        missed: By how much the requirement that is missed most is, where ``met`` is False [n].
        tries: Random starts that were tried at grasps.
        seconds: Time that it took.
    """

    number: int
    kind: RoundKind
    x: Array
    value: Array
    kkt: Array
    met: BoolArray
    converged: BoolArray
    stalled: BoolArray
    missed: Array
    tries: int
    seconds: float


@dataclass(frozen=True, eq=False)
class Starts:
    """Where the climbs of a round start.

    Attributes:
        number: Of the round.
        kind: Where they come from.
        x: The grasps [n, configuration_size]; they may miss requirements.
        tries: Random starts that were tried at grasps.
    """

    number: int
    kind: RoundKind
    x: Array
    tries: int = 0


def run_round(plan: Plan, number: int, max_seconds: float | None = None) -> Round:
    """A round: 1, 3, ... start at random grasps, 2, 4, ... on slices through random grasps.

    Args:
        plan: What is maximised.
        number: Of the round, from 1 on.
        max_seconds: Time after which its climbs are given up; none by default.
    """
    deadline = deadline_after(max_seconds)
    search = GraspSearch(plan.problem, plan.problem.largest_dimension, [plan.seed, number])
    kind, X = RoundKind.RANDOM, search.attempts(TRIES)
    if number % 2 == 0 and len(X) and plan.problem.frozen_motions(plan.dimension) > 0:
        kind, X = RoundKind.SLICE, _slice(plan, X)
    return climbed(plan, Starts(number, kind, _chosen(plan.objective, X), search.tries), deadline)


def climbed(plan: Plan, starts: Starts, deadline: float) -> Round:
    """The round whose climbs start at these grasps.

    Args:
        plan: What is maximised.
        starts: The grasps.
        deadline: Reading of ``time.perf_counter`` after which climbs are given up [s].
    """
    begun, objective = time.perf_counter(), plan.objective
    ends = objective.climbs(starts.x, plan.max_steps, seconds_until(deadline, SHORTEST))
    status = np.array(ends.status, str)
    met = (status != "not met") & np.isfinite(ends.value)
    # Asked again, by the code that says what grasps are accepted.
    met[met] = objective.meets(ends.x[met])
    value = np.full(len(met), -np.inf)
    value[met] = objective.values(ends.x[met])
    return Round(
        number=starts.number,
        kind=starts.kind,
        x=ends.x,
        value=value,
        kkt=ends.kkt,
        met=met,
        converged=met & (status == "converged"),
        stalled=met & (status == "stalled"),
        missed=np.where(met, 0.0, ends.missed),
        tries=starts.tries,
        seconds=time.perf_counter() - begun,
    )


def _chosen(objective: Objective, X: Array) -> Array:
    """Of grasps [n, configuration_size], those that miss the requirements least, far from each other."""
    if not len(X):
        return X
    missed = objective.missed(X)
    values = objective.values(X[missed == 0.0])
    order = missed.copy()
    order[missed == 0.0] = -values.argsort().argsort() - 1.0  # those that meet them by their index
    embedded = np.array([objective.system.embed(x) for x in X])
    chosen: list[int] = []
    for i in np.argsort(order, kind="stable"):
        if len(chosen) == CLIMBS:
            break
        if not chosen or np.linalg.norm(embedded[chosen] - embedded[i], axis=1).min() > APART:
            chosen.append(int(i))
    return X[chosen]


def _slice(plan: Plan, X: Array) -> Array:
    """Charts of an atlas through that of random grasps which misses the requirements least.

    It lies in the slice of F in which the hand motions that k freezes are those of that grasp; the grasps X where none
    can grow there.
    """
    x = X[int(plan.objective.missed(X).argmin())]
    problem = replace(plan.problem, x1=None, reference=None).at(x)
    try:
        system = problem.system(plan.dimension)
        builder = _core.AtlasBuilder(system, problem.start(plan.dimension), plan.radius, plan.epsilon)
    except GraspAtlasError:
        return X
    builder.expand(SLICE_CHARTS, SLICE_SECONDS)
    return np.asarray(builder.arrays()["centers"])
