"""A z-buffer rasteriser: which triangle is seen at which pixel. The compiled core does the work."""

from __future__ import annotations

from dataclasses import dataclass

from graspatlas import _core
from graspatlas.support.arrays import Array, BoolArray, Float32Array, IntArray

__all__ = ["Fragments", "in_front_of", "nearest"]


@dataclass(frozen=True, eq=False)
class Fragments:
    """Pixels that triangles cover; n of them.

    Attributes:
        pixels: Index of the pixel in the flattened picture [n].
        triangles: Index of the triangle [n].
        weights: Barycentric coordinates on the screen [n, 3].
        nearness: Interpolated nearness, the third coordinate of the corners [n].
    """

    pixels: IntArray
    triangles: IntArray
    weights: Float32Array
    nearness: Float32Array

    def __getitem__(self, rows: BoolArray | IntArray) -> Fragments:
        return Fragments(self.pixels[rows], self.triangles[rows], self.weights[rows], self.nearness[rows])


def nearest(corners: Array, width: int, height: int) -> Fragments:
    """What is seen: for each covered pixel its nearest triangle, in the order of the pixels.

    Args:
        corners: Corners of the triangles on the screen [f, 3, 3]: x to the right and y down in pixels, and a nearness
            that is larger for nearer points and linear on the screen.
        width: Width of the picture in pixels.
        height: Height.
    """
    return Fragments(**_core.nearest_fragments(corners, width, height))


def in_front_of(nearness: Float32Array, corners: Array, width: int, height: int) -> Fragments:
    """All of see-through triangles that is nearer than what a picture shows; of each pixel the farthest first.

    Args:
        nearness: That of each pixel [width * height].
        corners: As for :func:`nearest`.
        width: Width of the picture in pixels.
        height: Height.
    """
    return Fragments(**_core.fragments_in_front(corners, width, height, nearness))
