"""A first grasp from which it is worth to start, where the problem states none.

Of grasps drawn at random nearly none meets requirements such as force closure or no collision, and most lie at a joint
limit or at the rim of a patch, where an atlas ends as soon as it begins. So those that miss them least climb until they
meet them, first with room to all limits and rims, then without. Those near the pose guess, if there is one, start
first, and the nearest to it is taken. Where the mean posture leaves no grasp in which the frozen hand motions are its
own, and no reference says that they must be, any feasible grasp will do: the frozen motions are then those of it.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from graspatlas.analysis.objective import Objective
from graspatlas.errors import GraspAtlasError
from graspatlas.problem.object_joint import ObjectJoint
from graspatlas.problem.pose_guess import PoseGuess
from graspatlas.problem.problem import Problem
from graspatlas.requirements.base import RequirementLike
from graspatlas.search.grasp_search import GraspSearch, can_grow, with_first_grasp
from graspatlas.search.random_starts import hand_size
from graspatlas.support.arrays import Array
from graspatlas.support.deadlines import deadline_after, seconds_until
from graspatlas.support.progress import ProgressBar, progress_bar

__all__ = ["with_good_first_grasp"]

#: Shares of all ranges that first grasps keep off the ends: what is tried first, and what then.
ROOMS = (0.05, 0.0)
#: Random tries at a time, and how often with each room.
TRIES, BATCHES = 200, 4
#: Grasps that climb at a time, and their steps: few, so that they stay where they are, then more.
CLIMBS, STEPS = 12, (6, 60)
#: Largest entry of the first step of a climb [units of the tangent space].
FIRST_STEP = 0.1
#: What climbs raise while they look for the requirements: it keeps the grasp away from singular ones.
INDEX = "inverse_condition_number"
#: Time that climbs are given where none is left [s].
SHORTEST = 1e-3
#: Time that the search for any feasible grasp is given where none is left [s].
LAST_SEARCH = 1.0
#: Longest search without each of the couplings that may leave no grasp [s].
WITHOUT_SECONDS = 2.0


def with_good_first_grasp(
    problem: Problem,
    dimension: int,
    requirements: Sequence[RequirementLike],
    max_seconds: float | None = None,
    progress: bool | None = None,
) -> Problem:
    """The problem itself when it has an x1, or else with one that is found, the same at every call.

    Args:
        problem: The problem.
        dimension: k. The hand motions that it freezes are frozen at the reference posture, eq (13); where the problem
            states none, at the mean of the hand motions, or else at the first grasp.
        requirements: What the grasp is to meet; where none is found that does, any feasible one is taken.
        max_seconds: Time after which the search is given up; none by default.
        progress: Show a progress bar.

    Raises:
        GraspAtlasError: If no grasp is found; it names the coupling that leaves none.
    """
    if problem.x1 is not None:
        return problem
    deadline = deadline_after(max_seconds)
    free = problem.reference is None and problem.frozen_motions(dimension) > 0
    dimensions = (dimension, problem.largest_dimension) if free else (dimension,)
    reached: list[int] = []
    with progress_bar("tries at a first grasp", progress=progress) as bar:
        for room in ROOMS:
            for k in dimensions:
                search = GraspSearch(problem, k, 0, room)
                stated = search.problem if k == dimension else problem
                for x in _meeting(search, tuple(requirements), deadline, bar):
                    found = stated.at(x)
                    if can_grow(found.system(dimension), found.start(dimension)):
                        return found
                reached += [k] if search.found else []
    k = dimension if dimension in reached else dimensions[-1]
    try:
        found = with_first_grasp(problem, k, seconds_until(deadline, LAST_SEARCH), progress)
        return found if k == dimension else problem.at(found.x1_array)
    except GraspAtlasError as error:
        blocking = _couplings_that_leave_none(problem)
        raise GraspAtlasError(f"{error}{blocking}") from None


def _meeting(
    search: GraspSearch, requirements: tuple[RequirementLike, ...], deadline: float, bar: ProgressBar
) -> Iterator[Array]:
    """Grasps that meet the requirements (size of x,), those that are the better first grasps before others."""
    objective = Objective(search.problem, search.system, INDEX, requirements, FIRST_STEP)
    score = _score(search)
    for X in _batches(search, bar):
        if time.perf_counter() > deadline:
            return
        for ends in _ends(objective, X, deadline) if len(X) else ():
            yield from (ends[i] for i in np.argsort([score(x) for x in ends], kind="stable"))


def _batches(search: GraspSearch, bar: ProgressBar) -> Iterator[Array]:
    """Feasible grasps, those near the pose guess first."""
    X = search.attempts_near_guess()
    if search.tries:
        bar.update(search.tries)
        yield X
    for _ in range(BATCHES):
        yield search.attempts(TRIES)
        bar.update(TRIES)


def _ends(objective: Objective, X: Array, deadline: float) -> Iterator[Array]:
    """Grasps that meet the requirements: of X, or else those to which the nearest climb in a few steps, or in more."""
    yield X[objective.meets(X)]
    nearest = X[np.argsort(objective.missed(X), kind="stable")[:CLIMBS]]
    for steps in STEPS:
        ends = objective.climbs(nearest, steps, seconds_until(deadline, SHORTEST))
        there = ends.x[[status != "not met" for status in ends.status]]
        yield there[objective.meets(there)]


def _score(search: GraspSearch) -> Callable[[Array], float]:
    """What is small for a good first grasp: how far it is from the guess, or how near to limits and rims."""
    problem = search.problem
    if problem.pose_guess is None:
        return lambda x: -float(search.system.slack(x).min(initial=np.inf))
    joint, guess, first = problem.object_joint_model, problem.pose_guess, len(problem.reference_array)
    size = hand_size(problem)
    return lambda x: _offset(guess, joint, x[first : first + joint.size], size)


def _offset(guess: PoseGuess, joint: ObjectJoint, pose: Array, size: float) -> float:
    """How far a pose is from the guess: half a turn counts as much as the size of the hand."""
    metres, angle = guess.offset(*joint.to_rotation(pose))
    return metres / size + angle / np.pi


def _couplings_that_leave_none(problem: Problem) -> str:
    """What to add to an error: the couplings without which grasps are found."""
    motions = problem.motions
    if motions is None or not len(motions.couplings):
        return ""
    names = []
    for i, row in enumerate(motions.couplings):
        freed = replace(problem, motions=replace(motions, couplings=np.delete(motions.couplings, i, axis=0)))
        search = GraspSearch(freed, freed.largest_dimension, 0)
        with progress_bar("tries without a coupling", progress=False) as bar:
            found = search.next_grasp(deadline_after(WITHOUT_SECONDS), bar)
        if found is not None:
            names.append(_coupling_name(row, motions.joints))
    if not names:
        return "; no single coupling of the hand motions is at fault"
    return f"; without the coupling {' or '.join(names)} there are some: leave it out, or change the contacts"


def _coupling_name(row: Array, joints: Sequence[str]) -> str:
    return "{" + ", ".join(f"{name}: {c:g}" for name, c in zip(joints, row, strict=True) if c) + "}"
