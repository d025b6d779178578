"""Contacts between hand and object (Section II of the paper)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from graspatlas.errors import GraspAtlasError, unknown_name
from graspatlas.patches import Patch, patch_from_dict
from graspatlas.support.validation import checked_instance, checked_table, number

__all__ = ["Contact"]


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

    def __repr__(self) -> str:
        return f"<Contact of {self.frame!r}: {self.hand.kind} on {self.object.kind}>"

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
