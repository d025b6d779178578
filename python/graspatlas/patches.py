"""Patches: parametrised pieces of surface on a hand's fingertip or on the object, eqs (3) and (4) of the paper.

A patch lives in the frame of the body that carries it and has up to two parameters, u and v. Lengths are in metres,
angles in radians. A contact decides which parameters are free and which are frozen.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import CubicSpline

from graspatlas import _core
from graspatlas.errors import GraspAtlasError, unknown_name
from graspatlas.tables import number, number_array

__all__ = ["Cone", "Cylinder", "Patch", "Plane", "Point", "Revolution", "patch_from_dict"]

Array = NDArray[np.float64]
Vector3 = tuple[float, float, float]
Interval = tuple[float, float]
EVERYWHERE: Interval = (-np.inf, np.inf)
#: Lengths of a patch are smaller [m]: larger ones are mistakes, and their squares may overflow.
LARGEST = 1e9
#: Heights of an outline are farther apart [m], or its slope would be no number.
CLOSEST = 1e-9


def _vector(value: ArrayLike, what: str, *, unit: bool = False) -> Vector3:
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


def _interval(value: Sequence[float], what: str) -> Interval:
    array = number_array(value, what)
    if array.shape != (2,) or not array[0] < array[1]:
        raise GraspAtlasError(f"{what} must be (lower, upper) with lower below upper, got {value!r}")
    return (float(array[0]), float(array[1]))


def _pair(value: Sequence[float], what: str) -> tuple[float, float]:
    array = number_array(value, what)
    if array.shape != (2,) or not (np.abs(array) < LARGEST).all():
        raise GraspAtlasError(f"{what} must be two finite numbers below {LARGEST:g}, got {value!r}")
    return (float(array[0]), float(array[1]))


def _placement(origin: Vector3, y_axis: Vector3, x_hint: Vector3) -> Array:
    """Frame [4, 4] at an origin with its y axis given and its x axis as near as can be to a hint."""
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
        """Parameters (u, v) of the patch's point nearest to a point of the body's frame [3]."""
        raise NotImplementedError

    def core(self) -> _core.Patch:
        """The compiled patch."""
        raise NotImplementedError

    def point(self, u: float = 0.0, v: float = 0.0) -> Array:
        """Point o(u, v) in the body's frame [3]."""
        return np.asarray(self.core().evaluate(u, v)["o"])

    def normal_at(self, u: float = 0.0, v: float = 0.0) -> Array:
        """Outward unit normal m(u, v) in the body's frame [3]."""
        return np.asarray(self.core().evaluate(u, v)["m"])

    def to_dict(self) -> dict[str, Any]:
        """The patch as plain data, with its ``type``."""
        return {"type": self.kind, **asdict(self)}


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
        object.__setattr__(self, "position", _vector(self.position, "position"))
        object.__setattr__(self, "normal", _vector(self.normal, "normal", unit=True))

    def interval(self, parameter: str) -> Interval | None:
        """A point has no parameter."""
        raise unknown_name("parameter", parameter, self.parameters, "one of a point's")

    def locate(self, point: ArrayLike) -> tuple[float, float]:
        """(0, 0)."""
        return (0.0, 0.0)

    def core(self) -> _core.Patch:
        """A plane, of which only the origin is used."""
        return _core.PlanePatch(_placement(self.position, self.normal, (1.0, 0.0, 0.0)))


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
        object.__setattr__(self, "origin", _vector(self.origin, "origin"))
        object.__setattr__(self, "normal", _vector(self.normal, "normal", unit=True))
        object.__setattr__(self, "u_axis", _vector(self.u_axis, "u_axis", unit=True))
        object.__setattr__(self, "u_interval", _interval(self.u_interval, "u_interval"))
        object.__setattr__(self, "v_interval", _interval(self.v_interval, "v_interval"))

    def interval(self, parameter: str) -> Interval | None:
        """Interval of u or v [m]."""
        return self.u_interval if parameter == "u" else self.v_interval

    def locate(self, point: ArrayLike) -> tuple[float, float]:
        """Foot of the perpendicular from a point."""
        T = _placement(self.origin, self.normal, self.u_axis)
        local = T[:3, :3].T @ (np.asarray(point, float) - T[:3, 3])
        return (float(local[0]), float(local[2]))

    def core(self) -> _core.Patch:
        """The compiled plane."""
        return _core.PlanePatch(_placement(self.origin, self.normal, self.u_axis))


@dataclass(frozen=True)
class _Turned(Patch):
    """A surface of revolution about an axis; u is the angle [rad], v the height along the axis [m].

    u turns from ``u_axis`` towards ``u_axis`` x ``axis``: about +y from x to z, and about -z from x to y.
    """

    origin: Vector3 = (0.0, 0.0, 0.0)
    axis: Vector3 = (0.0, 1.0, 0.0)
    u_axis: Vector3 = (1.0, 0.0, 0.0)
    u_interval: Interval | None = None
    v_interval: Interval | None = None
    parameters: ClassVar[tuple[str, ...]] = ("u", "v")

    def __post_init__(self) -> None:
        object.__setattr__(self, "origin", _vector(self.origin, "origin"))
        object.__setattr__(self, "axis", _vector(self.axis, "axis", unit=True))
        object.__setattr__(self, "u_axis", _vector(self.u_axis, "u_axis", unit=True))
        if self.u_interval is not None:
            low, high = _interval(self.u_interval, "u_interval")
            if not high - low <= 2.0 * np.pi:
                raise GraspAtlasError(f"u_interval {self.u_interval} is wider than a turn; None is the whole circle")
            object.__setattr__(self, "u_interval", (low, high))
        if self.v_interval is not None:
            object.__setattr__(self, "v_interval", _interval(self.v_interval, "v_interval"))

    def _check_radius(self) -> None:
        """The radius must not be negative anywhere in the interval of v, past an apex or between points."""
        low, high = np.clip(self.v_interval or self.default_v_interval(), -LARGEST, LARGEST)
        if not (self.radius_at(np.linspace(low, high, 1001)) >= 0.0).all():
            raise GraspAtlasError(f"the radius is negative in v_interval ({low:g}, {high:g}): end it before the apex")

    def outline(self) -> tuple[Array, Array]:
        """Breaks [n + 1] and cubic coefficients [n, 4], lowest power first, of the radius over v."""
        raise NotImplementedError

    def default_v_interval(self) -> Interval:
        """Where v lies when ``v_interval`` does not say."""
        breaks, _ = self.outline()
        return (float(breaks[0]), float(breaks[-1]))

    def interval(self, parameter: str) -> Interval | None:
        """Interval of u [rad], None for the whole circle; or of v [m]."""
        return self.u_interval if parameter == "u" else (self.v_interval or self.default_v_interval())

    def locate(self, point: ArrayLike) -> tuple[float, float]:
        """Angle about the axis and height along it: the nearest point for cylinders, near it for the others."""
        T = _placement(self.origin, self.axis, self.u_axis)
        x, y, z = T[:3, :3].T @ (np.asarray(point, float) - T[:3, 3])
        low, high = self.default_v_interval()
        heights = np.linspace(max(low, y - 1.0), min(high, y + 1.0), 2001)
        if self.kind == "cylinder" or heights[0] >= heights[-1]:
            return (self._angle(x, z), float(y))
        for _ in range(3):
            gap = np.hypot(self.radius_at(heights) - np.hypot(x, z), heights - y)
            best = int(np.argmin(gap))
            step = heights[1] - heights[0]
            heights = np.linspace(heights[best] - step, heights[best] + step, 2001)
        return (self._angle(x, z), float(heights[1000]))

    def _angle(self, x: float, z: float) -> float:
        """Angle of a point across the axis [rad]: within half a turn of the middle of ``u_interval``."""
        middle = 0.0 if self.u_interval is None else 0.5 * sum(self.u_interval)
        angle = float(np.arctan2(z, x))
        return angle - 2.0 * np.pi * float(np.round((angle - middle) / (2.0 * np.pi)))

    def radius_at(self, v: ArrayLike) -> Array:
        """Radius [m] at heights v [m]."""
        breaks, c = self.outline()
        heights = np.asarray(v, float)
        piece = np.clip(np.searchsorted(breaks, heights, side="right") - 1, 0, len(c) - 1)
        s = heights - breaks[piece]
        return np.asarray(c[piece, 0] + s * (c[piece, 1] + s * (c[piece, 2] + s * c[piece, 3])))

    def core(self) -> _core.Patch:
        """The compiled surface of revolution."""
        breaks, coefficients = self.outline()
        return _core.RevolutionPatch(_placement(self.origin, self.axis, self.u_axis), list(breaks), coefficients)


@dataclass(frozen=True)
class Cylinder(_Turned):
    """A cylinder: o(u, v) = (R cos u, v, R sin u) about the y axis.

    Attributes:
        radius: R [m].
        origin, axis: A point of the axis [m] and its direction, +y by default.
        u_axis: Direction of u = 0; u turns from it towards u_axis x axis.
        u_interval: Angles [rad]; None for the whole circle.
        v_interval: Heights along the axis, from the origin [m]; None for all.
    """

    radius: float = 0.0
    kind: ClassVar[str] = "cylinder"

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0.0 < number(self.radius, "radius") < LARGEST:
            raise GraspAtlasError(f"radius must be positive and below {LARGEST:g}, got {self.radius}")

    def default_v_interval(self) -> Interval:
        """All heights."""
        return EVERYWHERE

    def outline(self) -> tuple[Array, Array]:
        """One constant piece."""
        return np.array([0.0, 1.0]), np.array([[self.radius, 0.0, 0.0, 0.0]])


@dataclass(frozen=True)
class Cone(_Turned):
    """A cone or a frustum: the radius goes linearly from one height to another.

    Attributes:
        heights: Two heights along the axis [m].
        radii: The radius at each [m]; not both zero. Keep the apex, which is singular, out of ``v_interval``.
        origin, axis, u_axis, u_interval, v_interval: As for :class:`Cylinder`; v lies between the heights by default.
    """

    heights: tuple[float, float] = (0.0, 0.0)
    radii: tuple[float, float] = (0.0, 0.0)
    kind: ClassVar[str] = "cone"

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "heights", _pair(self.heights, "heights"))
        object.__setattr__(self, "radii", _pair(self.radii, "radii"))
        (h0, h1), (r0, r1) = self.heights, self.radii
        if not abs(h1 - h0) > CLOSEST:
            raise GraspAtlasError(
                f"a cone needs two different heights, more than {CLOSEST:g} m apart, got {self.heights}"
            )
        if min(r0, r1) < 0.0 or max(r0, r1) <= 0.0:
            raise GraspAtlasError(f"a cone needs radii that are not negative, got {self.radii}")
        self._check_radius()

    def outline(self) -> tuple[Array, Array]:
        """One linear piece."""
        (h0, r0), (h1, r1) = sorted(zip(self.heights, self.radii, strict=True))
        return np.array([h0, h1]), np.array([[r0, (r1 - r0) / (h1 - h0), 0.0, 0.0]])


@dataclass(frozen=True)
class Revolution(_Turned):
    """A surface of revolution whose radius is a cubic spline through given points.

    Attributes:
        heights: Heights along the axis [n], ascending [m].
        radii: Radius at each height [n], positive [m].
        origin, axis, u_axis, u_interval, v_interval: As for :class:`Cylinder`.
    """

    heights: tuple[float, ...] = ()
    radii: tuple[float, ...] = ()
    kind: ClassVar[str] = "revolution"

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "heights", tuple(map(float, number_array(self.heights, "heights").ravel())))
        object.__setattr__(self, "radii", tuple(map(float, number_array(self.radii, "radii").ravel())))
        if len(self.heights) < 2 or len(self.heights) != len(self.radii):
            raise GraspAtlasError("an outline needs at least two heights and as many radii")
        radii = np.array(self.radii)
        if not (np.abs(self.heights) < LARGEST).all() or not (np.diff(self.heights) > CLOSEST).all():
            raise GraspAtlasError(f"an outline needs ascending heights, finite and more than {CLOSEST:g} m apart")
        if not ((radii > 0.0) & (radii < LARGEST)).all():
            raise GraspAtlasError(f"an outline needs positive radii below {LARGEST:g}")
        self._check_radius()

    def outline(self) -> tuple[Array, Array]:
        """The natural cubic spline through the points."""
        if len(self.heights) == 2:
            slope = (self.radii[1] - self.radii[0]) / (self.heights[1] - self.heights[0])
            return np.array(self.heights), np.array([[self.radii[0], slope, 0.0, 0.0]])
        spline = CubicSpline(self.heights, self.radii, bc_type="natural")
        return np.asarray(spline.x), np.ascontiguousarray(spline.c[::-1].T)


_KINDS: dict[str, type[Patch]] = {c.kind: c for c in (Point, Plane, Cylinder, Cone, Revolution)}


def patch_from_dict(data: Mapping[str, Any]) -> Patch:
    """The patch that :meth:`Patch.to_dict` described.

    Args:
        data: ``type`` and the attributes of that patch.

    Raises:
        GraspAtlasError: For an unknown type or attribute, or values that make no patch.
    """
    if not isinstance(data, Mapping):
        raise GraspAtlasError(f"a patch is a table with a 'type', got {data!r}")
    values = dict(data)
    kind = values.pop("type", None)
    if kind not in _KINDS:
        raise unknown_name("patch type", kind, _KINDS)
    cls = _KINDS[kind]
    known = {field.name for field in fields(cls)}
    for name in values:
        if name not in known:
            raise unknown_name("attribute", name, known, f"one of a {kind} patch's")
    try:
        return cls(**{name: tuple(v) if isinstance(v, list) else v for name, v in values.items()})
    except GraspAtlasError as error:
        raise GraspAtlasError(f"{kind} patch: {error}") from None
    except TypeError as error:
        raise GraspAtlasError(f"a {kind} patch cannot be made of {values}: {error}") from None
