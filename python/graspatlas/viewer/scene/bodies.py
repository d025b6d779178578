"""Meshes of hand and object, read from their URDFs."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from graspatlas import _core
from graspatlas.errors import GraspAtlasError
from graspatlas.hand.body import Body
from graspatlas.hand.mesh_files import check_meshes
from graspatlas.problem.problem import Problem
from graspatlas.support.arrays import Array
from graspatlas.viewer.scene.meshes import Mesh, from_shape
from graspatlas.viewer.scene.stick_figure import Shape, bones, outlines

__all__ = ["BodyShapes"]


@dataclass(frozen=True, eq=False)
class _Part:
    """A mesh of a body: the link that carries it, its placement there and at rest in the root (4, 4), its colour."""

    mesh: Mesh
    link: str
    T_link_shape: Array
    T_root_shape: Array
    colour: tuple[float, float, float, float]


class BodyShapes:
    """Meshes of a problem's hand and object; each file is read once. What has none is sketched.

    Args:
        problem: The problem.

    Raises:
        GraspAtlasError: If a mesh cannot be read.
    """

    def __init__(self, problem: Problem) -> None:
        self._problem = problem
        self._files: dict[tuple[str | float, ...], Mesh | None] = {}
        self._hand = self._read(problem.hand)
        self._object = self._read(problem.object)

    def hand(self, q: Array) -> Iterator[Shape]:
        """The hand at joint configuration q (nq,)."""
        if not self._hand:
            return bones(self._problem, q)
        placements = self._problem.hand.link_placements(q)
        return ((part.mesh, placements[part.link] @ part.T_link_shape, part.colour) for part in self._hand)

    @property
    def has_hand(self) -> bool:
        """Whether the hand has meshes, and is not sketched."""
        return bool(self._hand)

    def carried(self) -> Iterator[tuple[Mesh, int, Array, tuple[float, float, float, float]]]:
        """Meshes of the hand, the joint that carries each (0 is the palm), its placement there, and its colour."""
        for part in self._hand:
            joint, T_joint_link = self._problem.hand.frame(part.link)
            yield part.mesh, joint, T_joint_link @ part.T_link_shape, part.colour

    def object(self) -> Iterator[Shape]:
        """The object in its own frame."""
        if not self._object:
            return outlines(self._problem)
        return ((part.mesh, part.T_root_shape, part.colour) for part in self._object)

    def _read(self, body: Body) -> list[_Part]:
        """The meshes of a body; its collision shapes where it has no visual ones."""
        check_meshes(body)
        try:
            tables = _core.read_visual_shapes(body.tree, body.urdf, list(body.package_dirs))
        except GraspAtlasError as error:
            raise GraspAtlasError(
                f"cannot show '{body.name}' ({body.urdf_path or 'URDF text'}): {' '.join(str(error).split())} "
                f"(package:// paths are looked up in {', '.join(body.package_dirs) or 'no folder'}); "
                "correct the path, or save the mesh as OBJ or STL"
            ) from None
        parts = []
        for table in tables:
            mesh = self._mesh(table)
            if mesh is not None:
                red, green, blue, opacity = map(float, table["colour"])
                at = (table["link"], table["in_link"], table["at_rest"])
                parts.append(_Part(mesh, *at, (red, green, blue, opacity)))
        return parts

    def _mesh(self, table: dict[str, Any]) -> Mesh | None:
        shape = (table["kind"], table["sizes"], table["points"], table["triangles"])
        if table["kind"] != "mesh":
            return from_shape(*shape)
        key = (table["file"], *table["scale"])
        if key not in self._files:
            self._files[key] = from_shape(*shape)
        return self._files[key]
