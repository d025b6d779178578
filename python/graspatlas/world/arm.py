"""Robot arms: what has to bring the hand to the object."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from graspatlas.errors import GraspAtlasError, unknown_name
from graspatlas.hand.hand import Hand
from graspatlas.hand.named_hands import named_hand
from graspatlas.hand.urdf import joints_on_way
from graspatlas.support.arrays import Array
from graspatlas.support.pickling import Light
from graspatlas.support.validation import PlainTable, StatedTable, checked_instance, checked_table, read_only, shown
from graspatlas.world.pose import Pose

__all__ = ["POSES", "Arm"]

#: At the origin, and not turned.
THERE = Pose()
#: The poses of an arm, by the names of its attributes.
POSES = ("palm", "base", "object")


@dataclass(frozen=True)
class Arm(Light):
    """A robot arm that carries the hand, and where it stands.

    The world's frame is anywhere: where only the base is placed, it is the object's frame. Joints of the robot that do
    not move the flange, such as those of wheels or of a second arm, are locked at 0, or as near to it as their limits
    are; ``robot.with_joints`` locks them elsewhere.

    Attributes:
        robot: The arm with its joints and limits; the root of its URDF is the base. Like a hand it is read from a file,
            and its SRDF lists the links that may touch.
        flange: The link that carries the hand, such as ``"tool0"``.
        palm: Pose of the palm, the root link of the hand's URDF, in the flange's frame.
        base: Pose of the base, the root link of the robot's URDF, in the world.
        object: Pose of the object, when it is grasped, in the world.

    Raises:
        GraspAtlasError: If the robot has no such link, or no joint that moves it; or if such a joint mimics another, or
            slides without limits.
    """

    robot: Hand
    flange: str
    palm: Pose = THERE
    base: Pose = THERE
    object: Pose = THERE

    def __post_init__(self) -> None:
        checked_instance(self.robot, Hand, "robot of an arm", "Arm.named or Hand.from_urdf")
        for name in POSES:
            checked_instance(getattr(self, name), Pose, f"{name} of arm '{self.name}'")
        if not isinstance(self.flange, str) or self.flange not in self.robot.frames:
            raise unknown_name("flange", self.flange, self.robot.frames, f"a link of arm '{self.name}'")
        self._check_joints()
        object.__setattr__(self, "robot", self._without_others())

    def __repr__(self) -> str:
        return f"<Arm {self.name!r}: {len(self.joints)} joints, flange {self.flange!r}>"

    @property
    def name(self) -> str:
        """Name of the robot."""
        return self.robot.name

    @cached_property
    def joints(self) -> tuple[str, ...]:
        """Names of the joints that move the flange, from the base on."""
        return joints_on_way(self.robot.urdf, self.flange)

    @property
    def T_base_object(self) -> Array:
        """Pose of the object in the base's frame (4, 4)."""
        return read_only(np.linalg.inv(self.base.matrix) @ self.object.matrix)

    @property
    def T_flange_palm(self) -> Array:
        """Pose of the palm in the flange's frame (4, 4)."""
        return self.palm.matrix

    @classmethod
    def named(
        cls,
        robot: str,
        flange: str,
        *,
        palm: Pose = THERE,
        base: Pose = THERE,
        object: Pose = THERE,
    ) -> Arm:
        """The arm that a word names.

        Args:
            robot: Path of a URDF or an MJCF, ``example_robot_data:NAME``, ``robot_descriptions:NAME``, or a name among
                these, such as ``"ur5_robot"``. An SRDF of the same name beside the URDF is read too.
            flange: See :class:`Arm`, as the others.
            palm: Pose of the palm in the flange's frame.
            base: Pose of the base in the world.
            object: Pose of the object in the world.

        Raises:
            GraspAtlasError: If there is no such robot, or something is wrong.
        """
        if not isinstance(robot, str):
            raise GraspAtlasError(f"an arm is named by a path or a name such as 'ur5_robot', got {shown(robot)}")
        return cls(named_hand(robot).hand, flange, palm, base, object)

    def to_dict(self) -> PlainTable:
        """The arm as plain data, with the text of its URDF."""
        poses = {name: getattr(self, name).to_dict() for name in POSES}
        return {**self.robot.to_dict(), "flange": self.flange, **poses}

    @classmethod
    def from_dict(cls, data: StatedTable, folder: Path | None = None) -> Arm:
        """The arm that :meth:`to_dict` described.

        Args:
            data: ``flange``, ``palm``, ``base``, ``object``, and what states a hand.
            folder: Where relative paths start.

        Raises:
            GraspAtlasError: If something is missing or wrong.
        """
        table: dict[str, Any] = dict(checked_table(data, "an arm", ("flange",), None))
        poses = {name: Pose.from_dict(table.pop(name), f"{name} of the arm") for name in POSES if name in table}
        flange = str(table.pop("flange"))
        return cls(Hand.from_dict(table, folder), flange, **poses)

    def _without_others(self) -> Hand:
        """The robot with the joints locked that do not move the flange."""
        limits = self.robot.limits_by_name
        others = [name for name in self.robot.mechanism.actuated if name not in self.joints]
        locked = self.robot.with_joints(locked={name: float(np.clip(0.0, *limits[name])) for name in others})
        for mimic in locked.mechanism.mimics:
            raise GraspAtlasError(
                f"joint '{mimic.joint}' of arm '{self.name}' mimics '{mimic.driver}', which moves the flange; that is "
                "not supported: make it fixed in the URDF"
            )
        return locked

    def _check_joints(self) -> None:
        """Raise GraspAtlasError unless inverse kinematics can move the joints on the way to the flange."""
        if not self.joints:
            raise GraspAtlasError(
                f"no joint moves the flange '{self.flange}' of arm '{self.name}'; name the link that carries the hand"
            )
        infos = {joint.name: joint for joint in self.robot.model.hand_joints}
        limits = self.robot.limits_by_name
        for name in self.joints:
            what = f"joint '{name}' of arm '{self.name}'"
            if infos[name].v_size != 1:
                raise GraspAtlasError(f"{what} has {infos[name].v_size} degrees of freedom, but each must have one")
            if name in self.robot.mechanism.followers:
                raise GraspAtlasError(f"{what} moves the flange and mimics another; that is not supported: lock both")
            if infos[name].prismatic and not np.isfinite(limits[name]).all():
                raise GraspAtlasError(f"{what} slides without limits: state some under limits")
