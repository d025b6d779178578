"""What asks grasps whether they meet a requirement: the base of the named ones, and any function of a grasp.

A function returns True where a grasp will do, False where not, and nothing else; one that takes a whole batch of
:class:`~graspatlas.grasps.Grasps` and returns an array (n,) of booleans is marked by :func:`graspatlas.batched`.
Neither can write to the arrays that it gets.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from graspatlas import _core
from graspatlas.collision.clash import Clash
from graspatlas.errors import GraspAtlasError
from graspatlas.grasps.callables import called_flags
from graspatlas.grasps.grasp import Grasp
from graspatlas.grasps.grasps import Grasps
from graspatlas.problem.problem import Problem
from graspatlas.problem.requirement import StatedRequirement
from graspatlas.quality.batched import Quality, quality_name
from graspatlas.support.arrays import Array, BoolArray
from graspatlas.support.validation import shown

__all__ = [
    "Requirement",
    "RequirementLike",
    "Slacks",
    "asked",
    "requirement_measures",
    "requirement_name",
    "users_functions",
]

Slacks = Callable[[Grasps], Array]


@dataclass(frozen=True)
class Requirement(StatedRequirement):
    """Base of the requirements that have a name: states itself as plain data, and tells whether grasps meet it.

    Attributes:
        cost: The cheaper ones are checked first.
    """

    def met(self, grasps: Grasps) -> BoolArray:
        """Whether each grasp meets the requirement (n,)."""
        raise NotImplementedError

    def slacks_near(self, grasp: Grasps) -> Slacks | None:
        """By how much the requirement is met near one grasp, for optimisers; None where this is not applicable.

        Args:
            grasp: A batch of one grasp.

        Returns:
            A function of a batch of n grasps that returns (n, c) numbers of about the size of a tangent coordinate,
            none negative where the requirement is met, as smooth as there are. What cannot matter nearby may be left
            out.
        """
        return None

    def measures(self, problem: Problem, system: _core.GraspSystem) -> list[_core.Measure]:
        """What a climb in the compiled core follows: the slacks, and whether the requirement is met.

        Args:
            problem: The problem.
            system: Its system, of the grasps that are climbed on.
        """

        def near(x: Array) -> Callable[[Array], Array]:
            slacks = self.slacks_near(Grasps(problem, x, system))
            if slacks is None:
                return lambda X: np.empty((len(X), 0))
            return lambda X: slacks(Grasps(problem, X, system))

        return [_core.slacks_measure(near), *tested(self, problem, system)]

    def shortfalls(self, grasps: Grasps) -> Array:
        """What each grasp lacks of the requirement (n,), in the measure that climbs follow; 0 where it is met.

        It is of about the size of a tangent coordinate, and infinite where it cannot be measured.
        """
        return np.asarray(_core.missed(grasps.system, grasps.x, self.measures(grasps.problem, grasps.system)))

    def lack(self, grasp: Grasps) -> str:
        """What a grasp lacks of the requirement that rejects it, in words and figures; nothing where none are known.

        Args:
            grasp: A batch of one grasp.
        """
        return ""

    def clash(self, grasp: Grasps) -> Clash | None:
        """The two shapes that collide in a grasp, of a requirement that is about them.

        Args:
            grasp: A batch of one grasp, which the requirement rejects.
        """
        return None


def tested(requirement: RequirementLike, problem: Problem, system: _core.GraspSystem) -> list[_core.Measure]:
    """What a climb may know of a requirement that has no slacks: where it is met."""
    return [_core.test_measure(lambda X: asked(requirement, Grasps(problem, X, system)))]


#: What may be required of grasps: a named requirement, or a function that is true where a grasp meets it, of one grasp
#: or of a batch of grasps that :func:`graspatlas.batched` marks.
RequirementLike = StatedRequirement | Callable[[Grasp], bool | np.bool_] | Callable[[Grasps], ArrayLike]


def requirement_name(requirement: RequirementLike | str) -> str:
    """The requirement as text; :func:`parse_requirement` reads those of the named ones."""
    if isinstance(requirement, StatedRequirement | str):
        return str(requirement)
    return getattr(requirement, "__name__", type(requirement).__name__)


def users_functions(quality: Quality, requirements: Sequence[RequirementLike]) -> dict[str, object]:
    """What a user may have written of an index and requirements, by what messages call it."""
    functions: dict[str, object] = {f"the index {quality_name(quality)}": quality}
    functions.update({f"the requirement {requirement_name(each)}": each for each in requirements})
    return functions


def asked(requirement: RequirementLike, grasps: Grasps) -> BoolArray:
    """Whether each grasp meets a requirement (n,).

    Raises:
        GraspAtlasError: If a function raises or returns anything but True and False, see
            :mod:`graspatlas.grasps.callables`; or if a requirement is stated that no class can check.
    """
    if isinstance(requirement, Requirement):
        return requirement.met(grasps)
    if isinstance(requirement, StatedRequirement):
        raise GraspAtlasError(f"requirement {shown(str(requirement))} cannot be checked; derive it from Requirement")
    return called_flags(requirement, requirement_name(requirement), grasps)


def requirement_measures(
    requirements: Sequence[RequirementLike], problem: Problem, system: _core.GraspSystem
) -> list[_core.Measure]:
    """What climbs in the compiled core follow to meet requirements.

    Args:
        requirements: The requirements.
        problem: The problem.
        system: Its system, of the grasps that are climbed on.
    """
    measures: list[_core.Measure] = []
    for requirement in requirements:
        if isinstance(requirement, Requirement):
            measures += requirement.measures(problem, system)
        else:
            measures += tested(requirement, problem, system)
    return measures
