"""What proposals are made of, and the numbers that fix them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from graspatlas.hand.body import Body
from graspatlas.quality.batched import Quality
from graspatlas.requirements.base import RequirementLike
from graspatlas.support.pickling import Light

__all__ = ["Plan"]


@dataclass(frozen=True)
class Plan(Light):
    """What all assignments of one hand and one object have in common.

    Attributes:
        hand: Name of the hand.
        source: How a problem file names the hand: ``{"urdf": path}`` and so on.
        body: The object.
        surface: SHA-256 of its surface.
        quality: The index that ranks proposals.
        requirements: What grasps must meet.
        radius: r, of the charts of the atlases.
        length_scale: Length that counts as much as one radian [m].
        seed: Of the random numbers.
    """

    hand: str
    source: Mapping[str, str]
    body: Body
    surface: str
    quality: Quality
    requirements: tuple[RequirementLike, ...]
    radius: float = 0.3
    length_scale: float = 0.01
    seed: int = 0
