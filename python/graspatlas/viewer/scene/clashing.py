"""Two shapes that collide as they are drawn: in red and white stripes, in place of the bodies that they belong to."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from graspatlas.collision.clash import Clash
from graspatlas.collision.hulls import hull_of
from graspatlas.collision.shapes import Shape
from graspatlas.support.arrays import Array, BoolArray
from graspatlas.viewer.scene.bodies import BodyShapes
from graspatlas.viewer.scene.meshes import Mesh, from_shape, smooth
from graspatlas.viewer.scene.stick_figure import Shape as Drawn

__all__ = ["RED", "STRIPES", "WHITE", "WIDTH", "in_stripes", "names_of", "striped"]

#: Colours of the stripes, which do not only differ in hue: red, green, blue, opacity.
RED = (0.84, 0.05, 0.09, 1.0)
WHITE = (0.99, 0.95, 0.93, 1.0)
STRIPES = (RED, WHITE)
#: Opacity of the stripes of obstacles.
CLEAR = 0.4
#: Width of a stripe [m], and the most stripes of each colour across a shape.
WIDTH, MOST_STRIPES = 0.005, 40
#: Direction across the stripes.
ACROSS = np.array([2.0, 1.0, 2.0]) / 3.0
#: A corner this near to the edge of a stripe lies on it, as a share of its width.
ON_EDGE = 1e-6


def in_stripes(clash: Clash, shapes: BodyShapes, width: float = WIDTH) -> Iterator[tuple[str, int, Drawn]]:
    """The two shapes that collide, in stripes: each with its group, in the frame of the joint that carries it.

    Of an obstacle all of it is drawn, and see-through, as elsewhere.

    Args:
        clash: The shapes.
        shapes: Meshes of the problem.
        width: Width of the stripes [m].

    Yields:
        ``hand``, ``object`` or ``obstacle``; the joint, 0 for the palm; and what is drawn.
    """
    for shape, name, group in zip(clash.shapes, clash.names, clash.groups, strict=True):
        if group == "obstacle":
            frame = "palm" if shape.joint == 0 else "object"
            meshes = [mesh.moved(T) for mesh, T, _ in shapes.obstacles(frame, [name])]
        else:
            surface = _surface(shape)
            meshes = [] if surface is None else [surface.moved(shape.placement)]
        for part, colour in ((p, c) for mesh in meshes for p, c in zip(striped(mesh, width), STRIPES, strict=True)):
            if len(part.faces):
                yield group, shape.joint, (part, np.eye(4), (*colour[:3], CLEAR) if group == "obstacle" else colour)


def names_of(clash: Clash | None, group: str) -> tuple[str, ...]:
    """What collides of the ``hand``, the ``object`` or the ``obstacle``: links or names."""
    if clash is None:
        return ()
    return tuple(name for name, its in zip(clash.names, clash.groups, strict=True) if its == group)


def striped(mesh: Mesh, width: float = WIDTH) -> tuple[Mesh, Mesh]:
    """A mesh cut into two: every other stripe of it, and those between.

    Args:
        mesh: The mesh.
        width: Width of the stripes [m]; wider ones where there would be very many.
    """
    along = mesh.vertices @ ACROSS
    width = max(width, float(np.ptp(along)) / (2.0 * MOST_STRIPES))
    corners = np.concatenate([mesh.vertices, mesh.normals], axis=1)[mesh.faces]  # (f, 3, 6): where, and its normal
    lowest, highest = (int(np.floor(end / width)) for end in (along.min(), along.max()))
    for level in range(lowest + 1, highest + 1):
        corners = _cut(corners, level * width, ON_EDGE * width)
    odd = np.floor(corners[:, :, :3].mean(axis=1) @ ACROSS / width).astype(int) % 2 == 1
    return _mesh(corners[~odd]), _mesh(corners[odd])


def _surface(shape: Shape) -> Mesh | None:
    """The mesh of a shape in its own frame."""
    if shape.kind != "convex":
        return from_shape(shape.kind, shape.sizes, shape.points, shape.triangles)
    hull = hull_of(np.asarray(shape.points, float))
    middle = hull.points[hull.corners].mean(axis=0)
    a, b, c = (hull.points[corner] for corner in hull.triangles.T)
    inside_out = np.einsum("nc,nc->n", np.cross(b - a, c - a), a - middle) < 0.0
    return smooth(hull.points, np.where(inside_out[:, None], hull.triangles[:, ::-1], hull.triangles))


def _cut(corners: Array, level: float, tolerance: float) -> Array:
    """Triangles (f, 3, 6) cut along a plane, so that each lies on one side of it; their turn is kept."""
    heights = corners[:, :, :3] @ ACROSS - level
    crossed: BoolArray = (heights.min(axis=1) < -tolerance) & (heights.max(axis=1) > tolerance)
    return np.concatenate([corners[~crossed], *_pieces(corners[crossed], heights[crossed])])


def _pieces(corners: Array, heights: Array) -> Iterator[Array]:
    """The three pieces of triangles: the corner that is alone on its side, and the two halves of the rest."""
    if not len(corners):
        return
    above = heights > 0.0
    alone = np.argmax(above == (above.sum(axis=1) == 1)[:, None], axis=1)
    rows = np.arange(len(corners))
    a, b, c = (corners[rows, (alone + k) % 3] for k in range(3))
    height_a, height_b, height_c = (heights[rows, (alone + k) % 3][:, None] for k in range(3))
    on_b = a + height_a / (height_a - height_b) * (b - a)
    on_c = a + height_a / (height_a - height_c) * (c - a)
    for piece in ((a, on_b, on_c), (on_b, b, c), (on_b, c, on_c)):
        yield np.stack(piece, axis=1)


def _mesh(corners: Array) -> Mesh:
    """The mesh of triangles (f, 3, 6)."""
    rows, faces = np.unique(corners.reshape(-1, 6), axis=0, return_inverse=True)
    normals = rows[:, 3:] / np.maximum(np.linalg.norm(rows[:, 3:], axis=1, keepdims=True), 1e-12)
    return Mesh(rows[:, :3], normals, faces.reshape(-1, 3))
