"""A z-buffer rasteriser in NumPy: which triangle is seen at which pixel."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from graspatlas.support.arrays import Array, BoolArray, Float32Array, IntArray

__all__ = ["Fragments", "fragments", "nearest"]


#: How many candidate pixels are worked on at a time.
BATCH = 1 << 19
#: Triangles are widened by this share, so that no gap opens between neighbours.
SEAM = 1e-5
#: Sides of the boxes in which triangles are filled, in pixels.
BOXES = np.unique(np.round(2.0 ** np.arange(0.0, 15.0, 0.5))).astype(np.int64)


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


def fragments(corners: Array, width: int, height: int) -> Iterator[Fragments]:
    """Everything that triangles cover, batch by batch, the hidden included.

    Triangles are sorted by the size of the box round them, so that those of one size are filled together.

    Args:
        corners: Corners of the triangles on the screen [f, 3, 3]: x to the right and y down in pixels, and a nearness
            that is larger for nearer points and linear on the screen.
        width: Width of the picture in pixels.
        height: Height.
    """
    ends = corners[:, 1:, :2] - corners[:, :1, :2]
    seen = np.abs(ends[:, 0, 0] * ends[:, 1, 1] - ends[:, 0, 1] * ends[:, 1, 0]) > 1e-6
    a, b, c = (corners[:, k, :2] for k in range(3))
    low = np.maximum(np.ceil(np.minimum(np.minimum(a, b), c) - 0.5), 0.0).astype(np.int64)
    high = np.maximum(np.maximum(a, b), c) - 0.5
    high = np.minimum(np.floor(high), [width - 1, height - 1]).astype(np.int64)
    sizes = high - low + 1
    filled = np.flatnonzero((sizes > 0).all(axis=1) & seen)
    steps = np.searchsorted(BOXES, sizes[filled])
    kinds = steps[:, 0] * len(BOXES) + steps[:, 1]
    for kind in np.unique(kinds):
        w, h = int(BOXES[kind // len(BOXES)]), int(BOXES[kind % len(BOXES)])
        members = filled[kinds == kind]
        step = max(1, BATCH // (w * h))
        for start in range(0, len(members), step):
            yield _fill(corners, low, members[start : start + step], (w, h), (width, height))


def _fill(
    corners: Array, low: IntArray, members: IntArray, box: tuple[int, int], picture: tuple[int, int]
) -> Fragments:
    """Fragments of triangles that fit into boxes of one size."""
    dx, dy = (a.ravel() for a in np.meshgrid(np.arange(box[0]), np.arange(box[1])))
    origin = low[members]
    # Corners relative to the box's first pixel are small numbers: single precision will do.
    c = (corners[members, :, :2] - (origin[:, None] + 0.5)).astype(np.float32)
    edges = np.roll(c, -1, axis=1) - c
    area = edges[:, 0, 0] * edges[:, 1, 1] - edges[:, 0, 1] * edges[:, 1, 0]
    scale = np.float32(1.0) / area
    x, y = dx.astype(np.float32), dy.astype(np.float32)
    weights = []
    for k in (1, 2, 0):  # the edge opposite to corners 0, 1, 2
        a, b = -edges[:, k, 1] * scale, edges[:, k, 0] * scale
        weights.append(a[:, None] * x + b[:, None] * y - (a * c[:, k, 0] + b * c[:, k, 1])[:, None])
    inside = (weights[0] >= -SEAM) & (weights[1] >= -SEAM) & (weights[2] >= -SEAM)
    inside &= (origin[:, :1] + dx < picture[0]) & (origin[:, 1:] + dy < picture[1])
    found = np.flatnonzero(inside)
    row, column = np.divmod(found, len(dx))
    w = np.stack([weight.ravel()[found] for weight in weights], axis=1)
    pixels = (origin[row, 1] + dy[column]) * picture[0] + origin[row, 0] + dx[column]
    near = np.einsum("ij,ij->i", w, corners[members, :, 2].astype(np.float32)[row])
    return Fragments(pixels, members[row], w, near)


def nearest(corners: Array, width: int, height: int) -> Fragments:
    """What is seen: for each covered pixel its nearest triangle; arguments as for :func:`fragments`."""
    z = corners[:, :, 2]
    low, span = float(z.min(initial=np.inf)), float(np.ptp(z)) if z.size else 1.0
    buffer = np.zeros(width * height, np.uint64)
    for batch in fragments(corners, width, height):
        depth = np.clip((batch.nearness - low) / max(span, 1e-300), 0.0, 1.0).astype(np.float64)
        key = ((depth * 4.0e9).astype(np.uint64) << np.uint64(32)) | (batch.triangles + 1).astype(np.uint64)
        np.maximum.at(buffer, batch.pixels, key)
    pixels = np.flatnonzero(buffer)
    triangles = (buffer[pixels] & np.uint64(0xFFFFFFFF)).astype(np.int64) - 1
    return at_pixels(corners, pixels, triangles, width)


def at_pixels(corners: Array, pixels: IntArray, triangles: IntArray, width: int) -> Fragments:
    """Fragments of given triangles at given pixels [n]."""
    c = corners.astype(np.float32)[triangles]
    point = np.empty((len(pixels), 2), np.float32)
    point[:, 0], point[:, 1] = pixels % width + 0.5, pixels // width + 0.5
    a, b, d = c[:, 1, :2] - c[:, 0, :2], c[:, 2, :2] - c[:, 0, :2], point - c[:, 0, :2]
    scale = 1.0 / (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
    weights = np.empty((len(pixels), 3), np.float32)
    weights[:, 1] = np.clip((d[:, 0] * b[:, 1] - d[:, 1] * b[:, 0]) * scale, 0.0, 1.0)
    weights[:, 2] = np.clip((a[:, 0] * d[:, 1] - a[:, 1] * d[:, 0]) * scale, 0.0, 1.0 - weights[:, 1])
    weights[:, 0] = 1.0 - weights[:, 1] - weights[:, 2]
    return Fragments(pixels, triangles, weights, np.einsum("ij,ij->i", weights, c[:, :, 2]))
