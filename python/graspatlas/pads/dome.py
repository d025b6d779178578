"""The simplest patch that fits the surface round a point: a plane, sphere, cylinder, ellipsoid or B-spline."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from graspatlas.collision.shapes import Shape
from graspatlas.pads.reach import FITS, LARGEST_ANGLE, LARGEST_TURN, Dome, widened
from graspatlas.pads.surface import frame_along, look
from graspatlas.patches.base import Patch, Vector3
from graspatlas.patches.flat import Plane
from graspatlas.patches.round import Ellipsoid, Sphere
from graspatlas.patches.spline import BSpline, clamped_knots
from graspatlas.patches.turned import Cylinder
from graspatlas.support.arrays import Array

__all__ = ["fit_dome"]

#: Rays along each side of the square that is fitted.
RAYS = 33
#: One that is nearer than this everywhere is what the surface was made as [m].
EXACT = 2e-5
#: Squares are tried from the largest on, each smaller by this factor, down to this share of the largest.
SHRINK, SMALLEST = 0.85, 0.2
#: A simpler patch is preferred to one of the largest square where its own is at least this share of that.
WIDE_ENOUGH = 0.5
#: A surface that bends less than this over its square is flat, as a share of the square's half side.
FLAT = 1e-3
#: The place of splines in the order of kinds from simple to general.
SPLINE = 4
#: Control points of a spline along u and v, and its degree.
NET, DEGREE = 9, 3
#: The normal is that of the rays within so many of the middle one.
NEAR = 5
#: How often the normal is found anew, looking along the one before.
TURNS = 3


def fit_dome(shapes: Sequence[Shape], point: Array, direction: Array, along: Array, largest: float) -> Dome | None:
    """The simplest patch that fits the surface of a body round a point.

    Args:
        shapes: The body's shapes.
        point: About where, in the body's frame (3,), metres.
        direction: From which side, a unit vector (3,).
        along: Direction of u, about (3,).
        largest: Half the side of the largest square to look at [m].

    Returns:
        The patch: the simplest that the surface was made as, or else that is near enough to it, on at least half of the
        largest square on which any fits. None where the surface has an edge or a hole on the smallest square too.
    """
    found: dict[tuple[int, bool], Dome] = {}
    half = largest
    while half >= SMALLEST * largest:
        for dome in _domes(shapes, point, direction, along, half):
            found.setdefault((dome.rank, False), dome)
            if dome.error <= EXACT:
                found.setdefault((dome.rank, True), dome)
        if (0, True) in found:
            break
        half *= SHRINK
    if not found:
        return None
    enough = WIDE_ENOUGH * max(dome.half for dome in found.values())
    wide = {kind: dome for kind, dome in found.items() if dome.half >= enough}
    # What the surface was made as, then what is near enough; splines fit everything and come last.
    kinds = sorted(wide, key=lambda kind: (kind[0] == SPLINE, not kind[1], kind[0]))
    return widened(shapes, wide[kinds[0]], largest)


def _domes(shapes: Sequence[Shape], point: Array, direction: Array, along: Array, half: float) -> Iterator[Dome]:
    """Patches that fit on a square."""
    seen = _square(shapes, point, direction, along, half)
    if seen is None:
        return
    T, ticks, heights = seen
    for rank, kind in enumerate((_plane, _sphere, _cylinder, _ellipsoid, _spline)):
        made = kind(T, ticks, heights)
        if made is not None and made[1] <= FITS:
            yield Dome(*made, half, rank, T)


def _square(
    shapes: Sequence[Shape], point: Array, direction: Array, along: Array, half: float
) -> tuple[Array, Array, Array] | None:
    """A frame (4, 4) on the surface with z along its normal, the places of the rays (n,) and heights (n, n)."""
    ticks, z, at = np.linspace(-half, half, RAYS), direction, point
    for turn in range(TURNS + 1):
        T = frame_along(z, at, along)
        heights = look(shapes, T, ticks, ticks).heights
        jumps = max(np.abs(np.diff(heights, axis=axis)).max() for axis in (0, 1))
        if not jumps <= np.tan(LARGEST_TURN) * (ticks[1] - ticks[0]):  # a ray that misses is NaN
            return None
        if turn == TURNS:
            return T, ticks, heights
        near = slice(RAYS // 2 - NEAR, RAYS // 2 + NEAR + 1)
        slope, middle = _quadratic(ticks[near], heights[near, near])[1:3], heights[RAYS // 2, RAYS // 2]
        at = T[:3, 3] + middle * T[:3, 2]
        z = T[:3, :3] @ [-slope[0], -slope[1], 1.0]
        z = z / np.linalg.norm(z)
    return None


def _quadratic(ticks: Array, heights: Array) -> Array:
    """Coefficients (6,) of 1, x, y, x^2, x y and y^2 in the parabola through the heights."""
    x, y = (grid.ravel() for grid in np.meshgrid(ticks, ticks, indexing="ij"))
    A = np.column_stack([np.ones_like(x), x, y, x**2, x * y, y**2])
    scale = np.abs(A).max(axis=0)
    return np.asarray(np.linalg.lstsq(A / scale, heights.ravel(), rcond=None)[0] / scale)


def _triple(vector: Array) -> Vector3:
    x, y, z = map(float, vector)
    return x, y, z


Made = tuple[Patch, float]


def _plane(T: Array, ticks: Array, heights: Array) -> Made | None:
    level = 0.5 * float(heights.max() + heights.min())
    if np.ptp(heights) > 2.0 * FLAT * ticks[-1]:
        return None
    side = (float(ticks[0]), float(ticks[-1]))
    at, normal, u_axis = T[:3, 3] + level * T[:3, 2], T[:3, 2], T[:3, 0]
    patch = Plane(origin=_triple(at), normal=_triple(normal), u_axis=_triple(u_axis), u_interval=side, v_interval=side)
    return patch, float(np.abs(heights - level).max())


def _sphere(T: Array, ticks: Array, heights: Array) -> Made | None:
    x, y = np.meshgrid(ticks, ticks, indexing="ij")
    # x^2 + y^2 + h^2 = 2 c h + d for a sphere about (0, 0, c)
    rows = np.column_stack([2.0 * heights.ravel(), np.ones(heights.size)])
    c, d = np.linalg.lstsq(rows, (x**2 + y**2 + heights**2).ravel(), rcond=None)[0]
    if not (c < 0.0 and c**2 + d > 0.0):
        return None
    radius = float(np.sqrt(c**2 + d))
    error = np.abs(np.sqrt(x**2 + y**2 + (heights - c) ** 2) - radius).max()
    if radius > 100.0 * ticks[-1]:
        return None
    top = T[:3, 3] + (c + radius) * T[:3, 2]
    angle = _angle(ticks[-1], radius)
    patch = Sphere(
        radius=radius,
        origin=_triple(top - radius * T[:3, 2]),
        axis=_triple(T[:3, 1]),
        u_axis=_triple(T[:3, 2]),
        u_interval=(-angle, angle),
        v_interval=(-angle, angle),
    )
    return patch, float(error)


def _angle(half: float, radius: float) -> float:
    """Angle of the part of a circle over a square [rad]."""
    return min(float(np.arcsin(min(half / radius, 1.0))), LARGEST_ANGLE)


def _principal(T: Array, ticks: Array, heights: Array) -> tuple[Array, float, float]:
    """The frame turned so that the surface bends most along x, and its curvatures along x and y [1/m]."""
    _, _, _, xx, xy, yy = _quadratic(ticks, heights)
    values, vectors = np.linalg.eigh(-np.array([[2.0 * xx, xy], [xy, 2.0 * yy]]))
    most = vectors[:, 1] if vectors[:, 1] @ [1.0, 0.0] >= 0.0 else -vectors[:, 1]
    turned = T.copy()
    turned[:3, 0] = T[:3, :2] @ most
    turned[:3, 1] = np.cross(T[:3, 2], turned[:3, 0])
    return turned, float(values[1]), float(values[0])


def _offsets(T: Array, turned: Array, ticks: Array) -> tuple[Array, Array]:
    """Coordinates of the rays in the turned frame (n, n) each."""
    grid = np.stack(np.meshgrid(ticks, ticks, indexing="ij"), axis=-1)
    both = grid @ (turned[:3, :2].T @ T[:3, :2]).T
    return both[..., 0], both[..., 1]


def _cylinder(T: Array, ticks: Array, heights: Array) -> Made | None:
    turned, most, _ = _principal(T, ticks, heights)
    if most <= 0.0:
        return None
    x, _ = _offsets(T, turned, ticks)
    rows = np.column_stack([2.0 * heights.ravel(), np.ones(heights.size)])
    c, d = np.linalg.lstsq(rows, (x**2 + heights**2).ravel(), rcond=None)[0]
    if not (c < 0.0 and c**2 + d > 0.0):
        return None
    radius = float(np.sqrt(c**2 + d))
    error = np.abs(np.hypot(x, heights - c) - radius).max()
    if radius > 100.0 * ticks[-1]:
        return None
    angle, side = _angle(ticks[-1], radius), (float(ticks[0]), float(ticks[-1]))
    patch = Cylinder(
        radius=radius,
        origin=_triple(T[:3, 3] + c * T[:3, 2]),
        axis=_triple(turned[:3, 1]),
        u_axis=_triple(T[:3, 2]),
        u_interval=(-angle, angle),
        v_interval=side,
    )
    return patch, float(error)


def _ellipsoid(T: Array, ticks: Array, heights: Array) -> Made | None:
    turned, most, least = _principal(T, ticks, heights)
    half = float(ticks[-1])
    if least * half < 0.02:
        return None
    from scipy.optimize import least_squares  # slow to import

    x, y = _offsets(T, turned, ticks)
    reach = float(np.hypot(half, half))

    # z = top + A (sqrt(1 - x^2 k / A - y^2 m / A) - 1) bends by k and m at the top, for any A.
    def surface(w: Array) -> Array:
        top, A, k, m = w
        return np.asarray(top + A * (np.sqrt(np.maximum(1.0 - (k * x**2 + m * y**2) / A, 1e-6)) - 1.0))

    start = [heights[RAYS // 2, RAYS // 2], 1.5 * reach, most, least]
    bounds = ([-half, 0.1 * half, 1e-3 / half, 1e-3 / half], [half, 20.0 * half, 5.0 / half, 5.0 / half])
    fitted = least_squares(
        lambda w: (surface(w) - heights).ravel(),
        np.clip(start, *bounds),
        bounds=bounds,
        x_scale=[half, half, 1 / half, 1 / half],
    )
    top, A, k, m = map(float, fitted.x)
    B, C = float(np.sqrt(A / m)), float(np.sqrt(A / k))
    patch = Ellipsoid(
        semi_axes=(A, B, C),
        origin=_triple(T[:3, 3] + (top - A) * T[:3, 2]),
        axis=_triple(turned[:3, 1]),
        u_axis=_triple(T[:3, 2]),
        u_interval=(-_angle(half, C), _angle(half, C)),
        v_interval=(-_angle(half, B), _angle(half, B)),
    )
    return patch, float(np.abs(surface(fitted.x) - heights).max())


def _spline(T: Array, ticks: Array, heights: Array) -> Made | None:
    from scipy.interpolate import BSpline as Basis  # slow to import

    half = float(ticks[-1])
    knots = clamped_knots(NET, DEGREE, -half, half)
    A = np.asarray(Basis.design_matrix(ticks, knots, DEGREE).toarray())
    inverse = np.linalg.pinv(A)
    net = inverse @ heights @ inverse.T
    # A spline whose control points lie over the means of its knots (Greville's abscissae) is the graph of its heights.
    means = np.lib.stride_tricks.sliding_window_view(knots[1:-1], DEGREE).mean(axis=1)
    u, v = np.meshgrid(means, means, indexing="ij")
    points = np.stack([u, v, net], axis=-1) @ T[:3, :3].T + T[:3, 3]
    row = tuple(map(float, knots))
    rows = tuple(tuple(_triple(point) for point in line) for line in points)
    patch = BSpline(control_points=rows, u_knots=row, v_knots=row, unit="m")
    return patch, float(np.abs(A @ net @ A.T - heights).max())
