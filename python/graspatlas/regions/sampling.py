"""Points spread evenly over a mesh, and which of them are neighbours."""

from __future__ import annotations

import numpy as np

from graspatlas.numerics.groups import linked_groups
from graspatlas.regions.fitting import Samples
from graspatlas.support.arrays import Array, BoolArray, IntArray

__all__ = ["connected", "on_triangles", "spread"]

#: Neighbours of a sample that its part of the surface goes on to.
NEAREST = 8


def on_triangles(corners: Array, areas: Array, count: int, rng: np.random.Generator) -> tuple[Array, IntArray]:
    """Points (count, 3) on triangles (m, 3, 3), as many on each as its area asks for, and the triangles they lie on."""
    total = np.cumsum(areas)
    strata = (np.arange(count) + rng.uniform(size=count)) / count  # one in each of so many equal areas
    which = np.minimum(np.searchsorted(total, strata * total[-1]), len(areas) - 1)
    s, t = rng.uniform(size=(2, count))
    over = s + t > 1.0
    s, t = np.where(over, 1.0 - s, s), np.where(over, 1.0 - t, t)
    a, b, c = corners[which].transpose(1, 0, 2)
    return a + s[:, None] * (b - a) + t[:, None] * (c - a), which


def spread(corners: Array, areas: Array, normals: Array, faces: IntArray, count: int) -> Samples:
    """Samples of some faces of a mesh, always the same.

    Args:
        corners: Corners of all faces of the mesh (m, 3, 3) [m].
        areas: Their areas (m,) [m2].
        normals: Their normals (m, 3).
        faces: The faces to sample.
        count: How many samples.
    """
    points, which = on_triangles(corners[faces], areas[faces], count, np.random.default_rng(0))
    return Samples(points, normals[faces[which]], faces[which])


def neighbours(samples: Samples) -> IntArray:
    """Pairs of samples that lie side by side on the surface (p, 2)."""
    from scipy.spatial import cKDTree  # slow to import

    _, near = cKDTree(samples.points).query(samples.points, min(NEAREST + 1, len(samples)))
    pairs = np.column_stack([np.repeat(np.arange(len(near)), near.shape[1] - 1), near[:, 1:].ravel()])
    same_side = np.einsum("nk,nk->n", samples.normals[pairs[:, 0]], samples.normals[pairs[:, 1]]) > 0.3
    return np.asarray(pairs[same_side])


def connected(inside: BoolArray, pairs: IntArray) -> BoolArray:
    """The largest part of the chosen samples, or faces, that hangs together."""
    if not inside.any():
        return inside
    links = pairs[inside[pairs[:, 0]] & inside[pairs[:, 1]]]
    groups = linked_groups(len(inside), links)
    sizes = np.bincount(groups[inside], minlength=len(inside))
    return np.asarray(inside & (groups == np.argmax(sizes)))
