"""Where one frame is in another, as problem files state it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from graspatlas.errors import GraspAtlasError
from graspatlas.numerics.rotations import matrix_from_quaternion
from graspatlas.support.arrays import Array
from graspatlas.support.validation import (
    PlainTable,
    StatedTable,
    checked_table,
    number_array,
    numbers,
    read_only,
    shown,
)

__all__ = ["LARGEST", "Pose", "Quaternion", "unit_quaternion"]

Quaternion = tuple[float, float, float, float]

#: Numbers of a pose are smaller [rad or m]: larger ones are mistakes, and their squares may overflow.
LARGEST = 1e9


@dataclass(frozen=True)
class Pose:
    """A position and a rotation.

    Attributes:
        xyz: Position of the inner frame's origin in the outer one [m].
        quat_xyzw: Its rotation; normalised.
    """

    xyz: Sequence[float] = (0.0, 0.0, 0.0)
    quat_xyzw: Sequence[float] = (0.0, 0.0, 0.0, 1.0)

    def __post_init__(self) -> None:
        xyz = number_array(self.xyz, "xyz of a pose")
        if xyz.shape != (3,) or not (np.abs(xyz) < LARGEST).all():
            raise GraspAtlasError(f"xyz of a pose must be 3 finite numbers [m], got {shown(self.xyz)}")
        object.__setattr__(self, "xyz", tuple(float(c) for c in xyz))
        object.__setattr__(self, "quat_xyzw", unit_quaternion(self.quat_xyzw, "a pose"))

    @property
    def matrix(self) -> Array:
        """The pose as a transform (4, 4), which maps coordinates of the inner frame to the outer one."""
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = matrix_from_quaternion(self.quat_xyzw), self.xyz
        return read_only(T)

    def to_dict(self) -> PlainTable:
        """The pose as plain data."""
        return {"xyz": list(self.xyz), "quat_xyzw": list(self.quat_xyzw)}

    @classmethod
    def from_dict(cls, data: StatedTable, what: str = "a pose") -> Pose:
        """The pose that :meth:`to_dict` described; at the origin, and not turned, where nothing is said.

        Args:
            data: ``xyz`` and ``quat_xyzw``, or one of them.
            what: Its name for messages.

        Raises:
            GraspAtlasError: If something is wrong.
        """
        table = checked_table(data, what, (), ("xyz", "quat_xyzw"))
        given = {name: numbers(table[name], f"{name} of {what}") for name in table if table[name] is not None}
        return cls(**given)


def unit_quaternion(quaternion: Sequence[float], what: str) -> Quaternion:
    """A quaternion (x, y, z, w) of length one.

    Args:
        quaternion: Of any other length.
        what: What has it, for messages.

    Raises:
        GraspAtlasError: If it is not four finite numbers, or zero.
    """
    array = number_array(quaternion, f"the quaternion of {what}")
    if array.shape != (4,) or not (np.abs(array) < LARGEST).all():
        raise GraspAtlasError(f"{what} needs a quaternion of 4 finite numbers, got {shown(quaternion)}")
    norm = float(np.linalg.norm(array))
    if norm < 1e-6:
        raise GraspAtlasError(f"{what} has a quaternion of length zero")
    # One that is unit to rounding stays as it came, so that a stored problem is the same problem.
    norm = 1.0 if abs(norm - 1.0) < 1e-12 else norm
    x, y, z, w = (float(c) / norm for c in quaternion)
    return (x, y, z, w)
