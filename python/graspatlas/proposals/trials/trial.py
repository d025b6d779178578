"""One assignment tried: the problem that it states, grasps that meet the requirements, and the best of them.

A look is cheap: grasps from the postures that match, climbs into the requirements and up the index, no hand motion
frozen. What it finds is worth an atlas: then the postures that were found tell which hand motions matter, the atlas of
the two that matter most grows from the best grasp, and the best of it climbs on in all motions.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from graspatlas.analysis.objective import Objective
from graspatlas.errors import GraspAtlasError
from graspatlas.grasps.grasps import Grasps
from graspatlas.hand.motions import HandMotions
from graspatlas.optimizer.optimize import optimize
from graspatlas.problem.contacts import Contact
from graspatlas.problem.problem import Problem
from graspatlas.problem.requirement import StatedRequirement
from graspatlas.proposals.assignments.fingers import touched
from graspatlas.proposals.assignments.matching import Assignment
from graspatlas.proposals.plan import Plan
from graspatlas.proposals.trials.pinning import pinned
from graspatlas.quality.batched import quality_name
from graspatlas.requirements.base import asked, requirement_name
from graspatlas.requirements.rejections import nearest, rejections
from graspatlas.result.result import Result
from graspatlas.search.grasp_search import GraspSearch
from graspatlas.support.arrays import Array
from graspatlas.support.words import Word

__all__ = ["Look", "LookEnd", "atlas_of", "look_at", "problem_of"]

#: Share of all ranges that grasps keep off limits and rims.
ROOM = 0.03
#: Random tries beside those that match, climbs, their steps, and the largest entry of the first of these.
TRIES, CLIMBS, STEPS, FIRST_STEP = 40, 8, 40, 0.1
#: k of the atlases, and their largest numbers of charts.
DIMENSION, CHARTS = 2, 4000
#: A region's rectangle is taken whole where the region fills this share of it; else what lies inside.
WHOLE = 0.97


class LookEnd(Word):
    """What came of a look at an assignment."""

    MET = "grasps meet the requirements"
    MISSED = "grasps miss a requirement"
    OUT_OF_REACH = "no grasp was found"
    SINGULAR = "its contacts are redundant"


@dataclass(frozen=True, eq=False)
class Look:
    """A first look at an assignment.

    Attributes:
        end: What came of it.
        value: The index of the best grasp that was found; -inf where none meets the requirements.
        x: That grasp (size of x,), or nothing.
        postures: Postures of the grasps that were found (n, nq).
        why: The requirement that was missed, where one was.
        lack: What the grasp lacks that came nearest to meeting the requirements, where none did; see
            :mod:`graspatlas.requirements.rejections`.
    """

    end: LookEnd
    value: float
    x: Array
    postures: Array
    why: str = ""
    lack: str = ""


def problem_of(plan: Plan, assignment: Assignment) -> Problem:
    """The problem that an assignment states, without hand motions and first grasp."""
    pads, regions = assignment.fingers.grip.pads, assignment.regions
    contacts = []
    for pad, region in zip(pads, regions, strict=True):
        patch = region.patch if region.filled >= WHOLE else region.inner
        contacts.append(Contact(pad.frame, touched(assignment.fingers.hand, pad), patch))
    stated = tuple(each for each in plan.requirements if isinstance(each, StatedRequirement))
    return Problem(
        name=f"{plan.body.name} by {plan.hand}",
        hand=assignment.fingers.hand,
        object=plan.body,
        contacts=tuple(contacts),
        requirements=stated,
        length_scale=plan.length_scale,
        obstacles=plan.obstacles,
        defaults={
            "dimension": DIMENSION,
            "radius": plan.radius,
            "epsilon": 0.5,
            "quality": quality_name(plan.quality),
        },
    )


def look_at(plan: Plan, assignment: Assignment) -> Look:
    """A first look at an assignment, the same at every call."""
    problem = problem_of(plan, assignment)
    nothing = np.zeros(0)
    try:
        search = GraspSearch(problem, problem.largest_dimension, plan.seed, ROOM)
    except GraspAtlasError as error:
        return Look(LookEnd.SINGULAR, -np.inf, nothing, np.zeros((0, 0)), str(error))
    nq = problem.hand.model.hand_q_size
    X = search.attempts_at(assignment.postures, assignment.points)
    if not len(X):
        X = search.attempts(TRIES)
    if not len(X):
        return Look(LookEnd.OUT_OF_REACH, -np.inf, nothing, np.zeros((0, nq)))
    objective = Objective(problem, search.system, plan.quality, plan.requirements, FIRST_STEP)
    nearest = X[np.argsort(objective.missed(X), kind="stable")[:CLIMBS]]
    ends = objective.climbs(nearest, STEPS)
    there = ends.x[[status != "not met" for status in ends.status]]
    there = there[objective.meets(there)]
    if not len(there):
        missed, lack = _missed(plan, objective, ends.x), _lacking(plan, objective.grasps(ends.x))
        return Look(LookEnd.MISSED, -np.inf, nothing, X[:, :nq], missed, lack)
    values = objective.values(there)
    postures = np.vstack([X[:, :nq], there[:, :nq]])
    for i in np.argsort(-values, kind="stable"):
        if search.is_regular(there[i]):
            return Look(LookEnd.MET, float(values[i]), there[i], postures)
    return Look(LookEnd.SINGULAR, -np.inf, nothing, postures, "its grasps are singular")


def _missed(plan: Plan, objective: Objective, X: Array) -> str:
    """The requirement that fewest grasps meet."""
    grasps = objective.grasps(X)
    shares = [(float(asked(each, grasps).mean()), requirement_name(each)) for each in plan.requirements]
    return min(shares)[1] if shares else ""


def _lacking(plan: Plan, grasps: Grasps) -> str:
    """What the grasp lacks that comes nearest to meeting the requirements."""
    chosen = nearest(plan.requirements, grasps, np.zeros(len(grasps)))
    one = Grasps(grasps.problem, grasps.x[chosen], grasps.system)
    return "; ".join(map(str, rejections(plan.requirements, one)))


def atlas_of(plan: Plan, assignment: Assignment, look: Look, max_seconds: float | None) -> Result:
    """The atlas of an assignment through the best grasp of a first look, and the best grasp of it.

    Args:
        plan: The plan.
        assignment: The assignment.
        look: A look that met the requirements.
        max_seconds: Time after which the atlas and the climbs are cut short.
    """
    problem, x = pinned(problem_of(plan, assignment), look.x)
    problem = replace(problem, motions=_motions(problem, look.postures)).at(x)
    return optimize(
        problem,
        dimension=min(DIMENSION, problem.full_dimension),
        quality=plan.quality,
        require=plan.requirements,
        refine="feasible",
        max_seconds=max_seconds,
        max_charts=CHARTS,
        progress=False,
    )


def _motions(problem: Problem, postures: Array) -> HandMotions:
    """The hand motions of postures (n, nq), the joints in the order of the hand."""
    joints: Sequence[str] = problem.hand.joints
    columns = problem.hand.joint_columns(postures)
    samples = np.column_stack([columns[name] for name in joints])
    return HandMotions.from_samples(samples if len(samples) > 1 else np.repeat(samples, 2, axis=0), joints)
