"""Meshes of hand, object, obstacles and arm, read from their URDFs."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from graspatlas import _core
from graspatlas.errors import GraspAtlasError
from graspatlas.grasps.grasp import Grasp
from graspatlas.hand.body import Body
from graspatlas.hand.embedded_meshes import mesh_folders
from graspatlas.hand.mesh_files import check_meshes
from graspatlas.hand.urdf import without_visuals
from graspatlas.problem.problem import Problem
from graspatlas.support.arrays import Array
from graspatlas.viewer.scene.meshes import Mesh, box, from_shape
from graspatlas.viewer.scene.stick_figure import Shape, bones, outlines

__all__ = ["BodyMeshes", "BodyShapes"]

#: Red, green, blue and opacity of obstacles.
OBSTACLE = (0.36, 0.50, 0.62, 0.30)
#: Opacity of what stands back behind something else that is shown.
FADED = 0.16
#: The same of arms.
ARM = (0.62, 0.66, 0.72, 0.35)
#: Side of the plates that stand for planes, as a multiple of the object's diagonal; their thickness as a share of that.
PLATE, THIN = 1.2, 0.01


@dataclass(frozen=True, eq=False)
class _Part:
    """A mesh of a body: the link that carries it, its placement there and at rest in the root (4, 4), its colour."""

    mesh: Mesh
    link: str
    T_link_shape: Array
    T_root_shape: Array
    colour: tuple[float, float, float, float]


class BodyMeshes:
    """Meshes of a body; each file is read once. Those of its collision shapes where it has no visual ones.

    Args:
        body: The body.

    Attributes:
        parts: The meshes, each on its link.

    Raises:
        GraspAtlasError: If a mesh cannot be read.
    """

    def __init__(self, body: Body) -> None:
        self._files: dict[tuple[str | float, ...], Mesh | None] = {}
        self.parts = self._read(body)

    def on_links(self, placements: Mapping[str, Array], faded: Collection[str] = ()) -> Iterator[Shape]:
        """The meshes with the links at some placements (4, 4), those of some links faded."""
        for part in self.parts:
            colour = (*part.colour[:3], FADED) if part.link in faded else part.colour
            yield part.mesh, placements[part.link] @ part.T_link_shape, colour

    def at_rest(self) -> Iterator[Shape]:
        """The meshes with all joints at 0, in the frame of the root."""
        return ((part.mesh, part.T_root_shape, part.colour) for part in self.parts)

    def _read(self, body: Body) -> list[_Part]:
        check_meshes(body)
        try:
            tables = _core.read_visual_shapes(body.tree, body.urdf, list(mesh_folders(body)))
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


class BodyShapes:
    """Meshes of a problem's hand, object and obstacles. A hand or object that has none is sketched.

    Args:
        problem: The problem.

    Raises:
        GraspAtlasError: If a mesh cannot be read.
    """

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self._hand, self._object = BodyMeshes(problem.hand), BodyMeshes(problem.object)
        self._obstacles: dict[str, BodyMeshes] = {}

    def hand(self, q: Array, faded: Collection[str] = ()) -> Iterator[Shape]:
        """The hand at joint configuration q (nq,), some of its links faded."""
        if not self._hand.parts:
            return bones(self.problem, q)
        return self._hand.on_links(self.problem.hand.link_placements(q), faded)

    @property
    def has_hand(self) -> bool:
        """Whether the hand has meshes, and is not sketched."""
        return bool(self._hand.parts)

    def carried(self) -> Iterator[tuple[str, Mesh, int, Array, tuple[float, float, float, float]]]:
        """Link and mesh of the hand, the joint that carries it (0 is the palm), its placement there, and its colour."""
        for part in self._hand.parts:
            joint, T_joint_link = self.problem.hand.frame(part.link)
            yield part.link, part.mesh, joint, T_joint_link @ part.T_link_shape, part.colour

    def object(self) -> Iterator[Shape]:
        """The object in its own frame."""
        return self._object.at_rest() if self._object.parts else outlines(self.problem)

    def obstacles(self, frame: str, names: Collection[str] | None = None) -> Iterator[Shape]:
        """The obstacles that are fixed to the ``"object"`` or the ``"palm"``, there; of planes a plate below them.

        Args:
            frame: What they are fixed to.
            names: Only those of these names; all by default.
        """
        for obstacle in self.problem.obstacles:
            if obstacle.frame != frame or (names is not None and obstacle.name not in names):
                continue
            T = obstacle.T_frame_shape
            if obstacle.body is None:
                yield box([self._plate, self._plate, THIN * self._plate]), T @ _sunk(0.5 * THIN * self._plate), OBSTACLE
                continue
            if obstacle.name not in self._obstacles:
                self._obstacles[obstacle.name] = BodyMeshes(obstacle.body)
            for mesh, T_body_mesh, _ in self._obstacles[obstacle.name].at_rest():
                yield mesh, T @ T_body_mesh, OBSTACLE

    def arm(self, grasp: Grasp) -> Iterator[Shape]:
        """The arm that brings the hand to a grasp, in the palm's frame; nothing where there is none, or none is found.

        Its posture is that of :meth:`graspatlas.Grasp.arm_positions`, and its meshes are those of its collision shapes,
        which have a tenth of the triangles.
        """
        arm = self.problem.arm
        if arm is None:
            return
        try:
            positions = grasp.arm_positions()
        except GraspAtlasError:  # not to be reached, or of no collision shape, which is no reason to draw nothing
            return
        T_palm_base = grasp.T_palm_object @ np.linalg.inv(arm.T_base_object)
        placements = arm.robot.link_placements(arm.robot.configuration(positions))
        for mesh, T, _ in self._arm.on_links(placements):
            yield mesh, T_palm_base @ T, ARM

    @cached_property
    def _arm(self) -> BodyMeshes:
        assert self.problem.arm is not None
        robot = self.problem.arm.robot
        return BodyMeshes(replace(robot, urdf=without_visuals(robot.urdf)))

    @cached_property
    def _plate(self) -> float:
        """Side of the plates that stand for planes [m]."""
        points = np.concatenate([mesh.moved(T).vertices for mesh, T, _ in self.object()])
        return PLATE * float(np.linalg.norm(np.ptp(points, axis=0)))


def _sunk(depth: float) -> Array:
    """The placement (4, 4) of what lies deeper by so much [m]."""
    T = np.eye(4)
    T[2, 3] = -depth
    return T
