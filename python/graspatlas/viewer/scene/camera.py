"""A camera that stands upright."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from graspatlas.support.arrays import Array

__all__ = ["Camera"]


@dataclass(frozen=True)
class Camera:
    """A camera that stands upright: z of the world points up in its picture.

    Attributes:
        target: Point in the middle of the picture (3,), metres.
        direction: Unit vector from there to the camera (3,).
        distance: Distance between them, metres.
        field_of_view: Angle between top and bottom of the picture [rad].
    """

    target: Array
    direction: Array
    distance: float
    field_of_view: float = np.radians(24.0)

    @property
    def position(self) -> Array:
        """Where it stands (3,), metres."""
        return np.asarray(self.target + self.distance * self.direction)

    @property
    def axes(self) -> Array:
        """Its right, up and backward unit vectors as rows (3, 3)."""
        right = np.cross([0.0, 0.0, 1.0], self.direction)
        right /= np.linalg.norm(right)
        return np.array([right, np.cross(self.direction, right), self.direction])

    def project(self, points: Array, aspect: float) -> Array:
        """Points (n, 3) in its picture (n, 3): right and up, both -1 to 1, and the inverse of the depth [1/m]."""
        seen = (points - self.position) @ self.axes.T
        near = -1.0 / seen[:, 2]
        scale = 1.0 / np.tan(self.field_of_view / 2.0)
        return np.column_stack([seen[:, 0] * near * scale / aspect, seen[:, 1] * near * scale, near])
