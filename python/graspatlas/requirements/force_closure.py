"""The requirement that friction lets the contacts hold the object."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from graspatlas import _core
from graspatlas.errors import GraspAtlasError
from graspatlas.grasps.grasps import Grasps
from graspatlas.problem.problem import Problem
from graspatlas.requirements.base import Requirement, Slacks
from graspatlas.support.arrays import Array, BoolArray

__all__ = ["ForceClosure", "stated_friction"]


@dataclass(frozen=True)
class ForceClosure(Requirement):
    """Friction lets the contacts resist any push: internal forces exist strictly inside all friction cones.

    Attributes:
        friction: Coefficient of friction mu at every contact.
        margin: Smallest force-closure margin; see :func:`graspatlas.quality.force_closure_margin`. A margin of 0 asks
            for closure alone.
        torsional: Torsional friction [m] of soft fingers, which resist being turned about the normal by a torque of up
            to so much times the normal force; 0 for hard fingers. With it two contacts may close.
    """

    friction: float = 0.5
    margin: float = 0.0
    torsional: float = 0.0
    name: ClassVar[str] = "force_closure"
    cost: ClassVar[int] = 1

    def __post_init__(self) -> None:
        self._check(("friction",), ("margin", "torsional"))
        if self.torsional < 0.0:
            raise GraspAtlasError(f"torsional of requirement {self.name} must not be negative, got {self.torsional}")

    def __str__(self) -> str:
        return f"{self.name}:{self.friction:g}:{self.margin:g}" + (f":{self.torsional:g}" if self.torsional else "")

    def met(self, grasps: Grasps) -> BoolArray:
        """Whether each grasp meets the requirement (n,)."""
        margins = np.asarray(_core.force_closure_margins(grasps.system, grasps.x, self.friction, self.torsional))
        return np.asarray((margins > 0.0) & (margins >= self.margin))

    def measures(self, problem: Problem, system: _core.GraspSystem) -> list[_core.Measure]:
        """The margin with its sign; see :meth:`Requirement.measures`."""
        return [_core.closure_measure(self.friction, self.torsional, self.margin)]

    def slacks_near(self, grasp: Grasps) -> Slacks:
        """The force-closure margin, negative where internal forces leave the cones, less the margin asked for."""

        def slacks(grasps: Grasps) -> Array:
            return np.maximum(self._signed(grasps), -1.0)[:, None] - self.margin

        return slacks

    def lack(self, grasp: Grasps) -> str:
        """The margin and the one asked for; see :meth:`Requirement.lack`."""
        (signed,) = self._signed(grasp)
        if not np.isfinite(signed):
            return f"no internal forces press on the object, a margin of {self._asked} is required"
        closure = "margin" if signed > 0.0 else "no force closure, margin"
        return f"{closure} {signed:.3g}, {self._asked} is required"

    @property
    def _asked(self) -> str:
        return f"{self.margin:g}" if self.margin > 0.0 else "more than 0"

    def _signed(self, grasps: Grasps) -> Array:
        """The force-closure margin, negative where internal forces leave the cones (n,)."""
        return np.asarray(_core.force_closure_slacks(grasps.system, grasps.x, self.friction, self.torsional))


def stated_friction(requirements: Sequence[object]) -> tuple[float, float] | None:
    """Coefficient of friction and torsional friction [m] of the first force closure among requirements; None if none.

    Args:
        requirements: Such as those of a result.
    """
    for requirement in requirements:
        if isinstance(requirement, ForceClosure):
            return requirement.friction, requirement.torsional
    return None
