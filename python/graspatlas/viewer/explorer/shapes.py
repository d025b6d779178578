"""Meshes of hand, object and obstacles as a page carries them: one for each joint and colour."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from graspatlas.problem.problem import Problem
from graspatlas.support.arrays import Array
from graspatlas.support.validation import PlainTable
from graspatlas.viewer.explorer.numbers import Numbers
from graspatlas.viewer.scene.bodies import BodyShapes
from graspatlas.viewer.scene.meshes import Mesh, merged
from graspatlas.viewer.scene.scene import Colour
from graspatlas.viewer.scene.stick_figure import sticks
from graspatlas.world.obstacle import FRAMES

__all__ = ["write_shapes"]

#: A mesh, the joint that carries it (0 is the palm, or the object), its placement there (4, 4) and its colour.
Carried = tuple[Mesh, int, Array, Colour]


def write_shapes(problem: Problem, shapes: BodyShapes, numbers: Numbers) -> PlainTable:
    """Write the meshes.

    Args:
        problem: The problem.
        shapes: Its meshes.
        numbers: Where to.

    Returns:
        ``hand`` and ``object``, lists of a mesh's number, joint and colour, ``obstacles``, such lists by the frame that
        they are fixed to, and ``sticks``: of a hand without meshes
        the bones, from a point of one joint to a point of another, their radius, and that of the joints [m].
    """
    table: PlainTable = {"sticks": None}
    if shapes.has_hand:
        table["hand"] = _write(numbers, "hand", shapes.carried())
    else:
        table["hand"], table["sticks"] = [], sticks(problem)
    table["object"] = _write(numbers, "object", ((mesh, 0, T, colour) for mesh, T, colour in shapes.object()))
    table["obstacles"] = {
        frame: _write(numbers, f"on_{frame}", ((mesh, 0, T, colour) for mesh, T, colour in shapes.obstacles(frame)))
        for frame in FRAMES
    }
    return table


def _write(numbers: Numbers, name: str, carried: Iterable[Carried]) -> list[PlainTable]:
    """Write what one joint carries in one colour as one mesh."""
    groups: dict[tuple[int, Colour], list[Mesh]] = {}
    for mesh, joint, T, colour in carried:
        groups.setdefault((joint, colour), []).append(mesh.moved(T))
    rows: list[PlainTable] = []
    for i, ((joint, colour), meshes) in enumerate(groups.items()):
        whole = merged(meshes)
        key = f"{name}_{i}"
        numbers.add_rounded(f"{key}_vertices", whole.vertices)
        numbers.add(f"{key}_normals", np.round(127.0 * whole.normals).astype(np.int8))
        small = len(whole.vertices) < 2**16
        numbers.add(f"{key}_faces", whole.faces.astype(np.uint16 if small else np.uint32))
        rows.append({"mesh": key, "joint": joint, "colour": list(colour)})
    return rows
