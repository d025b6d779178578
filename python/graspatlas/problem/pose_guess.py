"""A guess of where the hand holds the object, from which the search for a first grasp starts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from graspatlas.errors import GraspAtlasError
from graspatlas.problem.object_joint import PLANAR
from graspatlas.support.validation import PlainTable, StatedTable, checked_table, number_array, numbers
from graspatlas.world.pose import LARGEST, unit_quaternion

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

__all__ = ["PoseGuess"]


@dataclass(frozen=True)
class PoseGuess:
    """About where the object is in the palm's frame when it is held.

    Attributes:
        xyz: Position of the object's origin [m].
        quat_xyzw: Its rotation; normalised. None where any rotation will do.
    """

    xyz: Sequence[float]
    quat_xyzw: Sequence[float] | None = None

    def __post_init__(self) -> None:
        xyz = number_array(self.xyz, "xyz of the pose guess")
        if xyz.shape != (3,) or not (np.abs(xyz) < LARGEST).all():
            raise GraspAtlasError(f"xyz of the pose guess must be 3 finite numbers, got {self.xyz}")
        if self.quat_xyzw is not None:
            object.__setattr__(self, "quat_xyzw", unit_quaternion(self.quat_xyzw, "the pose guess"))

    def check_in_plane(self) -> None:
        """Make sure that the guess lies in the palm's x-y plane, turned about z only.

        Raises:
            GraspAtlasError: If it does not.
        """
        if not PLANAR.allows(self.xyz, self.quat_xyzw or (0.0, 0.0, 0.0, 1.0)):
            raise GraspAtlasError(
                "the object moves in the x-y plane, so 'pose_guess' must lie there: z = 0, and turned about z only"
            )

    def offset(self, xyz: ArrayLike, rotation: Rotation) -> tuple[float, float]:
        """How far a pose is from the guess: distance [m], and angle [rad], 0 where any rotation will do.

        Args:
            xyz: Position (3,), metres.
            rotation: Rotation.
        """
        from scipy.spatial.transform import Rotation  # slow to import

        distance = float(np.linalg.norm(np.asarray(xyz) - self.xyz))
        if self.quat_xyzw is None:
            return distance, 0.0
        return distance, float((rotation * Rotation.from_quat(self.quat_xyzw).inv()).magnitude())

    def to_dict(self) -> PlainTable:
        """The guess as plain data."""
        table: PlainTable = {"xyz": list(self.xyz)}
        return table if self.quat_xyzw is None else {**table, "quat_xyzw": list(self.quat_xyzw)}

    @classmethod
    def from_dict(cls, data: StatedTable) -> PoseGuess:
        """The guess that :meth:`to_dict` described.

        Raises:
            GraspAtlasError: If something is missing or wrong.
        """
        table = checked_table(data, "the pose guess", ("xyz",), ("quat_xyzw",))
        quaternion = table.get("quat_xyzw")
        return cls(
            xyz=numbers(table["xyz"], "xyz of the pose guess"),
            quat_xyzw=None if quaternion is None else numbers(quaternion, "quat_xyzw of the pose guess"),
        )
