"""Meshes of hand, object and obstacles as a page carries them: one for each joint and colour, and what may fade."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator

import numpy as np

from graspatlas.collision.clash import Clash
from graspatlas.problem.problem import Problem
from graspatlas.support.arrays import Array
from graspatlas.support.validation import PlainTable
from graspatlas.viewer.explorer.numbers import Numbers
from graspatlas.viewer.scene.bodies import BodyShapes
from graspatlas.viewer.scene.clashing import in_stripes, names_of
from graspatlas.viewer.scene.meshes import Mesh, merged
from graspatlas.viewer.scene.scene import Colour
from graspatlas.viewer.scene.stick_figure import sticks
from graspatlas.world.obstacle import FRAMES

__all__ = ["write_clash", "write_shapes"]

#: A mesh, the joint that carries it (0 is the palm, or the object), its placement there (4, 4), its colour, and whether
#: it gives way to shapes that collide.
Carried = tuple[Mesh, int, Array, Colour, bool]


def write_shapes(problem: Problem, shapes: BodyShapes, numbers: Numbers, clash: Clash | None) -> PlainTable:
    """Write the meshes.

    Args:
        problem: The problem.
        shapes: Its meshes.
        numbers: Where to.
        clash: Shapes that collide in a grasp of the page.

    Returns:
        ``hand`` and ``object``, lists of a mesh's number, joint and colour, and whether it ``fades`` where these shapes
        are shown; ``obstacles``, such lists by the frame that they are fixed to; and ``sticks``: of a hand without
        meshes the bones, from a point of one joint to a point of another, their radius, and that of the joints [m].
    """
    table: PlainTable = {"sticks": None}
    if shapes.has_hand:
        links = names_of(clash, "hand")
        table["hand"] = _write(numbers, "hand", ((m, j, T, c, link in links) for link, m, j, T, c in shapes.carried()))
    else:
        table["hand"], table["sticks"] = [], sticks(problem)
    fades = bool(names_of(clash, "object"))
    table["object"] = _write(numbers, "object", ((mesh, 0, T, colour, fades) for mesh, T, colour in shapes.object()))
    table["obstacles"] = {
        frame: _write(numbers, f"on_{frame}", _obstacles(problem, shapes, frame, names_of(clash, "obstacle")))
        for frame in FRAMES
    }
    return table


def _obstacles(problem: Problem, shapes: BodyShapes, frame: str, fading: Collection[str]) -> Iterator[Carried]:
    for obstacle in problem.obstacles:
        for mesh, T, colour in shapes.obstacles(frame, [obstacle.name]):
            yield mesh, 0, T, colour, obstacle.name in fading


def write_clash(clash: Clash, shapes: BodyShapes, numbers: Numbers, width: float) -> list[PlainTable]:
    """Write shapes that collide, in stripes of some width [m].

    Returns:
        Of each mesh its name, colour, what it is ``on``: ``hand``, ``object`` or ``obstacle``, and its joint.
    """
    rows: list[PlainTable] = []
    for i, (group, joint, (mesh, T, colour)) in enumerate(in_stripes(clash, shapes, width)):
        (row,) = _write(numbers, f"clash_{i}", [(mesh, joint, T, colour, False)])
        rows.append({**row, "on": group})
    return rows


def _write(numbers: Numbers, name: str, carried: Iterable[Carried]) -> list[PlainTable]:
    """Write what one joint carries in one colour as one mesh."""
    groups: dict[tuple[int, Colour, bool], list[Mesh]] = {}
    for mesh, joint, T, colour, fades in carried:
        groups.setdefault((joint, colour, fades), []).append(mesh.moved(T))
    rows: list[PlainTable] = []
    for i, ((joint, colour, fades), meshes) in enumerate(groups.items()):
        whole = merged(meshes)
        key = f"{name}_{i}"
        numbers.add_rounded(f"{key}_vertices", whole.vertices)
        numbers.add(f"{key}_normals", np.round(127.0 * whole.normals).astype(np.int8))
        small = len(whole.vertices) < 2**16
        numbers.add(f"{key}_faces", whole.faces.astype(np.uint16 if small else np.uint32))
        rows.append({"mesh": key, "joint": joint, "colour": list(colour), "fades": fades})
    return rows
