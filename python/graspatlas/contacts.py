"""Contacts between hand and object, and a first grasp that fulfils them (Section II of the paper)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from graspatlas.errors import GraspAtlasError, unknown_name
from graspatlas.patches import Patch, patch_from_dict
from graspatlas.tables import checked_instance, checked_table, number, number_array, numbers

__all__ = ["Contact", "FirstGrasp"]

#: Numbers of a first grasp are smaller [rad or m]: larger ones are mistakes, and their squares may overflow.
LARGEST = 1e9


@dataclass(frozen=True)
class Contact:
    """Two patches that touch: their points coincide and their normals oppose, eqs (7) and (8).

    Attributes:
        frame: Link or frame of the hand that carries the hand's patch.
        hand: Patch in that frame; its normal points out of the hand.
        object: Patch in the object's frame; its normal points out of the object.
        frozen: Values of the parameters of the object's patch that do not move, such as ``{"u": 0.5}`` [rad or m].
        hand_frozen: The same for the hand's patch.
    """

    frame: str
    hand: Patch
    object: Patch
    frozen: Mapping[str, float] = field(default_factory=dict)
    hand_frozen: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        checked_instance(self.frame, str, "a contact's frame")
        for side, patch, frozen in (
            ("object", self.object, self.frozen),
            ("hand", self.hand, self.hand_frozen),
        ):
            checked_instance(patch, Patch, f"the {side}'s side of a contact", "graspatlas.patches")
            for name, value in checked_table(frozen, "frozen", (), None).items():
                if name not in patch.parameters:
                    raise unknown_name("parameter", name, patch.parameters, f"one of a {patch.kind} patch's")
                if not np.isfinite(number(value, f"frozen parameter '{name}'")):
                    raise GraspAtlasError(f"parameter '{name}' is frozen at {value}; it must be finite")

    def free(self) -> list[tuple[Patch, str]]:
        """Patches and names of the free parameters, in the order in which they stand in x."""
        sides = ((self.hand, self.hand_frozen), (self.object, self.frozen))
        return [(patch, name) for patch, frozen in sides for name in patch.parameters if name not in frozen]

    def to_dict(self) -> dict[str, Any]:
        """The contact as plain data."""
        return {
            "frame": self.frame,
            "hand": self.hand.to_dict(),
            "object": self.object.to_dict(),
            "frozen": dict(self.frozen),
            "hand_frozen": dict(self.hand_frozen),
        }

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Contact:
        """The contact that :meth:`to_dict` described.

        Raises:
            GraspAtlasError: If something is missing or wrong.
        """
        table = checked_table(data, "a contact", ("frame", "hand", "object"), ("frozen", "hand_frozen"))
        frozen, hand_frozen = (
            {
                name: number(value, f"frozen parameter '{name}'")
                for name, value in checked_table(table.get(key) or {}, key, (), None).items()
            }
            for key in ("frozen", "hand_frozen")
        )
        patches = [patch_from_dict(table[key]) for key in ("hand", "object")]
        return cls(str(table["frame"]), patches[0], patches[1], frozen, hand_frozen)


@dataclass(frozen=True)
class FirstGrasp:
    """A feasible grasp x1 from which the atlas grows.

    Attributes:
        joints: Joint positions by name [rad or m]; all of the hand's.
        object_xyz: Position of the object in the palm's frame [m].
        object_quat_xyzw: Its rotation; normalised.
        parameters: Free patch parameters in the order of x; found from the contact points when not given.
    """

    joints: Mapping[str, float]
    object_xyz: tuple[float, float, float] = (0.0, 0.0, 0.0)
    object_quat_xyzw: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0)
    parameters: tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        checked_table(self.joints, "x1's joints", (), None)
        joints = [number(value, f"joint '{name}' of x1") for name, value in self.joints.items()]
        xyz = number_array(self.object_xyz, "object_xyz")
        quaternion = number_array(self.object_quat_xyzw, "object_quat_xyzw")
        parameters = number_array(() if self.parameters is None else self.parameters, "the parameters of x1")
        if xyz.shape != (3,) or quaternion.shape != (4,) or parameters.ndim != 1:
            raise GraspAtlasError("x1 needs object_xyz of 3 numbers, object_quat_xyzw of 4 and a row of parameters")
        values = np.concatenate([joints, xyz, quaternion, parameters])
        if not (np.abs(values) < LARGEST).all():
            raise GraspAtlasError(f"x1 holds a number that is not finite, or not below {LARGEST:g}")
        norm = float(np.linalg.norm(quaternion))
        if norm < 1e-6:
            raise GraspAtlasError("x1 has a quaternion of length zero")
        # One that is unit to rounding stays as it came, so that a stored problem is the same problem.
        norm = 1.0 if abs(norm - 1.0) < 1e-12 else norm
        x, y, z, w = (float(c) / norm for c in self.object_quat_xyzw)
        object.__setattr__(self, "object_quat_xyzw", (x, y, z, w))

    def to_dict(self) -> dict[str, Any]:
        """The first grasp as plain data."""
        return {
            "joints": dict(self.joints),
            "object_xyz": list(self.object_xyz),
            "object_quat_xyzw": list(self.object_quat_xyzw),
            "parameters": None if self.parameters is None else list(self.parameters),
        }

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> FirstGrasp:
        """The first grasp that :meth:`to_dict` described.

        Raises:
            GraspAtlasError: If something is missing or wrong.
        """
        table = checked_table(data, "x1", ("joints", "object_xyz", "object_quat_xyzw"), ("parameters",))
        joints = checked_table(table["joints"], "x1's joints", (), None)
        parameters = table.get("parameters")
        return cls(
            joints={name: number(value, f"joint '{name}' of x1") for name, value in joints.items()},
            object_xyz=numbers(table["object_xyz"], "object_xyz"),  # type: ignore[arg-type]
            object_quat_xyzw=numbers(table["object_quat_xyzw"], "object_quat_xyzw"),  # type: ignore[arg-type]
            parameters=None if parameters is None else numbers(parameters, "parameters"),
        )
