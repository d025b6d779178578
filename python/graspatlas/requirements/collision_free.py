"""The requirement that hand, object and obstacles do not collide."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from graspatlas import _core
from graspatlas.collision.checker import CollisionChecker, collision_checker
from graspatlas.collision.clash import Clash
from graspatlas.grasps.grasps import Grasps
from graspatlas.problem.problem import Problem
from graspatlas.requirements.base import Requirement, Slacks
from graspatlas.support.arrays import BoolArray

__all__ = ["CollisionFree"]

#: How many pairs of shapes an optimiser watches; all are checked before it takes a step.
NEAREST_PAIRS = 12
#: What optimisers keep beyond the clearance: distances of touching shapes have no slope [m].
CLOSEST = 1e-5


@dataclass(frozen=True)
class CollisionFree(Requirement):
    """The hand hits neither itself nor the object nor an obstacle, fingertips on the object excepted; by coal.

    Attributes:
        touch_depth: Depth to which a link with a contact may sink into the object, since shapes are approximations [m].
        clearance: Distance that all other pairs of shapes must keep [m].
    """

    touch_depth: float = 0.002
    clearance: float = 0.0
    name: ClassVar[str] = "collision_free"
    cost: ClassVar[int] = 2

    def __post_init__(self) -> None:
        self._check((), ("touch_depth", "clearance"))

    def met(self, grasps: Grasps) -> BoolArray:
        """Whether each grasp meets the requirement (n,)."""
        return self._checker(grasps.problem).free(grasps.x)

    def measures(self, problem: Problem, system: _core.GraspSystem) -> list[_core.Measure]:
        """Distances of hand, object and obstacles; see :meth:`Requirement.measures`."""
        return [_core.distances_measure(self._checker(problem).batch)]

    def slacks_near(self, grasp: Grasps) -> Slacks:
        """Distances of the nearest pairs of shapes, less those asked for, in units of the problem's length scale."""
        checker = self._checker(grasp.problem)
        pairs = np.argsort(checker.clearances(grasp.x)[0])[:NEAREST_PAIRS]
        return lambda grasps: (checker.clearances(grasps.x, pairs) - CLOSEST) / grasps.problem.length_scale

    def lack(self, grasp: Grasps) -> str:
        """Which bodies collide, and how deep; see :meth:`Requirement.lack`."""
        clash = self.clash(grasp)
        return clash.text if clash else ""

    def clash(self, grasp: Grasps) -> Clash | None:
        """The two shapes that miss their distance by most; see :meth:`Requirement.clash`."""
        return self._checker(grasp.problem).worst(grasp.x[0])

    def _checker(self, problem: Problem) -> CollisionChecker:
        return collision_checker(problem, self.touch_depth, self.clearance)
