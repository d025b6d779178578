"""Convex hulls of meshes with any number of corners, thinned to as many as collisions need."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from graspatlas import _core
from graspatlas.errors import GraspAtlasError
from graspatlas.support.arrays import Array, IndexArray, Int32Array

__all__ = ["Hull", "corners_of_hull", "hull_of", "mesh_volume", "shallow_volume"]

#: Hulls with at most this many corners stay as they are; coal's corners have at most 255 neighbours.
FEW_CORNERS = 250
#: Thinned hulls leave out at most this, and have at most so many corners; what is larger than a hand may lose more [m].
LARGEST_ERROR, MOST_CORNERS = 1e-4, 8000
#: A point this far above the corners that are left out is taken for a corner [m].
ENOUGH = 0.7 * LARGEST_ERROR
#: Of more points than this a sample decides at first: their exact hull takes seconds.
MANY_POINTS = 20000
#: Products of points and planes that are in memory at a time.
AT_A_TIME = 1 << 20


@dataclass(frozen=True, eq=False)
class Hull:
    """The convex hull of points.

    Attributes:
        points: The points (n, 3), metres.
        corners: Numbers of those that are corners, ascending [c].
        triangles: Its surface: numbers of points (t, 3).
        planes: Its faces (f, 4): unit outward normal n and b of n x + b <= 0.
    """

    points: Array
    corners: IndexArray
    triangles: Int32Array
    planes: Array

    @property
    def volume(self) -> float:
        """Its volume [m^3]."""
        a, b, c = (self.points[corner] - self.points[self.corners].mean(axis=0) for corner in self.triangles.T)
        return float(np.abs(np.einsum("nc,nc->n", np.cross(a, b), c)).sum()) / 6.0

    @property
    def area(self) -> float:
        """The area of its surface [m^2]."""
        a, b, c = (self.points[corner] for corner in self.triangles.T)
        return 0.5 * float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())


def hull_of(points: Array) -> Hull:
    """The convex hull of points (n, 3), by Qhull.

    Raises:
        GraspAtlasError: If they have no volume, are too few, or not numbers.
    """
    found = _core.convex_hull(points)
    return Hull(points, np.asarray(found["corners"], np.intp), found["triangles"], found["planes"])


def corners_of_hull(points: Array) -> tuple[Array, float]:
    """Corners of the convex hull of points, or of a hull inside it that is nearly as large.

    A hull with many corners is thinned: beginning with the outermost points, those that lie farthest outside are added
    until what is left out is within :data:`LARGEST_ERROR`.

    Args:
        points: The points (n, 3), metres.

    Returns:
        The corners (c, 3), and a distance within which all points are from their hull [m]: 0 where nothing was thinned.

    Raises:
        GraspAtlasError: If the points have no volume, are too few, or not numbers.
    """
    if len(points) <= MANY_POINTS:
        points = points[hull_of(points).corners]
        if len(points) <= FEW_CORNERS:
            return points, 0.0
    chosen = _chosen(points)
    # Beyond an edge or corner a point is farther away than it is above any face. More corners bring none farther away.
    distances = np.asarray(_core.distances_from_hull(points, points[chosen]))
    while distances.max() > LARGEST_ERROR and len(chosen) < MOST_CORNERS:
        far = np.flatnonzero(distances > LARGEST_ERROR)
        more = far[np.argsort(distances[far])[::-1][: 1 + len(far) // 4]]
        chosen = _corners(points, np.union1d(chosen, more))
        distances[far] = _core.distances_from_hull(points[far], points[chosen])
    return points[chosen], float(distances.max())


def _chosen(points: Array) -> IndexArray:
    """Numbers of the corners of a hull above the faces of which no point is high, of a sample of the points."""
    chosen, waiting = _outermost(points), np.arange(0, len(points), 1 + len(points) // MANY_POINTS)
    while True:
        hull = hull_of(points[chosen])
        chosen = chosen[hull.corners]
        waiting, more = _farthest(points, waiting, hull.planes)
        if len(more) == 0 or len(chosen) >= MOST_CORNERS:
            return np.asarray(chosen, np.intp)
        chosen = np.union1d(chosen, more)


def _corners(points: Array, chosen: IndexArray) -> IndexArray:
    """Those of the chosen points that are corners of their hull."""
    return np.asarray(chosen[hull_of(points[chosen]).corners], np.intp)


def _outermost(points: Array) -> IndexArray:
    """Numbers of the points that are outermost along the axes and the diagonals of a cube."""
    steps = np.array(np.meshgrid(*[[-1.0, 0.0, 1.0]] * 3)).reshape(3, -1).T
    found = np.unique((points @ steps[np.abs(steps).sum(axis=1) > 0.0].T).argmax(axis=0))
    try:
        hull_of(points[found])
    except GraspAtlasError:  # all in one plane, but the points are not
        return hull_of(points).corners
    return np.asarray(found, np.intp)


def _above(points: Array, planes: Array) -> tuple[Array, IndexArray]:
    """Height of each point above the plane that it is highest above (n,), negative inside, and that plane (n,)."""
    heights, highest = np.empty(len(points)), np.empty(len(points), np.intp)
    step = max(1, AT_A_TIME // len(planes))
    for start in range(0, len(points), step):
        part = points[start : start + step] @ planes[:, :3].T + planes[:, 3]
        highest[start : start + step] = part.argmax(axis=1)
        heights[start : start + step] = part.max(axis=1)
    return heights, highest


def _farthest(points: Array, waiting: IndexArray, planes: Array) -> tuple[IndexArray, IndexArray]:
    """Which of the waiting points still lie above faces, and of these the one that is highest above each face."""
    heights, highest = _above(points[waiting], planes)
    left = heights > ENOUGH
    waiting, heights, highest = waiting[left], heights[left], highest[left]
    order = np.lexsort((heights, highest))
    last = np.flatnonzero(np.diff(highest[order], append=-1))  # of each face
    return waiting, waiting[order[last]]


def mesh_volume(points: Array, triangles: Int32Array) -> float:
    """Volume that a closed mesh encloses [m^3]."""
    a, b, c = (points[corners] - points.mean(axis=0) for corners in triangles.T)
    return float(abs(np.einsum("nc,nc->n", np.cross(a, b), c).sum())) / 6.0


def shallow_volume(points: Array, triangles: Int32Array, planes: Array) -> float:
    """Volume between a mesh and the planes of a hull round it, where they are close [m^3]; from a sample."""
    step = 1 + len(triangles) // MANY_POINTS
    a, b, c = (points[corners] for corners in triangles[::step].T)
    areas = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
    depths = np.maximum(-_above((a + b + c) / 3.0, planes)[0], 0.0)
    return step * float(areas @ depths)
