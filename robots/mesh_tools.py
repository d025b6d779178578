"""Build closed triangle meshes from sections and outlines, and write them as OBJ.

Every builder is deterministic: the same numbers give the same bytes. Lengths are in metres.
Coordinates are rounded to a micrometre before anything is derived from them, so that the last bits
of the floating-point library do not show in the files.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import PchipInterpolator
from scipy.spatial import ConvexHull

Array = NDArray[np.float64]
Faces = NDArray[np.int64]

#: Decimals kept of a coordinate [m] and of a unit normal [-].
COORDINATE_DECIMALS = 6
NORMAL_DECIMALS = 3
#: Depth that the rim of a cushion sinks below the body it sits on [m].
RIM_DEPTH = 0.0006
#: Gap at which a convex hull is good enough with fewer vertices than allowed [m].
HULL_GAP = 5e-5
#: Share of the largest gap around a vertex of a convex hull by which it is pushed outwards [-].
PUSH = 0.2


@dataclass(frozen=True)
class Mesh:
    """Triangle mesh.

    Attributes:
        vertices: Vertex positions, shape (n, 3) [m].
        faces: Vertex indices, shape (m, 3), counter-clockwise seen from outside.
    """

    vertices: Array
    faces: Faces

    def moved(self, rotation: ArrayLike, translation: ArrayLike = (0.0, 0.0, 0.0)) -> Mesh:
        """Return the mesh after x -> rotation x + translation."""
        vertices = self.vertices @ np.asarray(rotation, float).T + np.asarray(translation, float)
        return Mesh(vertices, self.faces)


def merged(*meshes: Mesh) -> Mesh:
    """Put several meshes into one; they may overlap."""
    offsets = np.cumsum([0] + [len(mesh.vertices) for mesh in meshes])
    vertices = np.vstack([mesh.vertices for mesh in meshes])
    faces = np.vstack([mesh.faces + k for mesh, k in zip(meshes, offsets[:-1], strict=True)])
    return Mesh(vertices, faces)


def axis_rotation(axis: str) -> Array:
    """Return the rotation that takes z to the positive axis `axis` by permuting the axes."""
    shift = {"z": 0, "x": 1, "y": 2}[axis]
    return np.roll(np.eye(3), shift, axis=0)


# Grids -------------------------------------------------------------------------------------------


def _grid_faces(rows: int, columns: int, wrap: bool) -> Faces:
    """Triangulate a grid of vertices, outward for rows going up and columns counter-clockwise."""
    i, j = np.meshgrid(np.arange(rows - 1), np.arange(columns if wrap else columns - 1))
    i, j = i.T.ravel(), j.T.ravel()
    k = (j + 1) % columns
    a, b = i * columns + j, i * columns + k
    c, d = (i + 1) * columns + k, (i + 1) * columns + j
    return np.vstack([np.column_stack([a, b, c]), np.column_stack([a, c, d])])


def _tube(rings: Array) -> Mesh:
    """Close a stack of rings, shape (rows, columns, 3), with a fan at either end."""
    rows, columns, _ = rings.shape
    vertices = np.vstack([rings.reshape(-1, 3), rings[0].mean(axis=0), rings[-1].mean(axis=0)])
    j = np.arange(columns)
    k = (j + 1) % columns
    start, end, last = rows * columns, rows * columns + 1, (rows - 1) * columns
    bottom = np.column_stack([np.full(columns, start), k, j])
    top = np.column_stack([np.full(columns, end), last + j, last + k])
    return Mesh(vertices, np.vstack([_grid_faces(rows, columns, wrap=True), bottom, top]))


def clustered(start: float, end: float, count: int) -> Array:
    """Return `count` stations from start to end, denser towards both ends."""
    return start + (end - start) * 0.5 * (1.0 - np.cos(np.linspace(0.0, np.pi, count)))


# Lofted bodies -----------------------------------------------------------------------------------


@dataclass(frozen=True)
class Loft:
    r"""Body swept along z through superellipse sections.

    At height z the section is

    .. math:: |(x - c_x)/a|^n + |(y - c_y)/b|^n = 1.

    The centres c are interpolated through the rows, the half widths a and b through their squares,
    so that an end where they vanish comes out round.

    Attributes:
        rows: Station z and x_min, x_max, y_min, y_max there, shape (k, 5) [m].
        exponent: Superellipse exponent n, one number or one a row; 2 is an ellipse, more is boxier.
        axis: Axis that z is laid along by a cyclic permutation: for "x" a row reads x, y_min,
            y_max, z_min, z_max; for "y" it reads y, z_min, z_max, x_min, x_max.
    """

    rows: Array
    exponent: float | Sequence[float] = 3.0
    axis: str = "z"

    def section(self, z: Array) -> tuple[Array, Array, Array]:
        """Return centres (m, 2), half widths (m, 2) and exponents (m,) at the stations z."""
        rows = np.asarray(self.rows, float)
        low, high = rows[:, [1, 3]], rows[:, [2, 4]]
        centre = PchipInterpolator(rows[:, 0], 0.5 * (low + high))(z)
        squares = PchipInterpolator(rows[:, 0], (0.5 * (high - low)) ** 2)(z)
        exponents = np.broadcast_to(np.asarray(self.exponent, float), len(rows))
        return centre, np.sqrt(np.maximum(squares, 0.0)), np.interp(z, rows[:, 0], exponents)

    def points(self, z: ArrayLike, angle: ArrayLike) -> Array:
        """Return the surface points at heights z and section angles (broadcast)."""
        z, angle = np.broadcast_arrays(np.asarray(z, float), np.asarray(angle, float))
        centre, half, n = self.section(z.ravel())
        cosine, sine = np.cos(angle.ravel()), np.sin(angle.ravel())
        # The superellipse in polar form keeps the points evenly spread around the corners.
        radius = (np.abs(cosine) ** n + np.abs(sine) ** n) ** (-1.0 / n)
        xy = centre + half * np.column_stack([cosine, sine]) * radius[:, None]
        points = np.column_stack([xy, z.ravel()]) @ axis_rotation(self.axis).T
        result: Array = points.reshape(*z.shape, 3)
        return result

    def ends(self) -> tuple[float, float]:
        """Return the first and the last station."""
        return float(self.rows[0][0]), float(self.rows[-1][0])

    def mesh(self, stations: int = 24, segments: int = 36) -> Mesh:
        """Return the closed surface with `stations` rings of `segments` points."""
        z = clustered(*self.ends(), stations)[:, None]
        angle = np.linspace(-np.pi, np.pi, segments, endpoint=False)[None, :]
        return _tube(self.points(z, angle))


def cushion(
    base: Loft,
    cover: Loft,
    z_range: tuple[float, float],
    angles: tuple[float, float],
    shape: tuple[int, int] = (20, 20),
) -> Mesh:
    """Return a pad with rolled edges between a body and a cover around it.

    Args:
        base: Body that the pad sits on; the rim of the pad sinks a little below its surface.
        cover: Surface that the middle of the pad follows.
        z_range: Stations where the pad begins and ends [m].
        angles: Section angles where the pad begins and ends [rad].
        shape: Number of grid points along and across.
    """
    a = np.sin(0.5 * np.pi * np.linspace(-1.0, 1.0, shape[0]))[:, None]
    b = np.sin(0.5 * np.pi * np.linspace(-1.0, 1.0, shape[1]))[None, :]
    # Map the square [-1, 1]^2 to one with rounded corners, then to stations and angles.
    along, across = a * np.sqrt(1.0 - 0.25 * b**2), b * np.sqrt(1.0 - 0.25 * a**2)
    z = np.mean(z_range) + 0.5 * np.diff(z_range) * along
    angle = np.mean(angles) + 0.5 * np.diff(angles) * across
    height = np.minimum(1.0 - np.abs(a) ** 10, 1.0 - np.abs(b) ** 10) ** 0.5
    floor, roof = base.points(z, angle), cover.points(z, angle)
    inward = floor.mean(axis=1, keepdims=True) - floor
    floor = floor + RIM_DEPTH * inward / np.linalg.norm(inward, axis=-1, keepdims=True)
    return _capped_patch(floor + height[..., None] * (roof - floor))


def _capped_patch(points: Array) -> Mesh:
    """Close a grid of points, shape (rows, columns, 3), by a fan over its rim."""
    rows, columns, _ = points.shape
    index = np.arange(rows * columns).reshape(rows, columns)
    rim = np.concatenate([index[0, :-1], index[:-1, -1], index[-1, :0:-1], index[:0:-1, 0]])
    vertices = points.reshape(-1, 3)
    vertices = np.vstack([vertices, vertices[rim].mean(axis=0)])
    fan = np.column_stack([np.roll(rim, -1), rim, np.full(len(rim), rows * columns)])
    return Mesh(vertices, np.vstack([_grid_faces(rows, columns, wrap=False), fan]))


# Turned bodies -----------------------------------------------------------------------------------


def lathe(outline: ArrayLike, segments: int = 48, axis: str = "y") -> Mesh:
    """Turn an outline of (station, radius) pairs about an axis; the ends are closed by fans.

    Stations may go back, as in a recess: the surface lies to the right of the direction of travel.
    """
    outline = np.asarray(outline, float)
    angle = np.linspace(0.0, 2.0 * np.pi, segments, endpoint=False)
    ring = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(segments)])
    rings = outline[:, 1, None, None] * ring + outline[:, 0, None, None] * np.array([0.0, 0.0, 1.0])
    return _tube(rings).moved(axis_rotation(axis))


def disc(
    centre: ArrayLike,
    axis: str,
    half_length: float,
    radius: float,
    edge: float = 0.0006,
    segments: int = 36,
) -> Mesh:
    """Return a cylinder with chamfered edges about `axis` through `centre` [m]."""
    outline = [
        (-half_length, radius - edge),
        (-half_length + edge, radius),
        (half_length - edge, radius),
        (half_length, radius - edge),
    ]
    return lathe(outline, segments, axis).moved(np.eye(3), centre)


# Convex hulls ------------------------------------------------------------------------------------


def turned_solid(outline: ArrayLike, sides: int, axis: str = "y") -> Mesh:
    """Return the convex solid over rings of (station, radius) pairs: polygons half a sagitta outside the circles.

    Its surface is then within half the sagitta, radius (1 - cos(pi / sides)) / 2, of what the outline's chords turn to.
    """
    outline = np.asarray(outline, float) * (1.0, 2.0 / (1.0 + np.cos(np.pi / sides)))
    return hull_mesh(lathe(outline, sides, axis).vertices)


def hull_mesh(points: ArrayLike) -> Mesh:
    """Return the convex hull of points, rounded as in files."""
    return _hull_mesh(np.unique(np.round(np.asarray(points, float), COORDINATE_DECIMALS), axis=0))


def convex_hull(points: ArrayLike, max_vertices: int = 60) -> Mesh:
    """Return a convex mesh over the outermost of the points, chosen farthest first.

    The hull of the chosen points leaves others out; each vertex is then pushed outwards by a share
    of the largest gap around it, so that the surface lies partly inside, partly outside the hull.

    Args:
        points: Points to cover, shape (n, 3) [m].
        max_vertices: Upper bound on the number of vertices.
    """
    points = np.unique(np.round(np.asarray(points, float), COORDINATE_DECIMALS), axis=0)
    chosen = sorted({int(pick(points[:, k])) for k in range(3) for pick in (np.argmin, np.argmax)})
    while True:
        hull = ConvexHull(points[chosen])
        # Rounded, so that the choice between equals does not hang on the last bits.
        heights = np.round(points @ hull.equations[:, :3].T + hull.equations[:, 3], 8)
        gaps = heights.max(axis=1)
        if len(chosen) >= max_vertices or gaps.max() < HULL_GAP:
            break
        chosen.append(int(np.argmax(gaps)))
    facet_gaps = np.zeros(len(hull.simplices))
    np.maximum.at(facet_gaps, heights.argmax(axis=1), gaps)
    pushed = np.empty((len(chosen), 3))
    for vertex, place in enumerate(points[chosen]):
        around = np.any(hull.simplices == vertex, axis=1)
        normal = hull.equations[around, :3].sum(axis=0)
        pushed[vertex] = place + PUSH * facet_gaps[around].max() * normal / np.linalg.norm(normal)
    return _hull_mesh(np.round(pushed, COORDINATE_DECIMALS))


def _hull_mesh(points: Array) -> Mesh:
    """Return the hull of a few points with outward faces and no unused vertex."""
    hull = ConvexHull(points)
    order = np.unique(hull.simplices)
    index = np.full(len(points), -1)
    index[order] = np.arange(len(order))
    vertices, faces = points[order], index[hull.simplices]
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    outward = np.einsum("ij,ij->i", np.cross(b - a, c - a), hull.equations[:, :3]) > 0.0
    faces = np.where(outward[:, None], faces, faces[:, ::-1])
    first = np.argmin(faces, axis=1)
    faces = np.array([np.roll(face, -k) for face, k in zip(faces, first, strict=True)])
    return Mesh(vertices, faces[np.lexsort(faces.T[::-1])].astype(np.int64))


# Files -------------------------------------------------------------------------------------------


def _corner_normals(mesh: Mesh, crease: float) -> Array:
    """Return a unit normal for each face corner, averaged within the crease angle [rad]."""
    corners = mesh.vertices[mesh.faces]
    weighted = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    unit = weighted / np.linalg.norm(weighted, axis=1, keepdims=True)
    around: list[list[int]] = [[] for _ in mesh.vertices]
    for face, triple in enumerate(mesh.faces):
        for vertex in triple:
            around[vertex].append(face)
    normals = np.empty_like(corners)
    for face, triple in enumerate(mesh.faces):
        for corner, vertex in enumerate(triple):
            near = np.array(around[vertex])
            near = near[unit[near] @ unit[face] > np.cos(crease)]
            total = weighted[near].sum(axis=0)
            normals[face, corner] = total / np.linalg.norm(total)
    return normals


def cleaned(mesh: Mesh) -> Mesh:
    """Round the coordinates, weld equal vertices and drop faces without area."""
    rounded = np.round(mesh.vertices, COORDINATE_DECIMALS) + 0.0
    _, first, inverse = np.unique(rounded, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    vertices, faces = rounded[first[order]], rank[inverse.ravel()[mesh.faces]]
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    return Mesh(vertices, faces[area > 1e-12])


def write_obj(path: Path, mesh: Mesh, crease: float | None = 0.7) -> None:
    """Write a mesh as OBJ, with vertex normals unless `crease` is None.

    Args:
        path: File to write.
        mesh: Mesh to write.
        crease: Angle between faces above which an edge stays sharp [rad].
    """
    mesh = cleaned(mesh)
    lines = [f"o {path.stem}"]
    lines += ["v " + " ".join(f"{x:.{COORDINATE_DECIMALS}f}" for x in v) for v in mesh.vertices]
    if crease is None:
        lines += ["f " + " ".join(str(k + 1) for k in face) for face in mesh.faces]
    else:
        normals = np.round(_corner_normals(mesh, crease), NORMAL_DECIMALS) + 0.0
        unique, inverse = np.unique(normals.reshape(-1, 3), axis=0, return_inverse=True)
        lines += ["vn " + " ".join(f"{x:.{NORMAL_DECIMALS}f}" for x in n) for n in unique]
        pairs = zip(mesh.faces, inverse.reshape(-1, 3) + 1, strict=True)
        lines += ["f " + " ".join(f"{k + 1}//{n}" for k, n in zip(f, m, strict=True)) for f, m in pairs]
    path.write_text("\n".join(lines) + "\n", encoding="ascii", newline="\n")


def write_all(folder: Path, visual: dict[str, Callable[[], Mesh]], collision: dict[str, Callable[[], Mesh]]) -> None:
    """Build and write named meshes: visual ones with normals, convex collision ones without."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, build in visual.items():
        write_obj(folder / f"{name}.obj", build())
    for name, build in collision.items():
        write_obj(folder / f"{name}.obj", build(), crease=None)
