"""The requirement that an arm can bring the hand to where the grasp has it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from graspatlas import _core
from graspatlas.errors import GraspAtlasError
from graspatlas.grasps.grasps import Grasps
from graspatlas.problem.problem import Problem
from graspatlas.problem.validation import check_arm
from graspatlas.requirements.base import Requirement, tested
from graspatlas.support.arrays import BoolArray

__all__ = ["Reachable"]


@dataclass(frozen=True)
class Reachable(Requirement):
    """The problem's arm brings the palm to the grasp within its joint limits, and hits nothing on the spot.

    A grasp meets it when a posture of the arm was found, see :meth:`graspatlas.Grasps.reach`. Where none was found that
    is no proof that there is none. The way of the arm to the posture is not looked at.

    Attributes:
        clearance: Distance that the arm's links must keep from the hand, the object and obstacles [m]; each other they
            must only not touch.
    """

    clearance: float = 0.0
    name: ClassVar[str] = "reachable"
    cost: ClassVar[int] = 3
    needs_arm: ClassVar[bool] = True

    def __post_init__(self) -> None:
        self._check((), ("clearance",))
        if self.clearance < 0.0:
            raise GraspAtlasError(f"clearance of requirement {self.name} must not be negative, got {self.clearance}")

    def met(self, grasps: Grasps) -> BoolArray:
        """Whether a posture of the arm was found for each grasp (n,).

        Raises:
            GraspAtlasError: If the problem has no arm, or something has no collision shape.
        """
        check_arm(grasps.problem.name, grasps.problem.arm, (self,))
        return grasps.reach(self.clearance).found

    def measures(self, problem: Problem, system: _core.GraspSystem) -> list[_core.Measure]:
        """Where it is met: it has no slope, so that climbs stop before they leave it."""
        return tested(self, problem, system)
