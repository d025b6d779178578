"""Requirements that a grasp must meet before its quality counts: force closure, no collision, distance from limits.

A requirement is one of the classes below, or any function of a grasp that returns True where it will do, False where
not, and nothing else; one that takes a whole batch of :class:`~graspatlas.grasps.Grasps` and returns an array [n] of
booleans is marked by :func:`graspatlas.batched`. Neither can write to the arrays that it gets.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, astuple, dataclass, fields
from functools import lru_cache
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from graspatlas import _core
from graspatlas.errors import GraspAtlasError, unknown_name
from graspatlas.grasps.callables import called_flags
from graspatlas.grasps.grasps import Grasps
from graspatlas.requirements.collision import CollisionChecker
from graspatlas.support.validation import checked_instance, checked_table, shown

if TYPE_CHECKING:
    from graspatlas.problem.problem import Problem

__all__ = [
    "REQUIREMENTS",
    "CollisionFree",
    "ForceClosure",
    "JointMargin",
    "Require",
    "Requirement",
    "check_requirements",
    "parse_requirement",
    "requirement_from_dict",
    "requirement_name",
    "screen",
]

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
Slacks = Callable[[Grasps], Array]

#: How many pairs of shapes an optimiser watches; all are checked before it takes a step.
NEAREST_PAIRS = 12
#: What optimisers keep beyond the clearance: distances of touching shapes have no slope [m].
CLOSEST = 1e-5

#: Values of a requirement are at most this.
LARGEST = 1e9


@dataclass(frozen=True)
class Requirement:
    """Base of the requirements that have a name.

    Attributes:
        cost: The cheaper ones are asked first.
    """

    name: ClassVar[str] = ""
    cost: ClassVar[int] = 0

    def met(self, grasps: Grasps) -> Flags:
        """Whether each grasp meets the requirement [n]."""
        raise NotImplementedError

    def slacks_near(self, grasp: Grasps) -> Slacks | None:
        """By how much the requirement is met round one grasp, for optimisers; None where that has no sense.

        Args:
            grasp: A batch of one grasp.

        Returns:
            A function of a batch [n] that returns [n, c] numbers of about the size of a tangent coordinate, none
            negative where the requirement is met, as smooth as there are. What cannot matter nearby may be left out.
        """
        return None

    def __str__(self) -> str:
        return ":".join([self.name, *(f"{value:g}" for value in astuple(self))])

    def to_dict(self) -> dict[str, dict[str, float]]:
        """The requirement as plain data: its values under its name."""
        return {self.name: asdict(self)}

    def _check(self, positive: Sequence[str], finite: Sequence[str] = ()) -> None:
        for attribute in (*positive, *finite):
            value = getattr(self, attribute)
            low = 0.0 if attribute in positive else -LARGEST
            if isinstance(value, bool) or not isinstance(value, int | float) or not low < value <= LARGEST:
                kind = "positive" if attribute in positive else "finite"
                raise GraspAtlasError(f"{attribute} of requirement {self.name} must be {kind}, got {shown(value)}")


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

    def met(self, grasps: Grasps) -> Flags:
        """Whether each grasp meets the requirement [n]."""
        lower, upper = grasps.problem.hand.joint_limits
        return np.asarray(((grasps.q - lower >= self.distance) & (upper - grasps.q >= self.distance)).all(axis=1))

    def slacks_near(self, grasp: Grasps) -> Slacks:
        """Distance of each limited joint from its limits, less the distance asked for [rad or m]."""
        lower, upper = grasp.problem.hand.joint_limits
        low, high = np.isfinite(lower), np.isfinite(upper)

        def slacks(grasps: Grasps) -> Array:
            q = grasps.q
            return np.hstack([q[:, low] - lower[low], upper[high] - q[:, high]]) - self.distance

        return slacks


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

    def met(self, grasps: Grasps) -> Flags:
        """Whether each grasp meets the requirement [n]."""
        margins = np.asarray(_core.force_closure_margins(grasps.system, grasps.x, self.friction, self.torsional))
        return np.asarray((margins > 0.0) & (margins >= self.margin))

    def slacks_near(self, grasp: Grasps) -> Slacks:
        """The force-closure margin, negative where internal forces leave the cones, less the margin asked for."""

        def slacks(grasps: Grasps) -> Array:
            signed = np.asarray(_core.force_closure_slacks(grasps.system, grasps.x, self.friction, self.torsional))
            return np.maximum(signed, -1.0)[:, None] - self.margin

        return slacks


@dataclass(frozen=True)
class CollisionFree(Requirement):
    """The hand hits neither itself nor the object, the touching fingertips excepted; by coal.

    Attributes:
        touch_depth: Depth to which a touching link may sink into the object, since shapes are approximations [m].
        clearance: Distance that all other pairs of shapes must keep [m].
    """

    touch_depth: float = 0.002
    clearance: float = 0.0
    name: ClassVar[str] = "collision_free"
    cost: ClassVar[int] = 2

    def __post_init__(self) -> None:
        self._check((), ("touch_depth", "clearance"))

    def met(self, grasps: Grasps) -> Flags:
        """Whether each grasp meets the requirement [n]."""
        return self._checker(grasps.problem).free(grasps.x)

    def slacks_near(self, grasp: Grasps) -> Slacks:
        """Distances of the nearest pairs of shapes, less those asked for, in units of the problem's length scale."""
        checker = self._checker(grasp.problem)
        pairs = np.argsort(checker.clearances(grasp.x)[0])[:NEAREST_PAIRS]
        return lambda grasps: (checker.clearances(grasps.x, pairs) - CLOSEST) / grasps.problem.length_scale

    def _checker(self, problem: Problem) -> CollisionChecker:
        return _checker(problem, self.touch_depth, self.clearance)


@lru_cache(maxsize=4)
def _checker(problem: Problem, touch_depth: float, clearance: float) -> CollisionChecker:
    """Checkers of the last problems: reading the shapes takes longer than to check a thousand grasps."""
    return CollisionChecker(problem, touch_depth, clearance)


Require = Requirement | Callable[[Any], Any]
#: Requirements by name.
REQUIREMENTS: dict[str, type[Requirement]] = {r.name: r for r in (JointMargin, ForceClosure, CollisionFree)}


def requirement_name(requirement: Require) -> str:
    """The requirement as text; :func:`parse_requirement` reads those of the named ones."""
    if isinstance(requirement, Requirement):
        return str(requirement)
    return getattr(requirement, "__name__", type(requirement).__name__)


def parse_requirement(text: str) -> Requirement:
    """The requirement that a text such as ``force_closure:0.5:0.02`` names.

    Args:
        text: A name, then values of its attributes in their order, separated by colons.

    Raises:
        GraspAtlasError: If there is no such requirement, or a value is no number.
    """
    name, *values = text.split(":")
    if name not in REQUIREMENTS:
        raise unknown_name("requirement", name, REQUIREMENTS)
    attributes = [field.name for field in fields(REQUIREMENTS[name])]
    if len(values) > len(attributes):
        raise GraspAtlasError(f"requirement {name} has the values {', '.join(attributes)}; got {shown(text)}")
    try:
        return REQUIREMENTS[name](*map(float, values))
    except ValueError as error:
        if isinstance(error, GraspAtlasError):
            raise
        raise GraspAtlasError(
            f"requirement {shown(text)} holds a value that is no number; it is {name}:{':'.join(attributes)}"
        ) from None


def requirement_from_dict(data: Mapping[str, Any]) -> Requirement:
    """The requirement that :meth:`Requirement.to_dict` described.

    Args:
        data: Its values by attribute, or nothing, under its name: ``{"force_closure": {"friction": 0.5}}``.

    Raises:
        GraspAtlasError: If there is no such requirement or attribute, or a value is wrong.
    """
    if not isinstance(data, Mapping) or len(data) != 1:
        raise GraspAtlasError(f"a requirement is a table of one name and its values, got {data!r}")
    ((name, values),) = data.items()
    if name not in REQUIREMENTS:
        raise unknown_name("requirement", name, REQUIREMENTS)
    attributes = [field.name for field in fields(REQUIREMENTS[name])]
    return REQUIREMENTS[name](**checked_table(values or {}, f"requirement {name}", (), attributes))


def check_requirements(requirements: Sequence[Require]) -> None:
    """Make sure that requirements are a list or tuple of named ones and functions.

    Raises:
        GraspAtlasError: If they are not.
    """
    checked_instance(requirements, (list, tuple), "require")
    for requirement in requirements:
        if not isinstance(requirement, Requirement) and not callable(requirement):
            raise GraspAtlasError(
                f"a requirement is one of {', '.join(REQUIREMENTS)} or a function of a grasp, not "
                f"{shown(requirement)}; requirements.parse_requirement reads text"
            )


def screen(requirements: Sequence[Require], grasps: Grasps) -> tuple[Flags, dict[str, int]]:
    """Which grasps meet all requirements, the cheapest asked first and only of those that are left.

    Args:
        requirements: The requirements.
        grasps: The grasps.

    Returns:
        Flags [n], and how many grasps each requirement rejected.

    Raises:
        GraspAtlasError: If a function raises or returns anything but True and False; see
            :mod:`graspatlas.grasps.callables`.
    """
    check_requirements(requirements)
    left = np.arange(len(grasps))
    rejected: dict[str, int] = {}
    for requirement in sorted(requirements, key=lambda r: r.cost if isinstance(r, Requirement) else 1):
        met = _met(requirement, Grasps(grasps.problem, grasps.x[left], grasps.system, grasps.charts[left]))
        rejected[requirement_name(requirement)] = int((~met).sum())
        left = left[met]
    flags = np.zeros(len(grasps), bool)
    flags[left] = True
    return flags, rejected


def _met(requirement: Require, grasps: Grasps) -> Flags:
    if len(grasps) == 0:
        return np.zeros(0, bool)
    if isinstance(requirement, Requirement):
        return requirement.met(grasps)
    return called_flags(requirement, requirement_name(requirement), grasps)
