"""The surface of a rigid body of a hand, seen along parallel rays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from graspatlas import _core
from graspatlas.collision.hulls import hull_of
from graspatlas.collision.shapes import Shape
from graspatlas.errors import GraspAtlasError
from graspatlas.support.arrays import Array, Int32Array, IntArray

__all__ = ["View", "bounding_points", "frame_along", "look"]

#: Meshes are looked at from the plane this far below their lowest point [m].
ABOVE_GROUND = 0.01


@dataclass(frozen=True, eq=False)
class View:
    """What parallel rays meet first, which come down the z axis of a frame over a square grid of its x-y plane.

    Attributes:
        heights: z where each ray meets the body (n, n), metres, over (x_i, y_j); NaN where it misses.
        shapes: Number of the shape that it meets (n, n); -1 where it misses.
    """

    heights: Array
    shapes: IntArray


def look(shapes: Sequence[Shape], T: Array, xs: Array, ys: Array) -> View:
    """Look at shapes along rays that come down the z axis of a frame.

    Args:
        shapes: Shapes, placed in the body.
        T: The frame in the body (4, 4).
        xs: Evenly spaced places of the rays along its x axis (n,), metres.
        ys: Along its y axis (m,).
    """
    heights = np.full((len(xs), len(ys)), -np.inf)
    seen = np.full(heights.shape, -1)
    for number, shape in enumerate(shapes):
        relative = np.linalg.inv(T) @ shape.placement
        found = _MEETS[shape.kind](shape, relative, xs, ys) if shape.kind in _MEETS else _mesh(shape, relative, xs, ys)
        nearer = found > heights
        heights[nearer], seen[nearer] = found[nearer], number
    return View(np.where(seen < 0, np.nan, heights), seen)


def bounding_points(shape: Shape) -> Array:
    """Points of the body (n, 3) whose bounding box holds a shape, tightly where it is a mesh or box, metres."""
    first, second, third = (float(size) for size in shape.sizes)
    if len(shape.points):
        local = np.asarray(shape.points, float)
    else:
        halves = {
            "sphere": (first, first, first),
            "cylinder": (first, first, 0.5 * second),
            "capsule": (first, first, 0.5 * second + first),
            "box": (0.5 * first, 0.5 * second, 0.5 * third),
        }
        if shape.kind not in halves:
            raise GraspAtlasError(f"'{shape.name}' is a {shape.kind}: pads are found on solids and meshes")
        local = np.array(np.meshgrid(*[(-h, h) for h in halves[shape.kind]])).reshape(3, -1).T
    return np.asarray(local @ shape.placement[:3, :3].T + shape.placement[:3, 3])


def frame_along(z: Array, origin: Array, x_hint: Array | None = None) -> Array:
    """A frame (4, 4) with z given and x as near as can be to a direction (3,), if that is not along z."""
    x = np.zeros(3) if x_hint is None else x_hint - (x_hint @ z) * z
    if np.linalg.norm(x) < 1e-3:
        x = np.eye(3)[np.argmin(np.abs(z))]
        x = x - (x @ z) * z
    x = x / np.linalg.norm(x)
    T = np.eye(4)
    T[:3, 0], T[:3, 1], T[:3, 2], T[:3, 3] = x, np.cross(z, x), z, origin
    return T


def _rays(T: Array, xs: Array, ys: Array) -> tuple[Array, Array]:
    """Where the rays pass z = 0 of the looking frame (n, m, 3), and where they come from (3,), in a shape's frame."""
    x, y = np.meshgrid(xs, ys, indexing="ij")
    points = np.stack([x, y, np.zeros_like(x)], axis=-1)
    return (points - T[:3, 3]) @ T[:3, :3], T[2, :3]


def _ball(origins: Array, up: Array, radius: float, center: float = 0.0) -> Array:
    """Heights at which rays meet a ball about a point of the z axis."""
    o = origins - [0.0, 0.0, center]
    b = o @ up
    root = b**2 - ((o**2).sum(axis=-1) - radius**2)
    with np.errstate(invalid="ignore"):
        return np.where(root >= 0.0, -b + np.sqrt(root), -np.inf)


def _slab(origins: Array, up: Array, axis: int, half: float) -> tuple[Array, Array]:
    """Heights between which rays are within a distance of the plane through the origin across an axis."""
    o, d = origins[..., axis], float(up[axis])
    if abs(d) < 1e-12:
        inside = np.abs(o) <= half
        return np.where(inside, -np.inf, np.inf), np.where(inside, np.inf, -np.inf)
    ends = (-half - o) / d, (half - o) / d
    return np.minimum(*ends), np.maximum(*ends)


def _tube(origins: Array, up: Array, radius: float) -> tuple[Array, Array]:
    """Heights between which rays are within a distance of the z axis."""
    o, d = origins[..., :2], up[:2]
    a, b, c = float(d @ d), o @ d, (o**2).sum(axis=-1) - radius**2
    if a < 1e-24:
        return np.where(c <= 0.0, -np.inf, np.inf), np.where(c <= 0.0, np.inf, -np.inf)
    root = b**2 - a * c
    half = np.sqrt(np.maximum(root, 0.0)) / a
    return np.where(root >= 0.0, -b / a - half, np.inf), np.where(root >= 0.0, -b / a + half, -np.inf)


def _common(parts: Sequence[tuple[Array, Array]]) -> Array:
    """Heights at which rays enter what several pairs of heights have in common."""
    low = np.max([part[0] for part in parts], axis=0)
    high = np.min([part[1] for part in parts], axis=0)
    return np.where(high >= low, high, -np.inf)


def _sphere(shape: Shape, T: Array, xs: Array, ys: Array) -> Array:
    return _ball(*_rays(T, xs, ys), float(shape.sizes[0]))


def _cylinder(shape: Shape, T: Array, xs: Array, ys: Array) -> Array:
    origins, up = _rays(T, xs, ys)
    return _common([_tube(origins, up, float(shape.sizes[0])), _slab(origins, up, 2, 0.5 * float(shape.sizes[1]))])


def _capsule(shape: Shape, T: Array, xs: Array, ys: Array) -> Array:
    radius, half = float(shape.sizes[0]), 0.5 * float(shape.sizes[1])
    origins, up = _rays(T, xs, ys)
    ends = [_ball(origins, up, radius, center) for center in (-half, half)]
    return np.asarray(np.max([_cylinder(shape, T, xs, ys), *ends], axis=0))


def _box(shape: Shape, T: Array, xs: Array, ys: Array) -> Array:
    origins, up = _rays(T, xs, ys)
    return _common([_slab(origins, up, axis, 0.5 * float(shape.sizes[axis])) for axis in range(3)])


_MEETS = {"sphere": _sphere, "cylinder": _cylinder, "capsule": _capsule, "box": _box}


def _mesh(shape: Shape, T: Array, xs: Array, ys: Array) -> Array:
    """Heights of a mesh or convex solid: its triangles are drawn into the grid as into a picture."""
    points = np.asarray(shape.points, float) @ T[:3, :3].T + T[:3, 3]
    triangles: Int32Array = shape.triangles if len(shape.triangles) else hull_of(points).triangles
    heights = np.full(len(xs) * len(ys), -np.inf)
    if len(triangles) == 0:
        return heights.reshape(len(xs), len(ys))
    # Pixels have their centres at half numbers and rows come first; nearness is positive.
    row, column = ((points[:, k] - at[0]) / (at[1] - at[0]) + 0.5 for k, at in enumerate((xs, ys)))
    ground = points[:, 2].min() - ABOVE_GROUND
    screen = np.column_stack([column, row, points[:, 2] - ground])[np.asarray(triangles, np.int64)]
    found = _core.nearest_fragments(np.ascontiguousarray(screen), len(ys), len(xs))
    heights[found["pixels"]] = found["nearness"].astype(float) + ground
    return heights.reshape(len(xs), len(ys))
