"""Surfaces of revolution: cylinders, cones, and those with an outline of your own."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from graspatlas import _core
from graspatlas.errors import GraspAtlasError
from graspatlas.patches.base import (
    EVERYWHERE,
    LARGEST,
    AxialPatch,
    Interval,
    angle_within,
    checked_length,
    checked_pair,
)
from graspatlas.support.arrays import Array
from graspatlas.support.validation import number_array

__all__ = ["Cone", "Cylinder", "Revolution"]

#: Heights of an outline are farther apart [m], or its slope would not be finite.
CLOSEST = 1e-9


@dataclass(frozen=True)
class TurnedPatch(AxialPatch):
    """A surface of revolution about an axis; u is the angle [rad], v the height along the axis [m]."""

    def _check_radius(self) -> None:
        """The radius must not be negative anywhere in the interval of v, past an apex or between points."""
        low, high = np.clip(self.v_interval or self.default_v_interval(), -LARGEST, LARGEST)
        if not (self.radius_at(np.linspace(low, high, 1001)) >= 0.0).all():
            raise GraspAtlasError(f"the radius is negative in v_interval ({low:g}, {high:g}): end it before the apex")

    def outline(self) -> tuple[Array, Array]:
        """Breaks (n + 1,) and cubic coefficients (n, 4), lowest power first, of the radius over v."""
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
        x, y, z = self._local(point)
        low, high = self.default_v_interval()
        heights = np.linspace(max(low, y - 1.0), min(high, y + 1.0), 2001)
        if self.kind == "cylinder" or heights[0] >= heights[-1]:
            return (angle_within(z, x, self.u_interval), float(y))
        for _ in range(3):
            gap = np.hypot(self.radius_at(heights) - np.hypot(x, z), heights - y)
            best = int(np.argmin(gap))
            step = heights[1] - heights[0]
            heights = np.linspace(heights[best] - step, heights[best] + step, 2001)
        return (angle_within(z, x, self.u_interval), float(heights[1000]))

    def radius_at(self, v: ArrayLike) -> Array:
        """Radius [m] at heights v [m]."""
        breaks, c = self.outline()
        heights = np.asarray(v, float)
        piece = np.clip(np.searchsorted(breaks, heights, side="right") - 1, 0, len(c) - 1)
        s = heights - breaks[piece]
        return np.asarray(c[piece, 0] + s * (c[piece, 1] + s * (c[piece, 2] + s * c[piece, 3])))

    def surface(self) -> _core.Patch:
        """The compiled surface of revolution."""
        breaks, coefficients = self.outline()
        return _core.RevolutionPatch(self._frame, list(breaks), coefficients)


@dataclass(frozen=True)
class Cylinder(TurnedPatch):
    """A cylinder: o(u, v) = (R cos u, v, R sin u) about the y axis.

    Attributes:
        radius: R [m].
        origin, axis: A point of the axis [m] and its direction, +y by default.
        u_axis: Direction of u = 0; u turns from it towards u_axis x axis.
        u_interval: Angles [rad]; None for the whole circle.
        v_interval: Heights along the axis, from the origin [m]; None for all.
        flipped: True for the inside.
    """

    radius: float = 0.0
    kind: ClassVar[str] = "cylinder"

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "radius", checked_length(self.radius, "radius"))

    def default_v_interval(self) -> Interval:
        """All heights."""
        return EVERYWHERE

    def outline(self) -> tuple[Array, Array]:
        """One constant piece."""
        return np.array([0.0, 1.0]), np.array([[self.radius, 0.0, 0.0, 0.0]])


@dataclass(frozen=True)
class Cone(TurnedPatch):
    """A cone or a frustum: the radius goes linearly from one height to another.

    Attributes:
        heights: Two heights along the axis [m].
        radii: The radius at each [m]; not both zero. Keep the apex, which is singular, out of ``v_interval``.
        origin, axis, u_axis, u_interval, v_interval, flipped: As for :class:`Cylinder`; v lies between the
            heights by default.
    """

    heights: tuple[float, float] = (0.0, 0.0)
    radii: tuple[float, float] = (0.0, 0.0)
    kind: ClassVar[str] = "cone"

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "heights", checked_pair(self.heights, "heights"))
        object.__setattr__(self, "radii", checked_pair(self.radii, "radii"))
        (h0, h1), (r0, r1) = self.heights, self.radii
        if not abs(h1 - h0) > CLOSEST:
            raise GraspAtlasError(f"a cone needs two heights more than {CLOSEST:g} m apart, got {self.heights}")
        if min(r0, r1) < 0.0 or max(r0, r1) <= 0.0:
            raise GraspAtlasError(f"a cone needs radii that are not negative, got {self.radii}")
        self._check_radius()

    def outline(self) -> tuple[Array, Array]:
        """One linear piece."""
        (h0, r0), (h1, r1) = sorted(zip(self.heights, self.radii, strict=True))
        return np.array([h0, h1]), np.array([[r0, (r1 - r0) / (h1 - h0), 0.0, 0.0]])


@dataclass(frozen=True)
class Revolution(TurnedPatch):
    """A surface of revolution whose radius is a cubic spline through given points.

    Attributes:
        heights: Heights along the axis (n,), ascending [m].
        radii: Radius at each height (n,), positive [m].
        origin, axis, u_axis, u_interval, v_interval, flipped: As for :class:`Cylinder`.
    """

    heights: tuple[float, ...] = field(default=(), repr=False)
    radii: tuple[float, ...] = field(default=(), repr=False)
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
        from scipy.interpolate import CubicSpline  # slow to import

        spline = CubicSpline(self.heights, self.radii, bc_type="natural")
        return np.asarray(spline.x), np.ascontiguousarray(spline.c[::-1].T)
