"""Where the page draws the charts: polygons in three coordinates and unrolled, or points; and who neighbours whom."""

from __future__ import annotations

import re

import numpy as np

from graspatlas.atlas.atlas import Atlas
from graspatlas.support.arrays import Array
from graspatlas.support.validation import PlainTable
from graspatlas.viewer.explorer.numbers import Numbers
from graspatlas.viewer.explorer.unrolled import unrolled
from graspatlas.viewer.scene.polygons import chart_polygons, default_coordinates

__all__ = ["write_layout"]


def write_layout(atlas: Atlas, maxima: Array, numbers: Numbers) -> PlainTable:
    """Write where the charts are drawn.

    Args:
        atlas: The atlas.
        maxima: Grasps that stand after the charts [m, configuration_size].
        numbers: Where to.

    Returns:
        ``labels`` of the three coordinates.
    """
    coordinates = default_coordinates(atlas)
    numbers.add_rounded("coordinates", coordinates.of(np.concatenate([atlas.centers, maxima])))
    pairs = atlas.neighbour_pairs.astype(np.int64)
    pairs = pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]
    numbers.add("neighbour_counts", np.bincount(pairs[:, 0], minlength=atlas.n_charts).astype(np.uint16))
    numbers.add("neighbour_steps", (pairs[:, 1] - pairs[:, 0]).astype(np.uint32))
    if atlas.dimension == 2:
        polygons = chart_polygons(atlas, coordinates)
        numbers.add("corner_counts", np.array([len(polygon) for polygon in polygons], np.uint16))
        numbers.add_rounded("corners", np.concatenate(polygons))
        centers, R = unrolled(atlas)
        flat = [centers[i] + atlas.polytope(i) @ R[i].T for i in range(atlas.n_charts)]
        numbers.add_rounded("flat_corners", np.concatenate(flat))
        numbers.add_rounded("flat_centers", centers)
    return {"labels": [re.sub(r"\$(\w)_?(\w*)\$", r"\1\2", label) for label in coordinates.labels]}
