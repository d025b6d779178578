"""Two shapes that collide, or come nearer than they may: which, how deep, where, and that in words."""

from __future__ import annotations

import math
from dataclasses import dataclass

from graspatlas.collision.shapes import Shape
from graspatlas.support.arrays import Array

__all__ = ["Clash"]


@dataclass(frozen=True, eq=False)
class Clash:
    """The two shapes of a grasp that miss the distance which they must keep by most.

    Attributes:
        shapes: The two shapes, each placed in its joint.
        names: What they belong to: a link of the hand, the object or an obstacle.
        groups: Which of these it is: ``"hand"``, ``"object"`` or ``"obstacle"``.
        distance: Signed distance between them [m], negative the depth to which they sink in; NaN of meshes that cut
            each other, which have none.
        required: Distance that they must keep [m], negative the depth to which they may sink in.
        point: The middle between the points where they are deepest, or nearest, in the palm's frame (3,), metres; NaN
            where the distance is.
    """

    shapes: tuple[Shape, Shape]
    names: tuple[str, str]
    groups: tuple[str, str]
    distance: float
    required: float
    point: Array

    @property
    def text(self) -> str:
        """What is wrong, in words: ``index_distal is 1.3 mm inside can``."""
        first, second = self.names
        if math.isnan(self.distance):
            return f"{first} cuts through {second}"
        if self.distance < 0.0:
            allowed = f", {_mm(-self.required)} is allowed" if self.required < 0.0 else ""
            apart = f", {_mm(self.required)} apart is required" if self.required > 0.0 else ""
            return f"{first} is {_mm(-self.distance)} inside {second}{allowed}{apart}"
        return f"{first} is {_mm(self.distance)} from {second}, {_mm(self.required)} is required"


def _mm(metres: float) -> str:
    return f"{1000.0 * metres:.3g} mm"
