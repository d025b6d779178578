"""The requirement that a grasp withstands a force from whatever side."""

from __future__ import annotations

from dataclasses import astuple, dataclass, fields
from typing import ClassVar

import numpy as np

from graspatlas import _core
from graspatlas.errors import GraspAtlasError
from graspatlas.grasps.grasps import Grasps
from graspatlas.problem.problem import Problem
from graspatlas.quality.force_closure import force_closure_slack
from graspatlas.quality.holding_force import GAP, holding_force, holding_limits
from graspatlas.requirements.base import Requirement, Slacks
from graspatlas.support.arrays import Array, BoolArray

__all__ = ["HoldingForce"]

#: Relative difference from the largest force up to which grasps are screened, before those in doubt are looked at
#: again; they are never thought too strong.
SCREENING_GAP = 0.01


@dataclass(frozen=True)
class HoldingForce(Requirement):
    """The grasp withstands a force of so many newtons at the object's centre of mass, from whatever side.

    Attributes:
        at_least: Smallest holding force [N]; see :func:`graspatlas.quality.holding_force`. A body of m kilogrammes is
            held in every attitude by 9.81 m.
        friction: Coefficient of friction mu at every contact.
        normal_force: The most that the normal forces may add up to [N]; 0 for 5 N a contact.
        torsional: Torsional friction [m] of soft fingers; 0 for hard ones.
        torque_length: Length that divides torques of disturbances [m]; 0 for forces alone.
    """

    at_least: float = 1.0
    friction: float = 0.5
    normal_force: float = 0.0
    torsional: float = 0.0
    torque_length: float = 0.0
    name: ClassVar[str] = "holding_force"
    cost: ClassVar[int] = 2

    def __post_init__(self) -> None:
        others = ("normal_force", "torsional", "torque_length")
        self._check(("at_least", "friction"), others)
        for attribute in others:
            if getattr(self, attribute) < 0.0:
                value = getattr(self, attribute)
                raise GraspAtlasError(f"{attribute} of requirement {self.name} must not be negative, got {value}")

    def __str__(self) -> str:
        values, defaults = list(astuple(self)), [item.default for item in fields(self)]
        while len(values) > 1 and values[-1] == defaults[len(values) - 1]:
            values.pop()
        return ":".join([self.name, *(f"{value:g}" for value in values)])

    def met(self, grasps: Grasps) -> BoolArray:
        """Whether each grasp meets the requirement (n,), one that exceeds it by less than 1e-5 of it perhaps not."""
        forces = self._forces(grasps, SCREENING_GAP)
        doubtful = (forces < self.at_least) & (forces >= (1.0 - 2.0 * SCREENING_GAP) * self.at_least)
        if doubtful.any():
            forces[doubtful] = self._forces(Grasps(grasps.problem, grasps.x[doubtful], grasps.system), GAP)
        return np.asarray(forces >= self.at_least)

    def measures(self, problem: Problem, system: _core.GraspSystem) -> list[_core.Measure]:
        """The force in each direction in which a grasp withstands least; see :meth:`Requirement.measures`."""
        limits = holding_limits(problem, *self._limits)
        return [_core.holding_measure(limits, self.at_least * (1.0 + GAP))]

    def slacks_near(self, grasp: Grasps) -> Slacks:
        """The holding force as a multiple of that asked for, less one; without closure less, by the closure's slack."""

        def slacks(grasps: Grasps) -> Array:
            forces = self._forces(grasps, GAP)
            values, open_ = forces / self.at_least - 1.0, forces == 0.0
            if open_.any():
                left = Grasps(grasps.problem, grasps.x[open_], grasps.system)
                values[open_] += np.clip(force_closure_slack(left, self.friction, self.torsional), -1.0, 0.0)
            return values[:, None]

        return slacks

    def lack(self, grasp: Grasps) -> str:
        """The force that it withstands and the one asked for; see :meth:`Requirement.lack`."""
        (force,) = self._forces(grasp, GAP)
        return f"withstands {force:.3g} N, {self.at_least:g} N is required"

    @property
    def _limits(self) -> tuple[float, float | None, float, float]:
        """Friction, normal force, torsional friction and length that divides torques, as the index takes them."""
        return self.friction, self.normal_force or None, self.torsional, self.torque_length

    def _forces(self, grasps: Grasps, gap: float) -> Array:
        return holding_force(grasps, *self._limits, gap=gap)
