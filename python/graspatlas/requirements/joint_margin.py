"""The requirement that joints stay away from their limits."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from graspatlas import _core
from graspatlas.grasps.grasps import Grasps
from graspatlas.problem.problem import Problem
from graspatlas.requirements.base import Requirement, Slacks
from graspatlas.support.arrays import Array, BoolArray

__all__ = ["JointMargin"]


@dataclass(frozen=True)
class JointMargin(Requirement):
    """Every joint stays this far from its limits.

    Attributes:
        distance: Smallest distance from a limit [rad or m].
    """

    distance: float = 0.05
    name: ClassVar[str] = "joint_margin"
    cost: ClassVar[int] = 0

    def __post_init__(self) -> None:
        self._check(("distance",))

    def met(self, grasps: Grasps) -> BoolArray:
        """Whether each grasp meets the requirement (n,)."""
        lower, upper = grasps.problem.hand.joint_limits
        return np.asarray(((grasps.q - lower >= self.distance) & (upper - grasps.q >= self.distance)).all(axis=1))

    def measures(self, problem: Problem, system: _core.GraspSystem) -> list[_core.Measure]:
        """Distances of the joints from their limits; see :meth:`Requirement.measures`."""
        return [_core.joint_margin_measure(self.distance)]

    def slacks_near(self, grasp: Grasps) -> Slacks:
        """Distance of each limited joint from its limits, less the distance asked for [rad or m]."""
        lower, upper = grasp.problem.hand.joint_limits
        low, high = np.isfinite(lower), np.isfinite(upper)

        def slacks(grasps: Grasps) -> Array:
            q = grasps.q
            return np.hstack([q[:, low] - lower[low], upper[high] - q[:, high]]) - self.distance

        return slacks

    def lack(self, grasp: Grasps) -> str:
        """The joint that is nearest to a limit; see :meth:`Requirement.lack`."""
        lower, upper = grasp.problem.hand.joint_limits
        gaps = {
            (joint, end): float(gap[joint.q_index])
            for end, gap in (("lower", grasp.q[0] - lower), ("upper", upper - grasp.q[0]))
            for joint in grasp.problem.hand.model.hand_joints
        }
        (joint, end), gap = min(gaps.items(), key=lambda item: item[1])
        unit = "m" if joint.prismatic else "rad"
        return f"{joint.name} is {gap:.3g} {unit} from its {end} limit, {self.distance:g} {unit} is required"
