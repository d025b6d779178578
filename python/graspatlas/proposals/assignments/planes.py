"""Planes that the object stands on or beside: what lies behind them, neither a fingertip nor the palm can reach."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from graspatlas.regions.region import Region
from graspatlas.support.arrays import Array, BoolArray
from graspatlas.world.obstacle import Obstacle

__all__ = ["Planes"]

#: A fingertip is at least as thick [m]: this far above a point that it touches, there is still some of it.
FINGER = 1e-3
#: A turn by less keeps a normal.
SAME = 1e-6


@dataclass(frozen=True, eq=False)
class Planes:
    """Planes in the object's frame.

    Attributes:
        points: A point of each (p, 3) [m].
        normals: Unit normals, to the side where the hand may be (p, 3).
    """

    points: Array
    normals: Array

    @classmethod
    def of(cls, obstacles: Sequence[Obstacle]) -> Planes:
        """Those of obstacles that are planes and fixed to the object."""
        frames = [each.T_frame_shape for each in obstacles if each.frame == "object" and each.body is None]
        T = np.array(frames).reshape(-1, 4, 4)
        return cls(T[:, :3, 3], T[:, :3, 2])

    def behind(self, points: Array) -> BoolArray:
        """Whether points (n, 3) lie behind any of them (n,)."""
        heights = points @ self.normals.T - np.einsum("pc,pc->p", self.points, self.normals)
        return np.asarray((heights <= 0.0).any(axis=1))

    def touchable(self, points: Array, outward: Array) -> BoolArray:
        """Whether a fingertip has room at points (n, 3) of the object with these outward normals (n, 3)."""
        return ~self.behind(points + FINGER * outward)

    def hides(self, region: Region) -> bool:
        """Whether a fingertip has room nowhere on a region."""
        a, b, c = region.corners.swapaxes(0, 1)
        cross = np.cross(b - a, c - a)
        length = np.linalg.norm(cross, axis=1, keepdims=True)
        outward = np.repeat(cross / np.where(length > 0.0, length, 1.0), 3, axis=0)
        return not self.touchable(region.corners.reshape(-1, 3), outward).any()

    def kept_by(self, turn: Array) -> bool:
        """Whether a rotation (3, 3) about a point that stays where it is leaves all of them as they are."""
        return bool(np.abs(self.normals @ turn.T - self.normals).max(initial=0.0) < SAME)
