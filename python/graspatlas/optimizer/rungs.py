"""One rung of a ladder: the relevant grasps of one dimension k, the best of them, and the hand motion that k frees."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TypedDict

import numpy as np

from graspatlas.atlas.status import Status
from graspatlas.errors import GraspAtlasError
from graspatlas.grasps.grasp import Grasp
from graspatlas.grasps.grasps import Grasps
from graspatlas.problem.problem import Problem
from graspatlas.result.refinement import PeakStatus
from graspatlas.result.result import Result
from graspatlas.support.arrays import Array

__all__ = ["FreedMotion", "Rung", "RungSummary", "Top", "freed_motion", "possible_dimensions"]

#: Joints that name a motion: those with the largest parts in it.
JOINTS = 3
#: A variance below this share of the largest is rounding.
NO_VARIANCE = 1e-12


@dataclass(frozen=True)
class FreedMotion:
    """A hand motion that a rung frees and the one below froze.

    Attributes:
        number: Its number; 1 is the motion of the largest variance.
        variance_share: Its share of the variance of all that may move; None where no postures are known.
        joints: Its parts in the joints that take part most, the largest first.
    """

    number: int
    variance_share: float | None
    joints: Mapping[str, float]

    def __str__(self) -> str:
        share = "" if self.variance_share is None else f" ({100.0 * self.variance_share:.2g} % of the variance)"
        return f"motion {self.number}{share}: " + ", ".join(f"{part:+.2f} {name}" for name, part in self.joints.items())


class MotionSummary(TypedDict):
    """A freed motion in plain data."""

    number: int
    variance_share: float | None
    joints: dict[str, float]


class RungSummary(TypedDict):
    """A rung in plain data; None where there is nothing."""

    dimension: int
    radius: float
    n_charts: int
    seconds: float
    status: str
    n_accepted: int
    best: float | None
    refined: float | None
    peak: str | None
    carried: bool
    motion: MotionSummary | None
    note: str


@dataclass(frozen=True, eq=False)
class Top:
    """Where the climbs of a rung ended highest.

    Attributes:
        x: The grasp [configuration_size].
        quality: The index there.
        status: Whether it is a maximum.
        carried: True when the climb began at the refined best of the rung below, or that is still the best.
    """

    x: Array
    quality: float
    status: PeakStatus
    carried: bool = False


@dataclass(frozen=True, eq=False)
class Rung:
    """The relevant grasps of one dimension.

    Attributes:
        result: What :func:`graspatlas.optimize` found there.
        seconds: Time that all took, the refinement included.
        top: The highest place that climbs reached; None where none was asked for, or no grasp meets the requirements.
        motion: The motion that this rung frees; None on the lowest rung, and without hand motions.
        note: What to know about it, in words; empty for most.
    """

    result: Result
    seconds: float
    top: Top | None
    motion: FreedMotion | None
    note: str = ""

    def __repr__(self) -> str:
        return (
            f"<Rung k = {self.dimension}: {self.result.atlas.n_charts} charts, best {self.best}, {self.result.status}>"
        )

    @property
    def dimension(self) -> int:
        """Dimension k of its relevant grasps."""
        return self.result.dimension

    @property
    def complete(self) -> bool:
        """False when the atlas was cut short."""
        return self.result.status is Status.COMPLETE

    @property
    def best(self) -> float | None:
        """Quality of the best chart; None where no chart meets the requirements."""
        return self.result.best.quality if self.result.accepted.any() else None

    @property
    def refined(self) -> float | None:
        """Quality of the refined best."""
        return None if self.top is None else self.top.quality

    @property
    def value(self) -> float | None:
        """The best that is known of this rung: refined, or else of the charts."""
        return self.best if self.top is None else self.top.quality

    @property
    def best_grasp(self) -> Grasp:
        """The grasp of that value.

        Raises:
            GraspAtlasError: If no grasp meets the requirements.
        """
        if self.top is None:
            return self.result.best
        one = Grasps(self.result.problem, self.top.x, self.result.system)[0]
        return replace(one, quality=self.top.quality)

    def summary(self) -> RungSummary:
        """The rung in plain data."""
        motion, top = self.motion, self.top
        return {
            "dimension": self.dimension,
            "radius": self.result.atlas.radius,
            "n_charts": self.result.atlas.n_charts,
            "seconds": self.seconds,
            "status": str(self.result.status),
            "n_accepted": int(self.result.accepted.sum()),
            "best": self.best,
            "refined": self.refined,
            "peak": None if top is None else str(top.status),
            "carried": top is not None and top.carried,
            "motion": None
            if motion is None
            else {"number": motion.number, "variance_share": motion.variance_share, "joints": dict(motion.joints)},
            "note": self.note,
        }


def possible_dimensions(problem: Problem) -> list[int]:
    """Dimensions k that a problem's hand motions allow, ascending.

    Args:
        problem: The problem.
    """
    possible = []
    for dimension in range(1, problem.largest_dimension + 1):
        try:
            problem.frozen_motions(dimension)
        except GraspAtlasError:
            continue
        possible.append(dimension)
    return possible


def freed_motion(problem: Problem, dimension: int) -> FreedMotion | None:
    """The motion that moves with k and is frozen with k - 1; None without hand motions.

    Args:
        problem: The problem.
        dimension: k.
    """
    if problem.motions is None:
        return None
    mechanism = problem.hand.mechanism
    motions = mechanism.constrained(problem.motions)
    number = len(motions.joints) - len(mechanism.mimics) - problem.frozen_motions(dimension)
    if number < 1:
        return None
    direction = motions.E[:, number - 1]
    largest = np.argsort(-np.abs(direction), kind="stable")[:JOINTS]
    variances = motions.variances
    variances = np.where(variances > NO_VARIANCE * variances.max(initial=0.0), variances, 0.0)
    share = float(variances[number - 1] / variances.sum()) if variances.any() else None
    return FreedMotion(number, share, {motions.joints[i]: float(direction[i]) for i in largest if direction[i]})
