"""Collision shapes that one may sink into by a given depth, which coal has for convex shapes alone.

Most meshes of fingertips and objects are convex, or nearly: a mesh that bounds a convex solid becomes that solid. One
that does not, such as a bowl, stays a mesh; whatever may sink into it by a depth is made thinner by that depth instead.
For balls that is the same. Sharp corners may sink in deeper: a layer off two faces takes more off their edge.

Hulls with many corners are thinned to some of these corners, see :mod:`graspatlas.collision.hulls`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from graspatlas import _core
from graspatlas.collision.hulls import MANY_POINTS, corners_of_hull, hull_of, mesh_volume, shallow_volume
from graspatlas.errors import GraspAtlasError
from graspatlas.support.arrays import Array, Int32Array

__all__ = ["Shape", "convex_hull", "convex_solid", "read_shapes", "thinner"]

#: A mesh is convex when it has the volume of its hull but for this share.
CONVEX = 1e-3
#: A point is well inside a solid when its distances from the faces differ by no more than this factor.
DEEP = 1e-2


@dataclass(frozen=True, eq=False)
class Shape:
    """A collision shape, and what carries it.

    Attributes:
        kind: ``"sphere"``, ``"capsule"``, ``"cylinder"`` or ``"box"`` about the origin, with its axis along z;
            ``"convex"`` or ``"mesh"``; ``"half_space"`` is all that lies at z <= 0.
        sizes: Radius; radius and distance of the ends' centres; radius and length; edges [m].
        points: Corners of a convex solid or mesh (n, 3), metres.
        triangles: Corners of each triangle of a mesh (t, 3).
        name: Its name, that of its link with a number.
        link: The link that it belongs to.
        joint: Joint that carries it; 0 is the palm.
        parent_joint: The joint before that.
        placement: Of the shape in the joint (4, 4).
        error: How far a hull reaches beyond what is left of it after thinning [m].
    """

    kind: str
    sizes: Sequence[float] = (0.0, 0.0, 0.0)
    points: Array = field(default_factory=lambda: np.zeros((0, 3)))
    triangles: Int32Array = field(default_factory=lambda: np.zeros((0, 3), np.int32))
    name: str = ""
    link: str = ""
    joint: int = 0
    parent_joint: int = 0
    placement: Array = field(default_factory=lambda: np.eye(4))
    error: float = 0.0

    @property
    def is_mesh(self) -> bool:
        """True for a mesh that counts as triangles, not as a convex solid."""
        return self.kind == "mesh"

    def as_tuple(self) -> tuple[str, str, Sequence[float], Array, Int32Array, int, Array]:
        """The shape as the core takes it."""
        return self.name, self.kind, self.sizes, self.points, self.triangles, self.joint, self.placement


def read_shapes(tree: str, urdf: str, package_dirs: Sequence[str]) -> list[Shape]:
    """Collision shapes of a URDF, as they are stated.

    Args:
        tree: Text of the URDF whose joints are counted.
        urdf: Text of the URDF whose shapes are read.
        package_dirs: Folders in which ``package://`` paths of meshes are looked up.

    Raises:
        GraspAtlasError: If something cannot be read.
    """
    return [Shape(**table) for table in _core.read_collision_shapes(tree, urdf, list(package_dirs))]


def convex_solid(shape: Shape) -> Shape:
    """The convex solid that a mesh bounds; the shape itself when it is not a mesh, or is not convex or not closed."""
    if shape.kind == "convex":
        return _hull_of(shape) or shape
    if not shape.is_mesh:
        return shape
    hull = convex_hull(shape)
    return hull if not hull.is_mesh and _is_convex(shape, hull) else shape


def convex_hull(shape: Shape) -> Shape:
    """Convex hull of a mesh; the shape itself when it is not a mesh, or so flat that it has no hull."""
    return (_hull_of(shape) or shape) if shape.is_mesh else shape


def thinner(shape: Shape, depth: float) -> Shape | None:
    """What is left of a convex shape when a layer is taken off: the points that are as deep inside as `depth`.

    Args:
        shape: Sphere, capsule, cylinder, box or convex solid; others come back as they are.
        depth: Thickness of the layer [m].

    Returns:
        The shape about the same origin, or None when nothing is left.
    """
    first, second, third = (float(size) for size in shape.sizes)
    if shape.kind == "sphere":
        return replace(shape, sizes=(first - depth, 0.0, 0.0)) if first > depth else None
    if shape.kind == "capsule":
        return replace(shape, sizes=(first - depth, second, 0.0)) if first > depth else None
    if shape.kind == "cylinder":
        left = first - depth, second - 2.0 * depth, 0.0
        return replace(shape, sizes=left) if min(left[:2]) > 0.0 else None
    if shape.kind == "box":
        sides = first - 2.0 * depth, second - 2.0 * depth, third - 2.0 * depth
        return replace(shape, sizes=sides) if min(sides) > 0.0 else None
    return _thinner_solid(shape, depth) if shape.kind == "convex" else shape


def _thinner_solid(shape: Shape, depth: float) -> Shape | None:
    """A convex solid whose faces are moved inwards."""
    try:
        planes = hull_of(shape.points).planes
        planes[:, 3] += depth
        inside = _point_inside(planes, shape.points.mean(axis=0))
        return None if inside is None else _hull_of(replace(shape, points=_corners_of_planes(planes, inside)))
    except GraspAtlasError:
        return None


def _point_inside(planes: Array, guess: Array) -> Array | None:
    """A point (3,) well inside the planes n x + b <= 0 (f, 4): the guess, or the deepest; None where there is none."""
    depths = -(planes[:, :3] @ guess + planes[:, 3])
    if depths.min() > DEEP * depths.max():
        return guess
    from scipy.optimize import linprog  # slow to import

    # The point that is deepest inside, and how deep: max d with n x + b + d <= 0.
    deepest = linprog([0, 0, 0, -1], np.c_[planes[:, :3], np.ones(len(planes))], -planes[:, 3], bounds=(None, None))
    return np.asarray(deepest.x[:3]) if deepest.success and deepest.x[3] > 0.0 else None


def _corners_of_planes(planes: Array, inside: Array) -> Array:
    """Corners (c, 3) of what lies below planes n x + b <= 0 (f, 4), round a point inside: faces of the dual hull."""
    distances = -(planes[:, :3] @ inside + planes[:, 3])
    dual = hull_of(planes[:, :3] / distances[:, None]).planes
    return np.asarray(inside - dual[:, :3] / dual[:, 3:])


def _hull_of(shape: Shape) -> Shape | None:
    """Convex hull of a shape's points, thinned where they are many; None when they have no volume."""
    try:
        corners, error = corners_of_hull(np.asarray(shape.points, float))
    except GraspAtlasError:
        return None
    error += shape.error
    return replace(shape, kind="convex", points=corners, triangles=np.zeros((0, 3), np.int32), error=error)


def _is_convex(mesh: Shape, hull: Shape) -> bool:
    """Whether a closed mesh fills its hull, but for the share CONVEX of its volume."""
    whole, filled = hull_of(hull.points), mesh_volume(mesh.points, mesh.triangles)
    if len(mesh.points) <= MANY_POINTS:
        volume = hull_of(mesh.points).volume
        return bool(abs(filled - volume) <= CONVEX * volume)
    # The exact hull of so many points takes seconds: count what lies below the surface of the thinned one.
    missing = shallow_volume(mesh.points, mesh.triangles, whole.planes)
    beyond = hull.error * whole.area
    return bool(missing <= CONVEX * whole.volume and abs(filled - whole.volume) <= CONVEX * whole.volume + beyond)
