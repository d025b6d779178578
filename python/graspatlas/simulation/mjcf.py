"""Elements of MJCF, MuJoCo's format of scenes: numbers, poses, shapes, joints."""

from __future__ import annotations

from collections.abc import Iterable
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from graspatlas.collision.shapes import Shape
from graspatlas.numerics.rotations import quaternions_from_matrices
from graspatlas.support.arrays import Array

__all__ = ["add_inertial", "add_shape", "child", "pose", "text"]

#: Smallest mass and moment of inertia of a body, those of a fingertip: descriptions often leave them out, and contacts
#: of lighter bodies are soft in MuJoCo [kg, kg m2].
LIGHTEST, SMALLEST_INERTIA = 0.02, 2e-6


def child(parent: Element, tag: str, **attributes: str) -> Element:
    """A new element in another."""
    return SubElement(parent, tag, attributes)


def text(numbers: Iterable[float]) -> str:
    """Numbers as an attribute; as short as their values allow."""
    return " ".join(f"{float(value):.15g}" for value in numbers)


def pose(T: Array) -> dict[str, str]:
    """Attributes of a pose (4, 4)."""
    x, y, z, w = quaternions_from_matrices(T[:3, :3])[0]
    return {"pos": text(T[:3, 3]), "quat": text((w, x, y, z))}


def add_shape(body: Element, assets: Element, shape: Shape, name: str, T: Array, **attributes: str) -> None:
    """Add a collision shape to a body: a primitive, or a convex solid by its corners.

    Args:
        body: The body.
        assets: Where meshes are listed.
        shape: The shape; not a mesh that is not convex.
        name: Its name in the scene.
        T: Its pose in the body (4, 4).
        **attributes: More attributes of the geom.
    """
    first, second, third = (float(size) for size in shape.sizes)
    sizes = {
        "sphere": [first],
        "capsule": [first, 0.5 * second],
        "cylinder": [first, 0.5 * second],
        "box": [0.5 * first, 0.5 * second, 0.5 * third],
    }.get(shape.kind)
    if sizes is not None:
        what = {"type": shape.kind, "size": text(sizes)}
    else:
        child(assets, "mesh", name=name, vertex=text(np.ravel(shape.points)))
        what = {"type": "mesh", "mesh": name}
    child(body, "geom", name=name, **what, **pose(T), **attributes)


def add_inertial(body: Element, mass: float, center: Array, inertia: Array) -> None:
    """State mass [kg], centre of mass (3,) [m] and inertia about it (3, 3) [kg m2] of a body, none of them too small.

    An inertia that no body can have, as rough descriptions state, is replaced by the nearest one that is a ball's.
    """
    moments = np.linalg.eigvalsh(inertia)
    possible = moments[0] > SMALLEST_INERTIA and moments[0] + moments[1] >= moments[2]
    if not possible:
        inertia = max(float(moments.mean()), SMALLEST_INERTIA) * np.eye(3)
    entries = inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    child(body, "inertial", mass=text([max(mass, LIGHTEST)]), pos=text(center), fullinertia=text(entries))
