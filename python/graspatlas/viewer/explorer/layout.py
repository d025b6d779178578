"""Where the page draws the charts: polygons in three coordinates and unrolled, or points; and who neighbours whom."""

from __future__ import annotations

import re
from functools import cached_property

import numpy as np

from graspatlas.atlas.atlas import Atlas
from graspatlas.support.arrays import Array
from graspatlas.support.validation import PlainTable
from graspatlas.viewer.explorer.numbers import Numbers
from graspatlas.viewer.explorer.unrolled import unrolled
from graspatlas.viewer.scene.polygons import Coordinates, chart_polygons, default_coordinates, polygon_corners

__all__ = ["Layout"]


class Layout:
    """Where the charts of an atlas are drawn.

    Args:
        atlas: The atlas.
    """

    def __init__(self, atlas: Atlas) -> None:
        self.atlas = atlas

    @cached_property
    def coordinates(self) -> Coordinates:
        """The three coordinates."""
        return default_coordinates(self.atlas)

    @cached_property
    def unrolled(self) -> tuple[Array, Array]:
        """Centres of the charts of a surface in the plane (n, 2), and how each is turned there (n, 2, 2)."""
        return unrolled(self.atlas)

    def write(self, maxima: Array, numbers: Numbers) -> PlainTable:
        """Write it.

        Args:
            maxima: Grasps that stand after the charts [m, configuration_size].
            numbers: Where to.

        Returns:
            ``labels`` of the three coordinates.
        """
        atlas = self.atlas
        numbers.add_rounded("coordinates", self.coordinates.of(np.concatenate([atlas.centers, maxima])))
        pairs = atlas.neighbour_pairs.astype(np.int64)
        pairs = pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]
        numbers.add("neighbour_counts", np.bincount(pairs[:, 0], minlength=atlas.n_charts).astype(np.uint16))
        numbers.add("neighbour_steps", (pairs[:, 1] - pairs[:, 0]).astype(np.uint32))
        if atlas.dimension == 2:
            polygons = chart_polygons(atlas, self.coordinates)
            numbers.add("corner_counts", np.array([len(polygon) for polygon in polygons], np.uint16))
            numbers.add_rounded("corners", np.concatenate(polygons))
            centers, R = self.unrolled
            corners, owners = polygon_corners(atlas)
            numbers.add_rounded("flat_corners", centers[owners] + np.einsum("vij,vj->vi", R[owners], corners))
            numbers.add_rounded("flat_centers", centers)
        return {"labels": [re.sub(r"\$(\w)_?(\w*)\$", r"\1\2", label) for label in self.coordinates.labels]}
