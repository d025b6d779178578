"""Triangle meshes with normals: the simple shapes, and the geometry of a URDF."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from graspatlas import _core
from graspatlas.support.arrays import AnyArray, Array, IntArray

__all__ = [
    "Mesh",
    "arrow",
    "box",
    "capsule",
    "ellipsoid",
    "frame_along",
    "from_shape",
    "lathe",
    "merged",
    "smooth",
    "tube",
]

#: Faces that meet at a smaller angle share a normal and look round [rad].
CREASE = np.radians(38.0)
#: Sides of round shapes.
SIDES = 40


@dataclass(frozen=True, eq=False)
class Mesh:
    """A triangle mesh.

    Attributes:
        vertices: Vertices (n, 3), metres.
        normals: Outward unit normals at the vertices (n, 3).
        faces: Indices of the corners of each triangle (f, 3), counterclockwise seen from outside.
    """

    vertices: Array
    normals: Array
    faces: IntArray

    def moved(self, T: Array) -> Mesh:
        """The mesh at placement T (4, 4): a rotation, a translation, and one scale if any."""
        turned = self.normals @ T[:3, :3].T / np.linalg.norm(T[:3, 0])
        return Mesh(self.vertices @ T[:3, :3].T + T[:3, 3], turned, self.faces)


def smooth(vertices: ArrayLike, faces: ArrayLike, crease: float = CREASE) -> Mesh:
    """Mesh whose normals are averaged over faces that meet at less than the crease angle.

    Args:
        vertices: Vertices (n, 3), metres.
        faces: Triangles (f, 3).
        crease: The angle [rad].
    """
    points = np.asarray(vertices, float)
    triangles = np.asarray(faces, np.int64)
    sides = points[triangles[:, 1:]] - points[triangles[:, :1]]
    triangles = triangles[np.cross(sides[:, 0], sides[:, 1]).any(axis=1)]
    corner_vertex = triangles.ravel()
    corner_normals = np.asarray(_core.corner_normals(points, triangles, crease)).reshape(-1, 3)
    keys = np.column_stack([corner_vertex, np.round(200.0 * corner_normals).astype(np.int64)])
    _, first, inverse = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    return Mesh(points[corner_vertex[first]], corner_normals[first], inverse.reshape(-1, 3))


def merged(meshes: Sequence[Mesh]) -> Mesh:
    """Several meshes as one."""
    starts = np.cumsum([0] + [len(mesh.vertices) for mesh in meshes])
    return Mesh(
        np.concatenate([mesh.vertices for mesh in meshes]),
        np.concatenate([mesh.normals for mesh in meshes]),
        np.concatenate([mesh.faces + start for mesh, start in zip(meshes, starts, strict=False)]),
    )


def lathe(profile: ArrayLike, sides: int = SIDES) -> Mesh:
    """Surface of revolution about z.

    Args:
        profile: Radius and height of the outline's points from bottom to top (n, 2), metres.
        sides: How many flat sides stand for the circle.
    """
    outline = np.asarray(profile, float)
    n = len(outline)
    angle = np.linspace(0.0, 2.0 * np.pi, sides, endpoint=False)
    ring = np.column_stack([np.cos(angle), np.sin(angle)])
    vertices = np.empty((n, sides, 3))
    vertices[:, :, :2] = outline[:, :1, None] * ring
    vertices[:, :, 2] = outline[:, 1:]
    faces = _between_rings(n, sides)
    flat = vertices.reshape(-1, 3)
    for row in np.flatnonzero(outline[:, 0] == 0.0):
        faces[(faces >= row * sides) & (faces < (row + 1) * sides)] = row * sides
    return smooth(flat, faces)


def _between_rings(n: int, sides: int) -> IntArray:
    """Triangles between n rings of vertices, each counterclockwise seen from the next."""
    i, j = (a.ravel() for a in np.meshgrid(np.arange(n - 1), np.arange(sides), indexing="ij"))
    a, b = i * sides + j, i * sides + (j + 1) % sides
    return np.concatenate([np.column_stack([a, b, b + sides]), np.column_stack([a, b + sides, a + sides])])


def ellipsoid(radii: ArrayLike, sides: int = SIDES) -> Mesh:
    """Ellipsoid about the origin with semi-axes along x, y and z (3,), metres."""
    scale = np.asarray(radii, float)
    angle = np.linspace(-np.pi / 2.0, np.pi / 2.0, sides // 2 + 1)
    radius = np.cos(angle)
    radius[[0, -1]] = 0.0
    sphere = lathe(np.column_stack([radius, np.sin(angle)]), sides)
    normals = sphere.vertices / scale
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return Mesh(sphere.vertices * scale, normals, sphere.faces)


def box(lengths: ArrayLike) -> Mesh:
    """Box about the origin with edges along x, y and z (3,), metres."""
    corners = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = [face for a, b, c, d in quads for face in ((a, b, c), (a, c, d))]
    return smooth(corners * np.asarray(lengths, float), faces)


def capsule(radius: float, half_length: float) -> Mesh:
    """Capsule about z; the half length is that of its cylinder, metres."""
    angle = np.linspace(0.0, np.pi / 2.0, SIDES // 4 + 1)
    top = np.column_stack([radius * np.cos(angle), half_length + radius * np.sin(angle)])
    top[-1, 0] = 0.0
    return lathe(np.concatenate([(top * [1.0, -1.0])[::-1], top]))


def arrow(start: Array, direction: Array, length: float, radius: float) -> Mesh:
    """Arrow from a point (3,) along a unit vector (3,); length and radius of its shaft in metres."""
    neck = length - 5.0 * radius
    outline = [(0.0, 0.0), (radius, 0.0), (radius, neck), (2.6 * radius, neck), (0.0, length)]
    shape = lathe(outline, 20)
    return shape.moved(frame_along(direction, start))


def tube(path: Array, radius: float) -> Mesh:
    """Open tube along points (n, 3) that lie in a plane, or nearly so; metres."""
    flat = np.eye(3)[np.argmin(np.ptp(path, axis=0))]
    along = np.gradient(path, axis=0)
    x = np.cross(along, flat)
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    y = np.cross(along, x)
    y /= np.linalg.norm(y, axis=1, keepdims=True)
    angle = np.linspace(0.0, 2.0 * np.pi, SIDES, endpoint=False)[:, None]
    rings = path[:, None] + radius * (np.cos(angle) * x[:, None] + np.sin(angle) * y[:, None])
    return smooth(rings.reshape(-1, 3), _between_rings(len(path), SIDES))


def frame_along(direction: Array, origin: Array) -> Array:
    """Placement (4, 4) at a point (3,) with z along a unit vector (3,)."""
    least = np.eye(3)[np.argmin(np.abs(direction))]
    x = np.cross(least, direction)
    x /= np.linalg.norm(x)
    T = np.eye(4)
    T[:3, 0], T[:3, 1], T[:3, 2], T[:3, 3] = x, np.cross(direction, x), direction, origin
    return T


def from_shape(kind: str, sizes: Sequence[float], points: Array, triangles: AnyArray) -> Mesh | None:
    """Mesh of a shape of a URDF; None for one that has no surface to show.

    Args:
        kind: ``"mesh"``, ``"box"``, ``"sphere"``, ``"cylinder"`` or ``"capsule"``, the last two about z.
        sizes: Radius; radius and length, of a capsule between the ends' centres; edges [m].
        points: Vertices of a mesh (n, 3), metres.
        triangles: Corners of its triangles (t, 3).
    """
    first, second = float(sizes[0]), float(sizes[1])
    if kind == "mesh":
        return smooth(points, triangles)
    if kind == "box":
        return box(sizes)
    if kind == "sphere":
        return ellipsoid(np.full(3, first))
    if kind == "cylinder":
        h = 0.5 * second
        return lathe([[0.0, -h], [first, -h], [first, h], [0.0, h]])
    return capsule(first, 0.5 * second) if kind == "capsule" else None
