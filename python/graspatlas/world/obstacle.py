"""Obstacles: what a hand must not touch beside the object, such as the table that the object stands on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from graspatlas.errors import GraspAtlasError
from graspatlas.hand.body import Body
from graspatlas.hand.robot_files import find_file
from graspatlas.hand.urdf import mesh_urdf, moving_joints
from graspatlas.support.arrays import Array
from graspatlas.support.pickling import Light
from graspatlas.support.validation import (
    PlainTable,
    StatedTable,
    checked_instance,
    checked_table,
    number_array,
    numbers,
    positive,
    shown,
)
from graspatlas.world.pose import LARGEST, Pose

__all__ = ["FRAMES", "Obstacle"]

#: What an obstacle may be fixed to.
FRAMES = ("object", "palm")
#: Normals of planes are longer than this, whatever their unit.
SHORTEST = 1e-9
#: At the origin, and not turned.
THERE = Pose()


@dataclass(frozen=True)
class Obstacle(Light):
    """A thing that the hand must not touch: a body, or all that lies below a plane.

    It takes part wherever collisions are looked at, by :class:`graspatlas.CollisionFree`: no shape of the hand may be
    nearer to it than the clearance, those that carry a contact neither. One in the object's frame moves with the
    object, as a table on which it stands does, seen from the palm; the object may touch it. One in the palm's frame,
    such as a camera or a flange, is fixed to the hand: neither the links that move nor the object may touch it.

    Attributes:
        name: Its name.
        body: The body; None for a plane.
        normal: Of a plane, out of the obstacle, in the obstacle's frame (3,); normalised.
        frame: What it is fixed to: ``"object"`` or ``"palm"``.
        pose: Where its own frame is there; a plane goes through its origin.
    """

    name: str
    body: Body | None = None
    normal: Sequence[float] | None = None
    frame: Literal["object", "palm"] = "object"
    pose: Pose = THERE

    def __post_init__(self) -> None:
        if not isinstance(self.name, str) or not self.name.strip():
            raise GraspAtlasError(f"an obstacle needs a name, such as 'table'; got {shown(self.name)}")
        what = f"obstacle '{self.name}'"
        checked_instance(self.body, (Body, type(None)), f"body of {what}", "Obstacle.box")
        checked_instance(self.pose, Pose, f"pose of {what}")
        if self.frame not in FRAMES:
            raise GraspAtlasError(
                f"frame of {what} must be 'object' or 'palm', what it is fixed to; got {shown(self.frame)}"
            )
        if (self.body is None) is (self.normal is None):
            raise GraspAtlasError(
                f"{what} is either a body or a plane with a normal; make it by Obstacle.box or .plane"
            )
        if self.normal is not None:
            object.__setattr__(self, "normal", _unit_normal(self.normal, what))
        elif self.body is not None and (joints := moving_joints(self.body.urdf)):
            raise GraspAtlasError(
                f"{what} has the moving joint '{joints[0]}', but obstacles stand still: make it fixed"
            )

    @property
    def T_frame_shape(self) -> Array:
        """Where the body is in the frame that it is fixed to, or a frame on the plane whose z is its normal (4, 4)."""
        T = np.array(self.pose.matrix)
        if self.normal is not None:
            z = np.asarray(self.normal)
            x = np.cross(np.eye(3)[int(np.argmin(np.abs(z)))], z)
            x /= np.linalg.norm(x)
            T[:3, :3] = T[:3, :3] @ np.column_stack([x, np.cross(z, x), z])
        return T

    @classmethod
    def plane(
        cls,
        name: str,
        point: Sequence[float],
        normal: Sequence[float] = (0.0, 0.0, 1.0),
        frame: Literal["object", "palm"] = "object",
    ) -> Obstacle:
        """All that lies on the one side of a plane.

        Args:
            name: Its name.
            point: A point of the plane (3,), metres.
            normal: Its normal (3,), out of the obstacle.
            frame: ``"object"`` or ``"palm"``.

        Raises:
            GraspAtlasError: If one of them is wrong.
        """
        return cls(name, normal=normal, frame=frame, pose=Pose(point))

    @classmethod
    def box(
        cls,
        name: str,
        size: Sequence[float],
        pose: Pose = THERE,
        frame: Literal["object", "palm"] = "object",
    ) -> Obstacle:
        """A box about the origin of its frame, with edges (3,) [m]; see :class:`Obstacle`."""
        edges = number_array(size, f"size of obstacle '{name}'")
        if edges.shape != (3,):
            raise GraspAtlasError(f"size of obstacle '{name}' must be 3 lengths [m], got {shown(size)}")
        return cls(
            name,
            Body.box(name, [positive(float(edge), f"size of obstacle '{name}'") for edge in edges]),
            None,
            frame,
            pose,
        )

    @classmethod
    def sphere(
        cls,
        name: str,
        radius: float,
        pose: Pose = THERE,
        frame: Literal["object", "palm"] = "object",
    ) -> Obstacle:
        """A sphere about the origin of its frame, with a radius [m]; see :class:`Obstacle`."""
        return cls(name, Body.sphere(name, positive(radius, f"radius of obstacle '{name}'")), None, frame, pose)

    @classmethod
    def cylinder(
        cls,
        name: str,
        radius: float,
        length: float,
        pose: Pose = THERE,
        frame: Literal["object", "palm"] = "object",
    ) -> Obstacle:
        """A cylinder about the origin of its frame along z, radius and length [m]; see :class:`Obstacle`."""
        sizes = positive(radius, f"radius of obstacle '{name}'"), positive(length, f"length of obstacle '{name}'")
        return cls(name, Body.cylinder(name, *sizes), None, frame, pose)

    @classmethod
    def mesh(
        cls,
        name: str,
        path: str | Path,
        scale: float | Sequence[float] = 1.0,
        pose: Pose = THERE,
        frame: Literal["object", "palm"] = "object",
    ) -> Obstacle:
        """A mesh of a file (OBJ, STL, DAE).

        Args:
            name: Its name.
            path: The file.
            scale: From the mesh's unit to metres, such as 0.001.
            pose: Where the mesh's frame is.
            frame: ``"object"`` or ``"palm"``.

        Raises:
            GraspAtlasError: If there is no such file, or something is wrong.
        """
        return cls(name, mesh_body(name, find_file(path, None), scale), None, frame, pose)

    def to_dict(self) -> PlainTable:
        """The obstacle as plain data, with the text of its URDF."""
        table: PlainTable = {} if self.body is None else self.body.to_dict()
        if self.normal is not None:
            table["plane"] = {"normal": list(self.normal)}
        return {**table, "name": self.name, "frame": self.frame, **self.pose.to_dict()}

    @classmethod
    def from_dict(cls, data: StatedTable, folder: Path | None = None) -> Obstacle:
        """The obstacle that :meth:`to_dict` described.

        Args:
            data: ``name``, ``frame``, ``xyz``, ``quat_xyzw``, and ``plane`` or what states a body.
            folder: Where relative paths of URDFs start.

        Raises:
            GraspAtlasError: If something is missing or wrong.
        """
        table = dict(checked_table(data, "an obstacle", ("name",), None))
        pose = Pose.from_dict({k: table.pop(k) for k in ("xyz", "quat_xyzw") if k in table}, "an obstacle")
        name, frame, plane = str(table["name"]), table.pop("frame", "object"), table.pop("plane", None)
        if plane is None:
            return cls(name, Body.from_dict(table, folder), None, frame, pose)
        checked_table(table, f"obstacle '{name}', a plane,", ("name",))
        stated = checked_table(plane, "plane", (), ("normal",)).get("normal", (0.0, 0.0, 1.0))
        return cls(name, None, numbers(stated, "normal of the plane"), frame, pose)


def mesh_body(name: str, path: Path, scale: float | Sequence[float]) -> Body:
    """The body of one mesh file.

    Args:
        name: Its name.
        path: The file, which exists.
        scale: From the mesh's unit to metres: one number, or three.
    """
    path = path.resolve()
    scales = [scale] * 3 if isinstance(scale, int | float) else list(scale)
    folder = str(path.parent.parent)
    urdf = mesh_urdf(name, f"package://{path.parent.name}/{path.name}", scales)
    return Body(name, urdf, package_dirs=(folder,), package_paths=(folder,))


def _unit_normal(normal: Sequence[float], what: str) -> tuple[float, ...]:
    array = number_array(normal, f"normal of {what}")
    if array.shape != (3,) or not (np.abs(array) < LARGEST).all():
        raise GraspAtlasError(f"normal of {what} must be 3 finite numbers, such as [0, 0, 1]; got {shown(normal)}")
    length = float(np.linalg.norm(array))
    if length < SHORTEST:
        raise GraspAtlasError(f"normal of {what} has the length 0; let it point out of the obstacle, such as [0, 0, 1]")
    length = 1.0 if abs(length - 1.0) < 1e-12 else length
    return tuple(float(c) / length for c in array)
