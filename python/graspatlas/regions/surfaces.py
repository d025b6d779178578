"""Surfaces that regions are held against: distances, normals and parameters of many points at once."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import ClassVar

import numpy as np

from graspatlas.patches.base import Interval, Patch, Vector3, placement
from graspatlas.patches.flat import Plane
from graspatlas.patches.round import Sphere, Torus
from graspatlas.patches.spline import BSpline
from graspatlas.patches.turned import Cone, Cylinder, Revolution
from graspatlas.support.arrays import Array, BoolArray

__all__ = ["Ball", "Flat", "Graph", "Outline", "Surface", "Turned", "natural_splines", "vector"]

#: The outermost latitudes of a sphere that a patch has [rad]: 86 degrees.
LATITUDE = 1.5
#: Least distance of a patch from its axis, as a share of its largest radius.
NEAR_AXIS = 0.05
#: Steepest slope of an outline, radius by height: where it is steeper, it turns towards the axis.
STEEPEST = 4.0


def vector(values: Array) -> Vector3:
    """Three floats."""
    return (float(values[0]), float(values[1]), float(values[2]))


class Surface(ABC):
    """A surface with an outward side.

    Attributes:
        kind: Its name: that of the patch.
        periodic: Whether u is an angle that may go all the way round.
    """

    kind: ClassVar[str] = ""
    periodic: ClassVar[bool] = False

    @abstractmethod
    def distances(self, points: Array) -> Array:
        """Signed distances of points (n, 3) from the surface, those outside positive (n,) [m]."""

    @abstractmethod
    def normals(self, points: Array) -> Array:
        """Outward unit normals at the feet of points (n, 3)."""

    @abstractmethod
    def parameters(self, points: Array) -> Array:
        """Parameters u and v of the feet of points (n, 2)."""

    @abstractmethod
    def patch(self, u: Interval | None, v: Interval) -> Patch:
        """The patch of this surface over intervals of its parameters; None for the whole circle."""

    @property
    def concave(self) -> bool:
        """Whether it is the inside of what it is named after."""
        return False

    def regular(self, points: Array) -> BoolArray:
        """At which of the points a patch of this surface is regular (n,)."""
        return np.ones(len(points), bool)

    def centered(self, points: Array) -> Surface:
        """The same surface with u = v = 0 in the middle of points, where that is free to choose."""
        return self


@dataclass(frozen=True, eq=False)
class Flat(Surface):
    """A plane; columns of `axes` are the directions of u, of v, and the normal."""

    origin: Array
    axes: Array
    kind: ClassVar[str] = "plane"

    def distances(self, points: Array) -> Array:
        """Heights over the plane."""
        return np.asarray((points - self.origin) @ self.axes[:, 2])

    def normals(self, points: Array) -> Array:
        """The normal."""
        return np.broadcast_to(self.axes[:, 2], points.shape)

    def parameters(self, points: Array) -> Array:
        """Coordinates along the plane."""
        return np.asarray((points - self.origin) @ self.axes[:, :2])

    def centered(self, points: Array) -> Surface:
        """The plane with its origin in the middle of the rectangle around points."""
        uv = self.parameters(points)
        return replace(self, origin=self.origin + self.axes[:, :2] @ (0.5 * (uv.min(axis=0) + uv.max(axis=0))))

    def patch(self, u: Interval | None, v: Interval) -> Patch:
        """A plane."""
        x, _, n = self.axes.T
        # e_v of a plane is e_u x normal, the opposite of the second axis here
        return Plane(vector(self.origin), vector(n), vector(x), u or (-1.0, 1.0), (-v[1], -v[0]))


@dataclass(frozen=True, eq=False)
class Ball(Surface):
    """A sphere; columns of `axes` are u = v = 0, the pole, and their cross product."""

    center: Array
    radius: float
    flipped: bool
    axes: Array
    kind: ClassVar[str] = "sphere"
    periodic: ClassVar[bool] = True

    @property
    def concave(self) -> bool:
        """Whether it is the inside."""
        return self.flipped

    def distances(self, points: Array) -> Array:
        """Distances from the centre, less the radius."""
        sign = -1.0 if self.flipped else 1.0
        return np.asarray(sign * (np.linalg.norm(points - self.center, axis=1) - self.radius))

    def normals(self, points: Array) -> Array:
        """Directions from the centre, or to it."""
        out = points - self.center
        out = out / np.maximum(np.linalg.norm(out, axis=1, keepdims=True), 1e-300)
        return np.asarray(-out if self.flipped else out)

    def parameters(self, points: Array) -> Array:
        """Longitudes and latitudes."""
        x, y, z = ((points - self.center) @ self.axes).T
        return np.column_stack([np.arctan2(z, x), np.arctan2(y, np.hypot(x, z))])

    def patch(self, u: Interval | None, v: Interval) -> Patch:
        """A sphere."""
        return Sphere(
            radius=self.radius,
            origin=vector(self.center),
            axis=vector(self.axes[:, 1]),
            u_axis=vector(self.axes[:, 0]),
            u_interval=u,
            v_interval=(max(v[0], -LATITUDE), min(v[1], LATITUDE)),
            flipped=self.flipped,
        )


@dataclass(frozen=True, eq=False)
class Outline:
    """What is turned about an axis: a line, a circle, or a curve, in the half-plane of height h and radius r.

    Attributes:
        kind: ``"cylinder"``, ``"cone"``, ``"torus"`` or ``"revolution"``.
        heights, radii: Points of the line, or of the curve; of a torus the height and radius of the circle's centre.
        tube: Radius of the circle, of a torus [m].
    """

    kind: str
    heights: Array
    radii: Array
    tube: float = 0.0

    def distances(self, h: Array, r: Array) -> Array:
        """Signed distances, positive away from the axis, or out of the tube (n,)."""
        if self.kind == "torus":
            return np.asarray(np.hypot(r - self.radii[0], h - self.heights[0]) - self.tube)
        radius, slope = self.radius(h)
        return np.asarray((r - radius) / np.hypot(1.0, slope))

    def normals(self, h: Array, r: Array) -> tuple[Array, Array]:
        """Components of the normals along h and r."""
        if self.kind == "torus":
            along, across = h - self.heights[0], r - self.radii[0]
        else:
            along, across = -self.radius(h)[1], np.ones_like(r)
        length = np.maximum(np.hypot(along, across), 1e-300)
        return along / length, across / length

    def feet(self, h: Array, r: Array) -> Array:
        """Parameter v of the nearest points: a height, or an angle about the tube."""
        if self.kind == "torus":
            return np.asarray(np.arctan2(h - self.heights[0], r - self.radii[0]))
        along, _ = self.normals(h, r)
        return np.asarray(h - along * self.distances(h, r)) if self.kind == "cone" else h

    def radius(self, h: Array) -> tuple[Array, Array]:
        """The radius and its slope at heights; beyond the ends straight on."""
        if self.kind != "revolution":
            (h0, h1), (r0, r1) = self.heights, self.radii
            slope = (r1 - r0) / (h1 - h0)
            return r0 + slope * (h - h0), np.full_like(h, slope)
        low, high = self.heights[[0, -1]]
        inside = np.clip(h, low, high)
        pieces = len(self.heights) - 1
        t = (inside - low) * (pieces / (high - low))
        piece = np.clip(t.astype(int), 0, pieces - 1)
        s = t - piece
        c3, c2, c1, c0 = (natural_coefficients(pieces + 1) @ self.radii)[:, piece]
        slope = (c1 + s * (2.0 * c2 + 3.0 * s * c3)) * (pieces / (high - low))
        return np.asarray(c0 + s * (c1 + s * (c2 + s * c3)) + slope * (h - inside)), np.asarray(slope)


@dataclass(frozen=True, eq=False)
class Turned(Surface):
    """A surface of revolution; columns of `axes` are u = 0, the axis, and their cross product."""

    origin: Array
    axes: Array
    outline: Outline
    flipped: bool
    periodic: ClassVar[bool] = True

    @property
    def kind(self) -> str:  # type: ignore[override]  # of the outline
        """That of the outline."""
        return self.outline.kind

    @property
    def concave(self) -> bool:
        """Whether it is the inside."""
        return self.flipped

    def _flat(self, points: Array) -> tuple[Array, Array, Array, Array]:
        """Heights, radii, and the coordinates across the axis."""
        x, h, z = ((points - self.origin) @ self.axes).T
        return h, np.hypot(x, z), x, z

    def distances(self, points: Array) -> Array:
        """Those of the outline in the half-plane of each point."""
        h, r, _, _ = self._flat(points)
        return (-1.0 if self.flipped else 1.0) * self.outline.distances(h, r)

    def normals(self, points: Array) -> Array:
        """Those of the outline, turned into space."""
        h, r, x, z = self._flat(points)
        along, across = self.outline.normals(h, r)
        share = across / np.maximum(r, 1e-300)
        out = np.column_stack([share * x, along, share * z]) @ self.axes.T
        return np.asarray(-out if self.flipped else out)

    def regular(self, points: Array) -> BoolArray:
        """Where the radius is neither small nor steep by height."""
        if self.outline.kind not in ("cone", "revolution"):
            return np.ones(len(points), bool)
        radius, slope = self.outline.radius(self._flat(points)[0])
        least = NEAR_AXIS * float(self.outline.radii.max())
        steep = np.abs(slope) > STEEPEST if self.outline.kind == "revolution" else np.zeros(len(points), bool)
        return np.asarray((radius >= least) & ~steep)

    def parameters(self, points: Array) -> Array:
        """Angles about the axis, and what the outline has along itself."""
        h, r, x, z = self._flat(points)
        return np.column_stack([np.arctan2(z, x), self.outline.feet(h, r)])

    def patch(self, u: Interval | None, v: Interval) -> Patch:
        """A cylinder, cone, torus or surface of revolution."""
        outline, origin = self.outline, vector(self.origin)
        axis, u_axis = vector(self.axes[:, 1]), vector(self.axes[:, 0])
        if outline.kind == "cylinder":
            radius = float(outline.radii[0])
            return Cylinder(
                radius=radius, origin=origin, axis=axis, u_axis=u_axis, u_interval=u, v_interval=v, flipped=self.flipped
            )
        if outline.kind == "torus":
            center = vector(self.origin + float(outline.heights[0]) * self.axes[:, 1])
            whole = v[1] - v[0] >= 2.0 * np.pi - 1e-9
            return Torus(
                ring_radius=float(outline.radii[0]),
                tube_radius=outline.tube,
                origin=center,
                axis=axis,
                u_axis=u_axis,
                u_interval=u,
                v_interval=None if whole else v,
                flipped=self.flipped,
            )
        if outline.kind == "cone":
            ends = np.array(v)
            radii, _ = outline.radius(ends)
            least = NEAR_AXIS * float(radii.max())
            if radii.min() < least:  # the apex is singular
                slope = (radii[1] - radii[0]) / (ends[1] - ends[0])
                low = int(np.argmin(radii))
                ends[low] += (least - radii[low]) / slope
                radii[low] = least
            return Cone(
                heights=(float(ends[0]), float(ends[1])),
                radii=(float(radii[0]), float(radii[1])),
                origin=origin,
                axis=axis,
                u_axis=u_axis,
                u_interval=u,
                v_interval=(float(ends[0]), float(ends[1])),
                flipped=self.flipped,
            )
        return Revolution(
            heights=tuple(map(float, outline.heights)),
            radii=tuple(map(float, outline.radii)),
            origin=origin,
            axis=axis,
            u_axis=u_axis,
            u_interval=u,
            v_interval=(max(v[0], float(outline.heights[0])), min(v[1], float(outline.heights[-1]))),
            flipped=self.flipped,
        )


@dataclass(frozen=True, eq=False)
class Graph(Surface):
    """A bicubic spline of heights over a plane; columns of `axes` are the directions of u, of v, and up."""

    origin: Array
    axes: Array
    net: Array
    u_knots: Array
    v_knots: Array
    kind: ClassVar[str] = "bspline"

    def _spline(self, uv: Array, du: int = 0, dv: int = 0) -> Array:
        """Heights, or their derivatives, over points of the plane (n,)."""
        from scipy.interpolate import NdBSpline  # slow to import

        low = np.array([self.u_knots[3], self.v_knots[3]])
        high = np.array([self.u_knots[-4], self.v_knots[-4]])
        spline = NdBSpline((self.u_knots, self.v_knots), self.net, 3)
        return np.asarray(spline(np.clip(uv, low, high), nu=(du, dv)))

    def distances(self, points: Array) -> Array:
        """Heights over the spline, made shorter where it is steep; beyond its rectangle from its edge."""
        local = (points - self.origin) @ self.axes
        low, high = np.array([self.u_knots[3], self.v_knots[3]]), np.array([self.u_knots[-4], self.v_knots[-4]])
        beyond = np.linalg.norm(local[:, :2] - np.clip(local[:, :2], low, high), axis=1)
        gap = local[:, 2] - self._spline(local[:, :2])
        slopes = np.hypot(self._spline(local[:, :2], 1, 0), self._spline(local[:, :2], 0, 1))
        return np.asarray(np.copysign(np.hypot(gap / np.hypot(1.0, slopes), beyond), gap))

    def normals(self, points: Array) -> Array:
        """Normals of the spline."""
        uv = self.parameters(points)
        local = np.column_stack([-self._spline(uv, 1, 0), -self._spline(uv, 0, 1), np.ones(len(uv))])
        return np.asarray((local / np.linalg.norm(local, axis=1, keepdims=True)) @ self.axes.T)

    def parameters(self, points: Array) -> Array:
        """Coordinates along the plane."""
        return np.asarray((points - self.origin) @ self.axes[:, :2])

    def patch(self, u: Interval | None, v: Interval) -> Patch:
        """A B-spline, whose control points lie over the means of its knots (Greville's abscissae)."""
        means = [
            np.lib.stride_tricks.sliding_window_view(knots[1:-1], 3).mean(axis=1)
            for knots in (self.u_knots, self.v_knots)
        ]
        x, y = np.meshgrid(*means, indexing="ij")
        points = np.stack([x, y, self.net], axis=-1) @ self.axes.T + self.origin
        ends = [(float(k[3]), float(k[-4])) for k in (self.u_knots, self.v_knots)]
        kept = [
            (max(low, least), min(high, most))
            for (low, high), (least, most) in zip((u or ends[0], v), ends, strict=True)
        ]
        return BSpline(
            control_points=tuple(tuple(vector(p) for p in row) for row in points),
            u_knots=tuple(map(float, self.u_knots)),
            v_knots=tuple(map(float, self.v_knots)),
            u_interval=kept[0],
            v_interval=kept[1],
            unit="m",
        )


def natural_splines(x: Array, count: int) -> Array:
    """Values (n, count) at x, between 0 and 1 (n,), of the splines of :func:`natural_coefficients`."""
    t = x * (count - 1)
    piece = np.clip(t.astype(int), 0, count - 2)
    s = (t - piece)[:, None]
    c3, c2, c1, c0 = natural_coefficients(count)[:, piece]
    return np.asarray(c0 + s * (c1 + s * (c2 + s * c3)))


@lru_cache(maxsize=64)
def natural_coefficients(count: int) -> Array:
    """Natural cubic splines over knots one apart, each one at its knot and zero at the others.

    Returns:
        Their coefficients in each piece, highest power first (4, count - 1, count).
    """
    from scipy.interpolate import CubicSpline  # slow to import

    return np.asarray(CubicSpline(np.arange(count), np.eye(count), bc_type="natural").c)


def frame_about(axis: Array, hint: Array) -> Array:
    """Axes (3, 3) as columns: across an axis near a hint, along it, and their cross product."""
    return placement((0.0, 0.0, 0.0), vector(axis / np.linalg.norm(axis)), vector(hint))[:3, :3]
