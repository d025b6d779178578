"""Contacts between hand and object (Section II of the paper)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from graspatlas import _core
from graspatlas.errors import GraspAtlasError, unknown_name
from graspatlas.patches.base import Patch
from graspatlas.patches.registry import patch_from_dict
from graspatlas.support.arrays import Array
from graspatlas.support.validation import PlainTable, StatedTable, checked_instance, checked_table, number

__all__ = ["Contact", "ContactSide"]


@dataclass(frozen=True)
class ContactSide:
    """One of the two patches of a contact, with the values of its parameters that do not move.

    Attributes:
        name: ``"hand"`` or ``"object"``.
        patch: The patch.
        frozen: Values by name of the parameters that do not move [rad or m].
    """

    name: str
    patch: Patch
    frozen: Mapping[str, float]

    @property
    def free(self) -> tuple[str, ...]:
        """Names of the parameters that move, in the order in which they stand in x."""
        return tuple(name for name in self.patch.parameters if name not in self.frozen)

    def values_of_free(self, point: tuple[float, float]) -> list[float]:
        """Values of the free parameters, from parameters (u, v) of the patch [rad or m]."""
        return [point["uv".index(name)] for name in self.free]

    def locate(self, point: ArrayLike) -> tuple[float, float]:
        """Parameters (u, v) nearest to a point (3,) of the body's frame, but for those that are frozen."""
        u, v = self.patch.locate(point)
        return float(self.frozen.get("u", u)), float(self.frozen.get("v", v))

    def core(self, joint: int, T_joint_body: Array, room: float = 0.0) -> _core.ContactSide:
        """The compiled side.

        Args:
            joint: Number of the joint that carries the body.
            T_joint_body: Placement of the body's frame in this joint (4, 4).
            room: Share of the interval of each parameter to keep off either of its ends.
        """
        parameters = []
        for name in ("u", "v"):
            free = name in self.free
            interval = self.patch.interval(name) if free else None
            low, high = interval or (-np.pi, np.pi)
            kept_off = room * (high - low) if np.isfinite(high - low) else 0.0
            value = float(self.frozen.get(name, 0.0))
            parameters.append(
                _core.PatchParameter(free, value, free and interval is None, low + kept_off, high - kept_off)
            )
        return _core.ContactSide(joint, T_joint_body, self.patch.core(), *parameters)


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
        for side in reversed(self.sides):
            patch = side.patch
            checked_instance(patch, Patch, f"the {side.name}'s side of a contact", "graspatlas.patches")
            for name, value in checked_table(side.frozen, "frozen", (), None).items():
                if name not in patch.parameters:
                    raise unknown_name("parameter", name, patch.parameters, f"one of a {patch.kind} patch's")
                if not np.isfinite(number(value, f"frozen parameter '{name}'")):
                    raise GraspAtlasError(f"parameter '{name}' is frozen at {value}; it must be finite")

    def __repr__(self) -> str:
        return f"<Contact of {self.frame!r}: {self.hand.kind} on {self.object.kind}>"

    @property
    def sides(self) -> tuple[ContactSide, ContactSide]:
        """The hand's side and the object's, in the order in which their parameters stand in x."""
        return (
            ContactSide("hand", self.hand, self.hand_frozen),
            ContactSide("object", self.object, self.frozen),
        )

    def free(self) -> list[tuple[Patch, str]]:
        """Patches and names of the free parameters, in the order in which they stand in x."""
        return [(side.patch, name) for side in self.sides for name in side.free]

    def to_dict(self) -> PlainTable:
        """The contact as plain data."""
        return {
            "frame": self.frame,
            "hand": self.hand.to_dict(),
            "object": self.object.to_dict(),
            "frozen": dict(self.frozen),
            "hand_frozen": dict(self.hand_frozen),
        }

    @classmethod
    def from_dict(cls, data: StatedTable) -> Contact:
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
