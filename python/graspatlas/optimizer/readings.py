"""What is read at the charts of an atlas: the requirements, and the quality indices (Algorithm 1, line 14)."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from graspatlas import _core
from graspatlas.atlas.atlas import Atlas
from graspatlas.errors import GraspAtlasError
from graspatlas.grasps.callables import is_batched
from graspatlas.grasps.grasps import Grasps
from graspatlas.optimizer.options import Choices
from graspatlas.problem.problem import Problem
from graspatlas.problem.requirement import StatedRequirement
from graspatlas.problem.validation import check_arm
from graspatlas.quality.batched import Quality, quality_name
from graspatlas.quality.evaluation import evaluate
from graspatlas.requirements.base import RequirementLike
from graspatlas.requirements.screening import check_requirements, screen
from graspatlas.result.grasp_atlas import grasp_system
from graspatlas.result.result import Result
from graspatlas.support.arrays import Array
from graspatlas.support.validation import checked_instance, shown

__all__ = ["Reading", "check_atlas_of"]

#: Grasps of which the reading is timed: a few, and when that is soon done many [s].
_FEW, _MANY, _SOON = 4, 256, 0.01
#: Largest entry of |R(x)| of a chart of an atlas that is given; and how far its first may be from x1
#: [units of the tangent space].
_ON_MANIFOLD, _NEAR_X1 = 1e-6, 1.0


@dataclass(frozen=True)
class Reading:
    """What is read.

    Attributes:
        indices: The indices, each once; the first chooses the best grasp.
        requirements: What a grasp must meet to be the best or the worst.

    Raises:
        GraspAtlasError: If a requirement is neither a named one nor a function.
    """

    indices: Sequence[Quality]
    requirements: Sequence[RequirementLike]

    def __post_init__(self) -> None:
        check_requirements(self.requirements)

    def at(self, problem: Problem, atlas: Atlas) -> Result:
        """The result that is read off an atlas of a problem.

        Raises:
            GraspAtlasError: If an index or a requirement fails.
        """
        start = time.perf_counter()
        grasps = Grasps(problem, atlas.centers, grasp_system(atlas), np.arange(atlas.n_charts))
        accepted, rejected = screen(self.requirements, grasps)
        first, *others = self.indices
        qualities = evaluate(first, grasps)
        values = {quality_name(other): evaluate(other, grasps) for other in others}
        return Result(
            problem=problem,
            atlas=atlas,
            quality=first,
            qualities=qualities,
            quality_seconds=time.perf_counter() - start,
            requirements=tuple(self.requirements),
            accepted=accepted,
            rejected=rejected,
            others=values,
        )

    def try_out(self, problem: Problem, system: _core.GraspSystem, x: Array) -> None:
        """Ask your own functions about one grasp, so that those that fail do it before the work.

        Only functions of one grasp are asked: one that takes a batch may need more than one.

        Raises:
            GraspAtlasError: If one fails, or a requirement asks for an arm that the problem does not have.
        """
        check_arm(problem.name, problem.arm, [r for r in self.requirements if isinstance(r, StatedRequirement)])
        grasp = Grasps(problem, x, system, [0])
        for index in self.indices:
            if callable(index) and not is_batched(index):
                evaluate(index, grasp)
        for requirement in self.requirements:
            if not isinstance(requirement, StatedRequirement) and not is_batched(requirement):
                screen([requirement], grasp)

    def seconds_each(self, problem: Problem, system: _core.GraspSystem, x: Array) -> float:
        """About how long the reading of a chart takes at most [s]; measured at a grasp x, asked for everything."""

        def measured(count: int) -> float:
            grasps = Grasps(problem, np.repeat(x[None], count, axis=0), system, np.zeros(count, int))
            start = time.perf_counter()
            for requirement in self.requirements:
                screen([requirement], grasps)
            for index in self.indices:
                evaluate(index, grasps)
            return time.perf_counter() - start

        measured(1)  # reads what is only read once
        few = measured(_FEW)
        return few / _FEW if few > _SOON else measured(_MANY) / _MANY


def check_atlas_of(problem: Problem, options: Choices, atlas: Atlas) -> None:
    """Make sure that an atlas that is given covers relevant grasps of a problem, from its x1 on.

    Args:
        problem: The problem.
        options: Dimension, and radius and epsilon.
        atlas: What was given.

    Raises:
        GraspAtlasError: If it is not an atlas, has other options, or its charts are no grasps of the problem.
    """
    checked_instance(atlas, Atlas, "atlas", "the attribute atlas of results and errors")
    dimension = options["dimension"]
    system = problem.system(dimension)
    mine = (system.dimension, system.configuration_size, system.tangent_size)
    given = (atlas.dimension, atlas.centers.shape[1], atlas.bases.shape[2])
    if given != mine:
        raise GraspAtlasError(
            f"the atlas given has dimension {given[0]} and {given[1]} numbers a grasp; problem '{problem.name}' with "
            f"dimension {dimension} has {mine[0]} and {mine[1]}: give the atlas of the same call"
        )
    for name, value in (("radius", options["radius"]), ("epsilon", options["epsilon"])):
        if value != getattr(atlas, name):
            raise GraspAtlasError(
                f"the atlas given has {name} {getattr(atlas, name)}, and {shown(value)} was asked for: give "
                f"the atlas of the same call, or {name}=atlas.{name}"
            )
    off = max(float(np.abs(system.evaluate_residual(x)).max(initial=0.0)) for x in atlas.centers)
    frozen = float(np.abs(problem.frozen_residual(atlas.centers, dimension)).max(initial=0.0))
    away = float(np.linalg.norm(system.difference(problem.x1_array, atlas.centers[0])))
    if not (max(off, frozen) <= _ON_MANIFOLD and away <= _NEAR_X1):
        raise GraspAtlasError(
            f"the atlas given is one of another problem: a chart misses the equations of '{problem.name}' by "
            f"{max(off, frozen):.3g}, and the first is {away:.3g} from x1; leave it out"
        )
