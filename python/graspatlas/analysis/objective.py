"""What a climb maximises: an index over the grasps of a system that meet the requirements."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from graspatlas import _core
from graspatlas.grasps.grasps import Grasps
from graspatlas.problem.problem import Problem
from graspatlas.quality.batched import Quality
from graspatlas.quality.evaluation import evaluate
from graspatlas.quality.measures import index_measure
from graspatlas.requirements.base import RequirementLike, requirement_measures
from graspatlas.requirements.screening import screen
from graspatlas.result.grasp_atlas import GraspAtlas
from graspatlas.support.arrays import Array, BoolArray

__all__ = ["Ends", "Objective"]

#: How far a grasp may be outside its bounds [units of the tangent space].
BOUND_TOLERANCE = 1e-9


@dataclass(frozen=True, eq=False)
class Ends:
    """Where climbs ended in the compiled core.

    Attributes:
        x: The grasps [n, configuration_size].
        value: The index there [n]; NaN where the requirements were never met.
        missed: By how much the requirement that is missed most is, in about units of the tangent space [n]; 0 where
            all are met.
        kkt: Largest residual of the conditions of Karush, Kuhn and Tucker [n]: of the slope of the index's logarithm
            that no bound or requirement holds back, of what slack these have that hold, of what is missed.
        evaluations: Grasps that were looked at [n].
        status: ``converged``, ``stalled``, ``given up`` or ``not met`` [n].
        values: The index where the requirements were first met and after each step from there.
    """

    x: Array
    value: Array
    missed: Array
    kkt: Array
    evaluations: Array
    status: list[str]
    values: list[Array]


@dataclass(frozen=True)
class Objective:
    """What is maximised: the index over the grasps of a system that meet the requirements.

    Attributes:
        problem: The problem.
        system: Its system.
        quality: The index.
        requirements: What grasps must meet.
        radius: Largest entry of the first step of a climb [units of the tangent space].
        threads: Threads on which climbs run; all cores by default.
    """

    problem: Problem
    system: _core.GraspSystem
    quality: Quality
    requirements: tuple[RequirementLike, ...]
    radius: float
    threads: int | None = None

    @classmethod
    def of(cls, result: GraspAtlas, all_motions: bool) -> Objective:
        """That of a result: over its relevant grasps, or over all of F."""
        system = result.problem.system(result.problem.largest_dimension if all_motions else result.dimension)
        return cls(result.problem, system, result.quality, result.requirements, result.atlas.radius)

    def grasps(self, X: ArrayLike) -> Grasps:
        """Configurations as grasps of the system."""
        return Grasps(self.problem, X, self.system)

    def meets(self, X: Array) -> BoolArray:
        """Whether grasps meet bounds and requirements [n]."""
        inside = np.array([self.system.slack(x).min(initial=0.0) >= -BOUND_TOLERANCE for x in X], bool)
        flags = np.zeros(len(X), bool)
        if inside.any():
            flags[inside] = screen(self.requirements, self.grasps(X[inside]))[0]
        return flags

    def values(self, X: Array) -> Array:
        """The index at grasps [n]."""
        return evaluate(self.quality, self.grasps(X)) if len(X) else np.zeros(0)

    def missed(self, X: Array) -> Array:
        """By how much each grasp misses the requirement that it misses most [n]; see :class:`Ends`."""
        measures = requirement_measures(self.requirements, self.problem, self.system)
        return np.asarray(_core.missed(self.system, X, measures))

    def climbs(self, X: Array, max_steps: int, max_seconds: float | None = None, radius: float | None = None) -> Ends:
        """Climbs from grasps on the manifold, many at a time.

        Args:
            X: The grasps [n, configuration_size].
            max_steps: Steps after which a climb is given up.
            max_seconds: Time after which all are; none by default.
            radius: Largest entry of the first step [units of the tangent space]; that of a chart by default.
        """
        index = index_measure(self.quality, self.problem, self.system, X)
        measures = requirement_measures(self.requirements, self.problem, self.system)
        trust_radius = self.radius if radius is None else radius
        return Ends(**_core.climbs(self.system, X, index, measures, trust_radius, max_steps, max_seconds, self.threads))
