"""Spheres, tori and ellipsoids."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from graspatlas import _core
from graspatlas.errors import GraspAtlasError
from graspatlas.patches.base import (
    AxialPatch,
    Interval,
    Vector3,
    angle_within,
    checked_angles,
    checked_interval,
    checked_length,
    checked_vector,
)
from graspatlas.patches.nearest import nearest_parameters

__all__ = ["Ellipsoid", "Sphere", "Torus"]

#: Latitudes of spheres and ellipsoids by default [rad]: 80 degrees, since the poles are singular.
LATITUDES: Interval = (-1.4, 1.4)
#: No point of the surface may be nearer to a pole or to the axis than this share of its size.
SINGULAR = 1e-6


@dataclass(frozen=True)
class _Globe(AxialPatch):
    """A patch by longitude u and latitude v, both angles [rad]; the poles, v = -pi/2 and pi/2, are singular."""

    v_interval: Interval | None = LATITUDES

    def __post_init__(self) -> None:
        super().__post_init__()
        low, high = self.v_interval or LATITUDES
        if max(-low, high) > 0.5 * np.pi or min(np.cos(low), np.cos(high)) < SINGULAR:
            raise GraspAtlasError(
                f"v_interval ({low:g}, {high:g}) reaches a pole of the {self.kind}, where longitudes meet: keep it "
                "inside (-pi/2, pi/2), and turn the axis to have the poles elsewhere"
            )

    def interval(self, parameter: str) -> Interval | None:
        """Longitudes u, None for the whole circle; or latitudes v [rad]."""
        return self.u_interval if parameter == "u" else (self.v_interval or LATITUDES)


@dataclass(frozen=True)
class Sphere(_Globe):
    """A sphere, or a part of one: o(u, v) = R (cos v cos u, sin v, cos v sin u) with the poles on the y axis.

    Attributes:
        radius: R [m].
        origin: Its centre [m].
        axis: From the centre to the pole v = pi/2, +y by default.
        u_axis: From the centre towards the point u = v = 0; u turns from it towards u_axis x axis.
        u_interval: Longitudes [rad]; None for the whole circle.
        v_interval: Latitudes [rad], -1.4 to 1.4 (80 degrees) by default: the poles are singular. Turn the axis to have
            them where nothing touches.
        flipped: True for the inside.
    """

    radius: float = 0.0
    kind: ClassVar[str] = "sphere"

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "radius", checked_length(self.radius, "radius"))

    @classmethod
    def cap(cls, position: ArrayLike, normal: ArrayLike, radius: float, half_angle: float = 0.5) -> Sphere:
        """A domed fingertip: the part of a sphere around a point with a given outward normal.

        The point is u = v = 0, and both parameters are free within the half angle, so that the tip can roll.

        Args:
            position: The point [m].
            normal: Outward normal there.
            radius: Radius of the sphere [m].
            half_angle: Largest longitude and latitude [rad], below pi/2.

        Raises:
            GraspAtlasError: If a value is out of its range.
        """
        n = np.array(checked_vector(normal, "normal", unit=True))
        center = np.array(checked_vector(position, "position")) - checked_length(radius, "radius") * n
        across = np.cross(n, np.eye(3)[np.argmin(np.abs(n))])
        angle = checked_length(half_angle, "half_angle")
        interval = (-angle, angle)
        return cls(
            radius=radius,
            origin=(float(center[0]), float(center[1]), float(center[2])),
            axis=(float(across[0]), float(across[1]), float(across[2])),
            u_axis=(float(n[0]), float(n[1]), float(n[2])),
            u_interval=interval,
            v_interval=interval,
        )

    def locate(self, point: ArrayLike) -> tuple[float, float]:
        """Longitude and latitude of a point [rad]."""
        x, y, z = self._local(point)
        return (angle_within(z, x, self.u_interval), float(np.arctan2(y, np.hypot(x, z))))

    def surface(self) -> _core.Patch:
        """The compiled sphere: a torus with a ring of radius 0."""
        return _core.TorusPatch(self._frame, 0.0, self.radius)


@dataclass(frozen=True)
class Torus(AxialPatch):
    """A torus: o(u, v) = ((R + r cos v) cos u, r sin v, (R + r cos v) sin u) about the y axis.

    Attributes:
        ring_radius: R, of the circle of the tube's centres [m].
        tube_radius: r [m].
        origin, axis: Centre [m], and direction of the axis through the hole, +y by default.
        u_axis: Direction of u = 0; u turns from it towards u_axis x axis.
        u_interval: Angles about the axis [rad]; None for the whole circle.
        v_interval: Angles about the tube [rad], 0 outermost, pi/2 at the top; None for the whole circle.
        flipped: True for the inside of the tube.
    """

    ring_radius: float = 0.0
    tube_radius: float = 0.0
    kind: ClassVar[str] = "torus"

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "ring_radius", checked_length(self.ring_radius, "ring_radius"))
        object.__setattr__(self, "tube_radius", checked_length(self.tube_radius, "tube_radius"))
        if self.v_interval is not None:
            object.__setattr__(self, "v_interval", checked_angles(self.v_interval, "v_interval"))
        low, high = self.v_interval or (-np.pi, np.pi)
        smallest = np.cos(np.linspace(low, high, 1001)).min()
        if self.ring_radius + self.tube_radius * smallest < SINGULAR * self.tube_radius:
            raise GraspAtlasError(
                f"the torus meets its axis: its tube radius {self.tube_radius:g} is not below its ring radius "
                f"{self.ring_radius:g}; keep v_interval to the outside"
            )

    def interval(self, parameter: str) -> Interval | None:
        """Angles about the axis, or about the tube [rad]; None for the whole circle."""
        return self.u_interval if parameter == "u" else self.v_interval

    def locate(self, point: ArrayLike) -> tuple[float, float]:
        """Angles of a point about the axis and about the tube [rad]."""
        x, y, z = self._local(point)
        v = angle_within(y, float(np.hypot(x, z)) - self.ring_radius, self.v_interval)
        return (angle_within(z, x, self.u_interval), v)

    def surface(self) -> _core.Patch:
        """The compiled torus."""
        return _core.TorusPatch(self._frame, self.ring_radius, self.tube_radius)


@dataclass(frozen=True)
class Ellipsoid(_Globe):
    """An ellipsoid: o(u, v) = (A cos v cos u, B sin v, C cos v sin u) with the poles on the y axis.

    u and v are angles of the sphere that is stretched to the ellipsoid.

    Attributes:
        semi_axes: A along u_axis, B along axis, C along u_axis x axis [m].
        origin, axis, u_axis, u_interval, v_interval, flipped: As for :class:`Sphere`.
    """

    semi_axes: Vector3 = (0.0, 0.0, 0.0)
    kind: ClassVar[str] = "ellipsoid"

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "semi_axes", checked_vector(self.semi_axes, "semi_axes"))
        if min(self.semi_axes) <= 0.0:
            raise GraspAtlasError(f"semi_axes must be positive, got {self.semi_axes}")

    def locate(self, point: ArrayLike) -> tuple[float, float]:
        """Parameters of the nearest point within ``v_interval``, by least squares [rad]."""
        longitudes = self.u_interval or (-np.pi, np.pi)
        free = self.u_interval or (-3.0 * np.pi, 3.0 * np.pi)
        latitudes = checked_interval(self.v_interval or LATITUDES, "v_interval")
        u, v = nearest_parameters(self.surface(), point, (longitudes, latitudes), (free, latitudes))
        return (angle_within(float(np.sin(u)), float(np.cos(u)), self.u_interval), float(v))

    def surface(self) -> _core.Patch:
        """The compiled ellipsoid."""
        return _core.EllipsoidPatch(self._frame, self.semi_axes)
