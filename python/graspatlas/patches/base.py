"""What all patches share: their interface, and checks of what they are made of."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from graspatlas import _core
from graspatlas.errors import GraspAtlasError
from graspatlas.support.arrays import Array
from graspatlas.support.validation import PlainTable, number, number_array

__all__ = ["AxialPatch", "FlippablePatch", "Patch"]

Vector3 = tuple[float, float, float]
Interval = tuple[float, float]
EVERYWHERE: Interval = (-np.inf, np.inf)
#: Lengths of a patch are smaller [m]: larger ones are mistakes, and their squares may overflow.
LARGEST = 1e9


def checked_vector(value: ArrayLike, what: str, *, unit: bool = False) -> Vector3:
    """Three finite numbers; normalised if a unit vector is asked for."""
    array = number_array(value, what)
    if array.shape != (3,) or not (np.abs(array) < LARGEST).all():
        raise GraspAtlasError(f"{what} must be three finite numbers below {LARGEST:g}, got {value!r}")
    if unit:
        length = float(np.linalg.norm(array))
        if length < 1e-9:
            raise GraspAtlasError(f"{what} must not be zero")
        if abs(length - 1.0) > 1e-12:  # a unit vector stays as it came, so that a stored patch is the same patch
            array = array / length
    return (float(array[0]), float(array[1]), float(array[2]))


def checked_interval(value: Sequence[float], what: str) -> Interval:
    """A lower bound and a larger upper one."""
    array = number_array(value, what)
    if array.shape != (2,) or not array[0] < array[1]:
        raise GraspAtlasError(f"{what} must be (lower, upper) with lower below upper, got {value!r}")
    if (np.isfinite(array) & (np.abs(array) >= LARGEST)).any():
        raise GraspAtlasError(f"{what} must have ends below {LARGEST:g}, or infinite ones, got {value!r}")
    return (float(array[0]), float(array[1]))


def checked_angles(value: Sequence[float], what: str) -> Interval:
    """An interval of angles [rad], a turn at most."""
    low, high = checked_interval(value, what)
    if not high - low <= 2.0 * np.pi:
        raise GraspAtlasError(f"{what} {value} is wider than a turn; None is the whole circle")
    return (low, high)


def checked_length(value: object, what: str) -> float:
    """A positive finite number."""
    length = number(value, what)
    if not 0.0 < length < LARGEST:
        raise GraspAtlasError(f"{what} must be positive and below {LARGEST:g}, got {value!r}")
    return length


def checked_pair(value: Sequence[float], what: str) -> tuple[float, float]:
    """Two finite numbers."""
    array = number_array(value, what)
    if array.shape != (2,) or not (np.abs(array) < LARGEST).all():
        raise GraspAtlasError(f"{what} must be two finite numbers below {LARGEST:g}, got {value!r}")
    return (float(array[0]), float(array[1]))


def placement(origin: Vector3, y_axis: Vector3, x_hint: Vector3) -> Array:
    """Frame (4, 4) at an origin with its y axis given and its x axis as near as can be to a hint."""
    y = np.array(y_axis)
    x = np.array(x_hint) - np.dot(x_hint, y) * y
    if np.linalg.norm(x) < 1e-6:
        x = np.eye(3)[np.argmin(np.abs(y))]
        x = x - np.dot(x, y) * y
    x = x / np.linalg.norm(x)
    T = np.eye(4)
    T[:3, 0], T[:3, 1], T[:3, 2], T[:3, 3] = x, y, np.cross(x, y), origin
    return T


@dataclass(frozen=True)
class Patch:
    """Base of all patches.

    Attributes:
        parameters: Names of the patch's parameters, some of ``("u", "v")``.
    """

    kind: ClassVar[str] = ""
    parameters: ClassVar[tuple[str, ...]] = ()

    def interval(self, parameter: str) -> Interval | None:
        """Interval of a parameter; None when it is an angle that goes all the way round."""
        raise NotImplementedError

    def locate(self, point: ArrayLike) -> tuple[float, float]:
        """Parameters (u, v) of the patch's point nearest to a point of the body's frame (3,)."""
        raise NotImplementedError

    def core(self) -> _core.Patch:
        """The compiled patch."""
        raise NotImplementedError

    def point(self, u: float = 0.0, v: float = 0.0) -> Array:
        """Point o(u, v) in the body's frame (3,)."""
        return np.asarray(self.core().evaluate(u, v)["o"])

    def normal_at(self, u: float = 0.0, v: float = 0.0) -> Array:
        """Outward unit normal m(u, v) in the body's frame (3,)."""
        return np.asarray(self.core().evaluate(u, v)["m"])

    def to_dict(self) -> PlainTable:
        """The patch as plain data, with its ``type``."""
        return {"type": self.kind, **asdict(self)}


@dataclass(frozen=True)
class FlippablePatch(Patch):
    """A patch whose outward normal may point to either side.

    Attributes:
        flipped: True for the other side: the inside of a cup, or the normal -(o_u x o_v) of a spline.
    """

    flipped: bool = field(default=False, kw_only=True)

    def __post_init__(self) -> None:
        if not isinstance(self.flipped, bool):
            raise GraspAtlasError(f"flipped must be True or False, got {self.flipped!r}")

    def surface(self) -> _core.Patch:
        """The compiled patch before it is flipped."""
        raise NotImplementedError

    def core(self) -> _core.Patch:
        """The compiled patch."""
        return _core.FlippedPatch(self.surface()) if self.flipped else self.surface()


@dataclass(frozen=True)
class AxialPatch(FlippablePatch):
    """A patch about an axis; u is the angle about it [rad].

    u turns from ``u_axis`` towards ``u_axis`` x ``axis``: about +y from x to z, and about -z from x to y.
    """

    origin: Vector3 = (0.0, 0.0, 0.0)
    axis: Vector3 = (0.0, 1.0, 0.0)
    u_axis: Vector3 = (1.0, 0.0, 0.0)
    u_interval: Interval | None = None
    v_interval: Interval | None = None
    parameters: ClassVar[tuple[str, ...]] = ("u", "v")

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "origin", checked_vector(self.origin, "origin"))
        object.__setattr__(self, "axis", checked_vector(self.axis, "axis", unit=True))
        object.__setattr__(self, "u_axis", checked_vector(self.u_axis, "u_axis", unit=True))
        if self.u_interval is not None:
            object.__setattr__(self, "u_interval", checked_angles(self.u_interval, "u_interval"))
        if self.v_interval is not None:
            object.__setattr__(self, "v_interval", checked_interval(self.v_interval, "v_interval"))

    @property
    def _frame(self) -> Array:
        """Placement (4, 4): x along u = 0, y along the axis."""
        return placement(self.origin, self.axis, self.u_axis)

    def _local(self, point: ArrayLike) -> Array:
        """A point of the body's frame in the placement (3,)."""
        T = self._frame
        return np.asarray(T[:3, :3].T @ (np.asarray(point, float) - T[:3, 3]))


def angle_within(y: float, x: float, interval: Interval | None) -> float:
    """Angle of the point (x, y) [rad]: within half a turn of the middle of an interval, or of 0."""
    middle = 0.0 if interval is None else 0.5 * sum(interval)
    angle = float(np.arctan2(y, x))
    return angle - 2.0 * np.pi * float(np.round((angle - middle) / (2.0 * np.pi)))
