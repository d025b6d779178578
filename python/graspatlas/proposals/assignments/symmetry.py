"""The rotations that turn a mesh into itself, and which regions they turn into which."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import permutations, product

import numpy as np

from graspatlas.regions.region import Region
from graspatlas.support.arrays import Array

__all__ = ["region_symmetries"]

#: A turned point this near to the surface lies on it, as a share of the object's size.
ON_SURFACE = 0.01
#: Regions whose areas and distances differ by this share are alike.
SAME = 0.03
#: Points of each region that are turned.
SAMPLES = 40


def region_symmetries(regions: Sequence[Region]) -> list[tuple[int, ...]]:
    """Where each region goes by the rotations about principal or coordinate axes that turn the object into itself.

    Args:
        regions: The regions.

    Returns:
        For each rotation the numbers of the regions that take the places of all in turn; the first stays as it is.
    """
    from scipy.spatial import cKDTree  # slow to import

    if not regions:
        return [()]
    rng = np.random.default_rng(0)
    samples = [region.sample(SAMPLES, rng)[0] for region in regions]
    dense = [region.sample(20 * SAMPLES, rng)[0] for region in regions]
    areas = np.array([region.area for region in regions])
    corners = np.concatenate([region.corners for region in regions])
    size = float(np.linalg.norm(np.ptp(corners.reshape(-1, 3), axis=0)))
    middle, axes = _principal_axes(corners)
    trees = [cKDTree(each) for each in dense]
    found = [tuple(range(len(regions)))]
    centers = np.array([region.center for region in regions]) - middle
    for turn in (*_turns(axes), *_turns(np.eye(3)), *_turns_of_centers(centers, areas)):
        moved = [(each - middle) @ turn.T + middle for each in samples]
        places = []
        for i, each in enumerate(moved):
            off = [float(np.max(tree.query(each)[0])) for tree in trees]
            j = int(np.argmin(off))
            # Samples are apart; what is that near to them lies on the surface.
            apart = 3.0 * np.sqrt(areas[j] / (20 * SAMPLES)) + ON_SURFACE * size
            if off[j] > apart or abs(areas[i] - areas[j]) > 0.05 * areas[j]:
                break
            places.append(j)
        if len(places) == len(regions) and sorted(places) == list(range(len(regions))):
            found.append(tuple(places))
    return list(dict.fromkeys(found))


def _turns_of_centers(centers: Array, areas: Array) -> Iterator[Array]:
    """The rotations that take the centres of two regions to those of two others, as large and as far from the middle.

    They find what principal axes leave open where two moments are equal, as those of a box with a square face.

    Args:
        centers: Centres of the regions, from the middle of the object (n, 3) [m].
        areas: Areas of the regions (n,) [m2].
    """
    far = np.linalg.norm(centers, axis=1)
    near = SAME * float(far.max())
    alike = (np.abs(far[:, None] - far) < near) & (np.abs(areas[:, None] - areas) < SAME * areas)
    pairs = [(i, j) for i, j in permutations(range(len(far)), 2) if _apart(centers[i], centers[j])]
    if not pairs:
        return
    a, b = min(pairs, key=lambda pair: int(alike[pair[0]].sum() * alike[pair[1]].sum()))
    frame, angle = _frame(centers[a], centers[b]), centers[a] @ centers[b]
    for i, j in pairs:
        if (i, j) != (a, b) and alike[a, i] and alike[b, j] and abs(centers[i] @ centers[j] - angle) < near * far.max():
            yield _frame(centers[i], centers[j]) @ frame.T


def _apart(a: Array, b: Array) -> bool:
    """Whether two directions span a plane."""
    return float(np.linalg.norm(np.cross(a, b))) > 0.1 * float(np.linalg.norm(a) * np.linalg.norm(b)) > 0.0


def _frame(a: Array, b: Array) -> Array:
    """The right-handed frame whose first axis is along a, and whose second is on the side of b; as columns."""
    x = a / np.linalg.norm(a)
    z = np.cross(a, b)
    z /= np.linalg.norm(z)
    return np.column_stack([x, np.cross(z, x), z])


def _principal_axes(corners: Array) -> tuple[Array, Array]:
    """Centroid (3,) and principal axes as columns (3, 3) of the surface of triangles (f, 3, 3)."""
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    centers = corners.mean(axis=1)
    middle = np.average(centers, axis=0, weights=areas)
    at, about = corners - middle, centers - middle
    moments = np.einsum("f,fai,faj->ij", areas, at, at) + 9.0 * np.einsum("f,fi,fj->ij", areas, about, about)
    return middle, np.linalg.eigh(moments / areas.sum())[1]


def _turns(axes: Array) -> list[Array]:
    """The rotations by quarter and half turns that take the principal axes to one another."""
    turns = []
    for order, signs in product(permutations(range(3)), product((1.0, -1.0), repeat=3)):
        P = np.zeros((3, 3))
        P[range(3), order] = signs
        if np.linalg.det(P) > 0.0 and not np.allclose(P, np.eye(3)):
            turns.append(axes @ P @ axes.T)
    return turns
