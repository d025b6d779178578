"""A pad: the place of a link that touches when the hand closes."""

from __future__ import annotations

from dataclasses import dataclass

from graspatlas.patches.base import Patch, Vector3
from graspatlas.support.validation import PlainTable

__all__ = ["Pad"]


@dataclass(frozen=True)
class Pad:
    """Where a link of a hand touches when the hand closes.

    Attributes:
        frame: Name of the link, in whose coordinates all else is stated.
        position: The point in its middle (3,), metres.
        normal: Outward unit normal there (3,).
        patch: The surface round that point, within its intervals of u and v; the point is that of (0, 0).
        error: Largest distance of the link's shape from the patch, along the normal [m].
    """

    frame: str
    position: Vector3
    normal: Vector3
    patch: Patch
    error: float

    def to_dict(self) -> PlainTable:
        """The pad as a contact of a problem file states its hand's side: ``frame``, and the patch as ``hand``."""
        return {"frame": self.frame, "hand": self.patch.to_dict()}
