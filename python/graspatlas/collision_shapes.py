"""Collision shapes that one may sink into by a given depth, which coal has for convex shapes alone.

Most meshes of fingertips and objects are convex, or nearly: a mesh that bounds a convex solid becomes that solid. One
that does not, such as a bowl, stays a mesh; whatever may sink into it by a depth is made thinner by that depth instead.
For balls that is the same. Sharp corners may sink in deeper: a layer off two faces takes more off their edge.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog
from scipy.spatial import ConvexHull, HalfspaceIntersection, QhullError

__all__ = ["convex_hull", "convex_solid", "is_mesh", "thinner"]

#: A mesh is convex when it has the volume of its hull but for this share.
CONVEX = 1e-3


def is_mesh(shape: Any) -> bool:
    """True for a mesh that coal knows as triangles, not as a convex solid."""
    import coal

    return isinstance(shape, coal.BVHModelBase)


def convex_solid(shape: Any) -> Any:
    """The convex solid that a mesh bounds; the shape itself when it is no mesh, or is not convex or not closed."""
    if not is_mesh(shape):
        return shape
    hull = convex_hull(shape)
    if is_mesh(hull) or abs(abs(shape.computeVolume()) - hull.computeVolume()) > CONVEX * hull.computeVolume():
        return shape
    return hull


def convex_hull(shape: Any) -> Any:
    """Convex hull of a mesh; the shape itself when it is no mesh, or so flat that it has no hull."""
    return _hull_of(shape.vertices(), shape) if is_mesh(shape) else shape


def thinner(shape: Any, depth: float) -> Any | None:
    """What is left of a convex shape when a layer is taken off: the points that are as deep inside as `depth`.

    Args:
        shape: Sphere, capsule, cylinder, box or convex solid; others come back as they are.
        depth: Thickness of the layer [m].

    Returns:
        The shape about the same origin, or None when nothing is left.
    """
    import coal

    if isinstance(shape, coal.Sphere):
        return coal.Sphere(shape.radius - depth) if shape.radius > depth else None
    if isinstance(shape, coal.Capsule):
        return coal.Capsule(shape.radius - depth, 2.0 * shape.halfLength) if shape.radius > depth else None
    if isinstance(shape, coal.Cylinder):
        left = shape.radius - depth, 2.0 * (shape.halfLength - depth)
        return coal.Cylinder(*left) if min(left) > 0.0 else None
    if isinstance(shape, coal.Box):
        sides = 2.0 * (np.asarray(shape.halfSide) - depth)
        return coal.Box(*map(float, sides)) if sides.min() > 0.0 else None
    if isinstance(shape, coal.ConvexBase):
        return _thinner_solid(shape, depth)
    return shape


def _thinner_solid(shape: Any, depth: float) -> Any | None:
    """A convex solid whose faces are moved inwards."""
    planes = ConvexHull(np.array([shape.point(i) for i in range(shape.num_points)])).equations  # n x + b <= 0
    planes[:, 3] += depth
    # The point that is deepest inside, and how deep: max d with n x + b + d <= 0.
    deepest = linprog([0, 0, 0, -1], np.c_[planes[:, :3], np.ones(len(planes))], -planes[:, 3], bounds=(None, None))
    if not deepest.success or deepest.x[3] <= 0.0:
        return None
    return _hull_of(HalfspaceIntersection(planes, deepest.x[:3]).intersections, None)


def _hull_of(points: NDArray[np.float64], otherwise: Any) -> Any:
    """Convex hull of points [n, 3]; `otherwise` when they have no volume."""
    import coal

    try:
        hull = ConvexHull(np.asarray(points, float))
    except (QhullError, ValueError):
        return otherwise
    corners = coal.StdVec_Vec3s()
    for corner in hull.points[hull.vertices]:
        corners.append(corner)
    return coal.Convex.convexHull(corners, True, "Qt")
