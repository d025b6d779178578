"""A B-spline patch fitted to a region of a triangle mesh."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from graspatlas.errors import GraspAtlasError
from graspatlas.meshes.reading import AnyMesh, trimesh_library
from graspatlas.meshes.repair import Scale, repaired_triangles
from graspatlas.numerics.groups import linked_groups
from graspatlas.patches.base import Vector3, checked_length, checked_vector, placement
from graspatlas.patches.spline import BSpline, clamped_knots
from graspatlas.support.arrays import Array, BoolArray, IntArray
from graspatlas.support.validation import shown, whole

__all__ = ["FitReport", "patch_from_mesh"]

#: Degree of the fitted spline.
DEGREE = 3
#: Points along each side of the grid at which heights are read off the mesh.
SAMPLES = 65
#: Weight of the penalty on bends of the control net, beside that of the heights.
SMOOTHING = 1e-4
#: Normals of the region may turn by this much from that of the centre [rad]: 80 degrees.
LARGEST_TURN = np.radians(80.0)
#: The tangent plane is the mean of the faces within this share of the size, the more the nearer they are.
TANGENT_SHARE = 0.25
#: Two layers of the region over one point are one when they are no farther apart than this share of the size.
SAME_HEIGHT = 1e-3
#: Faces that turn too far are passed over where all of them have at most this share of the patch's area.
PASSED_OVER = 1e-3
#: How far outside a triangle a point still lies on it, in barycentric coordinates.
ON_EDGE = 1e-9


@dataclass(frozen=True)
class FitReport:
    """How well a patch fits the region of the mesh.

    Distances are measured along the normal of the tangent plane, so they are not below the true ones.

    Attributes:
        largest, rms: Largest and root-mean-square distance of the mesh from the patch [m].
        turn: Largest angle between the normals of the region and that of its centre [rad].
        faces: Number of triangles of the region.
    """

    largest: float
    rms: float
    turn: float
    faces: int

    def __str__(self) -> str:
        return (
            f"{self.faces} triangles, normals turn by {np.degrees(self.turn):.0f} degrees; distance "
            f"{1e3 * self.largest:.3g} mm at most, {1e3 * self.rms:.3g} mm rms"
        )


def patch_from_mesh(
    mesh: AnyMesh,
    center: ArrayLike,
    size: float | Sequence[float],
    *,
    scale: Scale = 1.0,
    u_axis: ArrayLike = (1.0, 0.0, 0.0),
    control_points: int = 12,
    tolerance: float = 0.02,
) -> tuple[BSpline, FitReport]:
    """Fit a B-spline patch to a triangle mesh around a point.

    The patch is the graph of a cubic spline over the tangent plane at the mesh's point nearest to the centre: u and v
    are the distances from that point along the plane [m], both from -size to size. The spline fits the heights of the
    mesh's faces over an even grid by least squares, with a small penalty on bends. The mesh is repaired first
    (:func:`graspatlas.meshes.repaired`), and slivers are passed over that are turned away and have a thousandth of the
    patch's area at most.

    Args:
        mesh: A file that trimesh reads (STL, OBJ, PLY, OFF, ...), or a ``trimesh.Trimesh``.
        center: Where, in the scaled mesh's frame (3,), within ``size`` of the mesh [m].
        size: How far the patch reaches from there along u and along v [m]: one number for both, or two.
        scale: From the mesh's unit to metres; one number, or three along x, y and z.
        u_axis: Direction of u, made parallel to the tangent plane.
        control_points: Number of control points along u and along v, at least 4.
        tolerance: Largest distance of the mesh from the patch, as a share of the size.

    Returns:
        The patch, with its outward normal that of the faces, and how well it fits.

    Raises:
        GraspAtlasError: If trimesh is not installed, an argument is wrong, or the region is not a graph over its
            tangent plane: it has a hole or an edge, is not a manifold, or turns by more than 80 degrees; or the patch
            misses the mesh by more than the tolerance.
    """
    half = _half(size)
    checked_length(tolerance, "tolerance")
    whole(control_points, "control_points", 4, SAMPLES)
    at, u_hint = checked_vector(center, "center"), checked_vector(u_axis, "u_axis", unit=True)
    repaired, _ = repaired_triangles(mesh, scale)
    corners, faces = repaired.vertices, repaired.faces
    nearest, origin, axes = _tangent_frame(corners[faces], np.array(at), half, u_hint)
    corners = (corners - origin) @ axes
    region = _region(corners, faces, nearest, half)
    region, turn = _facing(corners, region, half)
    ticks = [np.linspace(-h, h, SAMPLES) for h in half]
    heights = _heights(corners[region], ticks, half)
    knots = [clamped_knots(control_points, DEGREE, -float(h), float(h)) for h in half]
    net = _fitted(heights, ticks, knots)
    u, v = np.meshgrid(*ticks, indexing="ij")
    seen = corners[np.unique(region)]
    seen = seen[(np.abs(seen[:, :2]) <= half).all(axis=1)]
    gaps = np.abs(_gaps(net, knots, np.concatenate([np.column_stack([u.ravel(), v.ravel(), heights.ravel()]), seen])))
    report = FitReport(float(gaps.max()), float(np.sqrt(np.mean(gaps**2))), turn, len(region))
    if report.largest > tolerance * half.min():
        raise GraspAtlasError(
            f"the patch misses the mesh by {1e3 * report.largest:.3g} mm, more than {100 * tolerance:g} % of size "
            f"{half.min():g} m: choose a smaller size, more control_points or a larger tolerance"
        )
    # A spline whose control points lie over the means of its knots (Greville's abscissae) is the graph of its heights.
    means = [np.lib.stride_tricks.sliding_window_view(row[1:-1], DEGREE).mean(axis=1) for row in knots]
    u, v = np.meshgrid(*means, indexing="ij")
    points = np.stack([u, v, net], axis=-1) @ axes.T + origin
    rows = [tuple(map(float, row)) for row in knots]
    return BSpline(control_points=points, u_knots=rows[0], v_knots=rows[1], unit="m"), report


def _half(size: float | Sequence[float]) -> Array:
    """How far a patch reaches along u and v (2,)."""
    sides = list(size) if isinstance(size, Sequence | np.ndarray) and not isinstance(size, str) else [size, size]
    if len(sides) != 2:
        raise GraspAtlasError(f"size must be one length or two, along u and along v, got {shown(size)}")
    return np.array([checked_length(side, "size") for side in sides])


def _facing(corners: Array, region: IntArray, half: Array) -> tuple[IntArray, float]:
    """The region without slivers that are turned away, and the largest angle of a normal from that of the centre."""
    across = np.cross(*_edges(corners[region]))
    areas = np.linalg.norm(across, axis=1)
    turns = np.arccos(np.clip(across[:, 2] / areas, -1.0, 1.0))
    away = turns > LARGEST_TURN
    if 0.5 * areas[away].sum() <= PASSED_OVER * 4.0 * half[0] * half[1]:
        region, turns = region[~away], turns[~away]
    turn = float(turns.max())
    if turn > LARGEST_TURN:
        raise GraspAtlasError(
            f"the mesh turns by {np.degrees(turn):.0f} degrees within size {_stated(half)} m of the centre, at most "
            f"{np.degrees(LARGEST_TURN):.0f} are allowed: choose a smaller size"
        )
    return region, turn


def _stated(half: Array) -> str:
    """A size as it was stated."""
    return f"{half[0]:g}" if half[0] == half[1] else f"({half[0]:g}, {half[1]:g})"


def _edges(triangles: Array) -> tuple[Array, Array]:
    """The two edges from the first corner of triangles (n, 3, 3)."""
    return triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]


def _normals(triangles: Array) -> Array:
    """Unit normals of triangles (n, 3)."""
    across = np.cross(*_edges(triangles))
    return np.asarray(across / np.linalg.norm(across, axis=1, keepdims=True))


def _tangent_frame(triangles: Array, center: Array, half: Array, u_hint: Vector3) -> tuple[int, Array, Array]:
    """The face nearest to the centre, its nearest point (3,), and the axes of u, v and the normal there (3, 3)."""
    nearest_points = trimesh_library().triangles.closest_point(triangles, np.tile(center, (len(triangles), 1)))
    distances = np.linalg.norm(nearest_points - center, axis=1)
    nearest = int(np.argmin(distances))
    if distances[nearest] > half.max():
        raise GraspAtlasError(
            f"the mesh is {distances[nearest]:.3g} m away from the centre, farther than size {_stated(half)} m: "
            "correct center (metres, in the mesh's frame)"
        )
    origin = nearest_points[nearest]
    normals = _normals(triangles)
    nearness = 1.0 - (np.linalg.norm(nearest_points - origin, axis=1) / (TANGENT_SHARE * half.min())) ** 2
    near = (nearness > 0.0) & (normals @ normals[nearest] > np.cos(LARGEST_TURN))
    areas = np.linalg.norm(np.cross(*_edges(triangles[near])), axis=1)
    normal = (areas * nearness[near]) @ normals[near]
    T = placement((0.0, 0.0, 0.0), tuple(normal / np.linalg.norm(normal)), u_hint)
    return nearest, origin, np.column_stack([T[:3, 0], -T[:3, 2], T[:3, 1]])


def _region(corners: Array, faces: IntArray, nearest: int, half: Array) -> IntArray:
    """Faces (m, 3) over the square of the patch that hang together with the nearest one, checked to be a manifold."""
    over = np.flatnonzero(_overlapping(corners[faces][:, :, :2], half))
    directed = faces[over][:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    edges = np.unique(np.sort(directed, axis=1), axis=0, return_inverse=True)[1].reshape(-1)
    owners = np.repeat(np.arange(len(over)), 3)
    order = np.argsort(edges, kind="stable")
    same = np.flatnonzero(np.diff(edges[order]) == 0)
    groups = linked_groups(len(over), np.column_stack([owners[order][same], owners[order][same + 1]]))
    mine = groups == groups[np.searchsorted(over, nearest)]
    directed = directed[np.repeat(mine, 3)]
    if len(np.unique(directed, axis=0)) < len(directed):
        raise GraspAtlasError(
            "the mesh is not a manifold within size of the centre: an edge has three faces, or neighbouring faces turn "
            "different ways; repair the mesh"
        )
    return np.asarray(faces[over[mine]])


def _overlapping(triangles: Array, half: Array) -> BoolArray:
    """Which triangles of the plane (n, 3, 2) overlap the square: those that no side of either separates from it."""
    apart = (triangles.min(axis=1) > half).any(axis=1) | (triangles.max(axis=1) < -half).any(axis=1)
    for i in range(3):
        side = triangles[:, (i + 1) % 3] - triangles[:, i]
        across = np.column_stack([-side[:, 1], side[:, 0]])
        along = np.einsum("nkd,nd->nk", triangles, across)
        reach = np.abs(across) @ half
        apart |= (along.min(axis=1) > reach) | (along.max(axis=1) < -reach)
    return np.asarray(~apart)


def _heights(triangles: Array, ticks: list[Array], half: Array) -> Array:
    """Heights of the triangles over a grid of points of the tangent plane (SAMPLES, SAMPLES)."""
    heights = np.full((SAMPLES, SAMPLES), np.nan)
    least, most = triangles[:, :, :2].min(axis=1) - ON_EDGE * half, triangles[:, :, :2].max(axis=1) + ON_EDGE * half
    low = np.column_stack([np.searchsorted(row, least[:, i]) for i, row in enumerate(ticks)])
    high = np.column_stack([np.searchsorted(row, most[:, i]) for i, row in enumerate(ticks)])
    for triangle, (i0, j0), (i1, j1) in zip(triangles, low, high, strict=True):
        if i0 == i1 or j0 == j1:
            continue
        u, v = np.meshgrid(ticks[0][i0:i1], ticks[1][j0:j1], indexing="ij")
        (a, b), h = (triangle[1:, :2] - triangle[0, :2]), triangle[:, 2]
        area = a[0] * b[1] - a[1] * b[0]
        du, dv = u - triangle[0, 0], v - triangle[0, 1]
        s, t = (du * b[1] - dv * b[0]) / area, (dv * a[0] - du * a[1]) / area
        inside = (s >= -ON_EDGE) & (t >= -ON_EDGE) & (s + t <= 1.0 + ON_EDGE)
        found = h[0] + s * (h[1] - h[0]) + t * (h[2] - h[0])
        part = heights[i0:i1, j0:j1]
        if (np.abs(part - found)[inside] > SAME_HEIGHT * half.max()).any():
            raise GraspAtlasError("the mesh folds over itself within size of the centre: choose a smaller size")
        part[inside] = found[inside]
    if np.isnan(heights).any():
        share = 100.0 * np.isnan(heights).mean()
        raise GraspAtlasError(
            f"the mesh has an edge or a hole within size {_stated(half)} m of the centre ({share:.2g} % of the patch "
            "is empty): choose a smaller size or another center"
        )
    return heights


def _fitted(heights: Array, ticks: list[Array], knots: list[Array]) -> Array:
    """Heights of the control net (n, n): least squares along u and along v, with a penalty on second differences."""
    along, across = (_smoother(x, row) for x, row in zip(ticks, knots, strict=True))
    return np.asarray(along @ heights @ across.T)


def _smoother(x: Array, knots: Array) -> Array:
    """The control values (n, m) that fit values at m parameters."""
    A = _basis(x, knots)
    D = np.diff(np.eye(A.shape[1]), 2, axis=0)
    return np.linalg.solve(A.T @ A + SMOOTHING * D.T @ D, A.T)


def _basis(x: Array, knots: Array) -> Array:
    """Values of the B-splines (m, n) at parameters x (m,)."""
    from scipy.interpolate import BSpline as SplineBasis  # slow to import

    return np.asarray(SplineBasis.design_matrix(x, knots, DEGREE).toarray())


def _gaps(net: Array, knots: list[Array], points: Array) -> Array:
    """Heights of points (u, v, height) (n, 3) over the spline (n,)."""
    u, v = (_basis(points[:, i], knots[i]) for i in range(2))
    return np.asarray(points[:, 2] - np.einsum("ni,ij,nj->n", u, net, v))
