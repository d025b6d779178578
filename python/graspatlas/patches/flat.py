"""Fixed points and planes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from graspatlas import _core
from graspatlas.errors import unknown_name
from graspatlas.patches.base import (
    EVERYWHERE,
    Interval,
    Patch,
    Vector3,
    checked_interval,
    checked_vector,
    placement,
)

__all__ = ["Plane", "Point"]


@dataclass(frozen=True)
class Point(Patch):
    """A fixed point with a fixed outward normal: no parameter.

    Attributes:
        position: The point [m].
        normal: Outward normal; it is normalised.
    """

    position: Vector3
    normal: Vector3
    kind: ClassVar[str] = "point"

    def __post_init__(self) -> None:
        object.__setattr__(self, "position", checked_vector(self.position, "position"))
        object.__setattr__(self, "normal", checked_vector(self.normal, "normal", unit=True))

    def interval(self, parameter: str) -> Interval | None:
        """A point has no parameter."""
        raise unknown_name("parameter", parameter, self.parameters, "one of a point's")

    def locate(self, point: ArrayLike) -> tuple[float, float]:
        """(0, 0)."""
        return (0.0, 0.0)

    def core(self) -> _core.Patch:
        """A plane, of which only the origin is used."""
        return _core.PlanePatch(placement(self.position, self.normal, (1.0, 0.0, 0.0)))


@dataclass(frozen=True)
class Plane(Patch):
    """A flat patch: o(u, v) = origin + u e_u + v e_v.

    Attributes:
        origin: Its origin [m].
        normal: Outward normal; it is normalised.
        u_axis: e_u, made normal to ``normal``; e_v = e_u x normal.
        u_interval, v_interval: Intervals of the parameters [m].
    """

    origin: Vector3
    normal: Vector3
    u_axis: Vector3 = (1.0, 0.0, 0.0)
    u_interval: Interval = EVERYWHERE
    v_interval: Interval = EVERYWHERE
    kind: ClassVar[str] = "plane"
    parameters: ClassVar[tuple[str, ...]] = ("u", "v")

    def __post_init__(self) -> None:
        object.__setattr__(self, "origin", checked_vector(self.origin, "origin"))
        object.__setattr__(self, "normal", checked_vector(self.normal, "normal", unit=True))
        object.__setattr__(self, "u_axis", checked_vector(self.u_axis, "u_axis", unit=True))
        object.__setattr__(self, "u_interval", checked_interval(self.u_interval, "u_interval"))
        object.__setattr__(self, "v_interval", checked_interval(self.v_interval, "v_interval"))

    def interval(self, parameter: str) -> Interval | None:
        """Interval of u or v [m]."""
        return self.u_interval if parameter == "u" else self.v_interval

    def locate(self, point: ArrayLike) -> tuple[float, float]:
        """Foot of the perpendicular from a point."""
        T = placement(self.origin, self.normal, self.u_axis)
        local = T[:3, :3].T @ (np.asarray(point, float) - T[:3, 3])
        return (float(local[0]), float(local[2]))

    def core(self) -> _core.Patch:
        """The compiled plane."""
        return _core.PlanePatch(placement(self.origin, self.normal, self.u_axis))
