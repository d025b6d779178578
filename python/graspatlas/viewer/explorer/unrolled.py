r"""A surface of charts laid out in the plane: each chart keeps its shape, and the gaps and overlaps show the curvature.

From the chart in the middle, charts are laid down, each beside the one through which the shortest way leads to it, with
its tangent basis carried along. Then all give way a little, as rigid tiles, so that errors spread:

.. math:: \min_{y, R} \sum_{(i, j)} \| y_j - y_i - R_i a_{ij} \|^2, \qquad R_i \in SO(2)

with :math:`a_{ij}` the neighbour's centre in the chart's tangent space. Neighbours that the layout has torn apart, as
it must where the surface closes, stay apart.

Source: R. Schmidt, C. Grimm, B. Wyvill, "Interactive decal compositing with discrete exponential maps", SIGGRAPH 2006;
the tiles after O. Sorkine, M. Alexa, "As-rigid-as-possible surface modeling", SGP 2007.
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from graspatlas.atlas.atlas import Atlas
from graspatlas.numerics.groups import linked_groups
from graspatlas.numerics.ways import shortest_ways
from graspatlas.support.arrays import Array, BoolArray, IntArray

__all__ = ["unrolled"]

Complexes: TypeAlias = NDArray[np.complex128]

#: Rounds in which the tiles give way.
ROUNDS = 100
#: Neighbours that are this much farther from each other than in the tangent space are torn apart [radii].
TORN = 1.0


def unrolled(atlas: Atlas) -> tuple[Array, Array]:
    """Where the charts of a surface lie in the plane.

    Args:
        atlas: An atlas of dimension 2.

    Returns:
        Their centres (n, 2), in the units of the tangent space, and the rotation (or reflection) of each chart's
        tangent coordinates into the plane (n, 2, 2).
    """
    pairs = atlas.neighbour_pairs.astype(np.int64)
    pairs = np.concatenate([pairs, pairs[:, ::-1]])
    steps = _steps(atlas, pairs)
    y, R = _laid_down(atlas, pairs, steps)
    apart = y[pairs[:, 1]] - y[pairs[:, 0]] - np.einsum("pij,pj->pi", R[pairs[:, 0]], steps)
    whole = np.linalg.norm(apart, axis=1) < TORN * atlas.radius
    back = np.roll(np.arange(len(pairs)), len(pairs) // 2)  # the same two charts the other way round
    whole &= whole[back]
    y, R = _given_way(y, R, pairs[whole], steps[whole], steps[back[whole]])
    y = y - y.mean(axis=0)
    upright = np.linalg.eigh(y.T @ y)[1].T[::-1]  # the longest way across lies level
    return y @ upright.T, upright @ R


def _steps(atlas: Atlas, pairs: IntArray) -> Array:
    """a_ij: centre of the second chart of each pair (p, 2) in the tangent space of the first (p, 2)."""
    first, second = pairs.T
    moves = atlas.system.differences(atlas.centers[first], atlas.centers[second])
    return np.asarray(np.einsum("pkt,pt->pk", atlas.bases[first], moves))


def _laid_down(atlas: Atlas, pairs: IntArray, steps: Array) -> tuple[Array, Array]:
    """The layout by shortest ways from the middle; parts that no way leads to lie beside it."""
    n = atlas.n_charts
    parts = linked_groups(n, pairs)
    before = shortest_ways(n, pairs, np.linalg.norm(steps, axis=1), _middles(atlas.centers, parts))
    charts = np.flatnonzero(before >= 0)
    origins = before[charts]
    numbers = pairs[:, 0] * n + pairs[:, 1]
    order = np.argsort(numbers)
    y, R = np.zeros((n, 2)), np.tile(np.eye(2), (n, 1, 1))
    y[charts] = steps[order[np.searchsorted(numbers, origins * n + charts, sorter=order)]]
    R[charts] = _nearest_rotation(atlas.bases[origins] @ atlas.bases[charts].swapaxes(1, 2))
    # Seen from the chart before, then from the second, the fourth, the eighth ... before, and at last from the middle.
    seen_from = np.where(before >= 0, before, np.arange(n))
    while (seen_from[seen_from] != seen_from).any():
        y = y[seen_from] + np.einsum("nij,nj->ni", R[seen_from], y)
        R = R[seen_from] @ R
        seen_from = seen_from[seen_from]
    y[:, 0] += _side_by_side(y[:, 0], parts, 2.0 * atlas.radius)[parts]
    return y, R


def _middles(centers: Array, parts: IntArray) -> IntArray:
    """The chart of each part that is nearest to the mean of its centres."""
    counts = np.bincount(parts)
    means = np.zeros((len(counts), centers.shape[1]))
    np.add.at(means, parts, centers)
    means /= counts[:, None]
    order = np.lexsort((np.linalg.norm(centers - means[parts], axis=1), parts))
    return np.asarray(order[np.cumsum(counts) - counts])


def _side_by_side(x: Array, parts: IntArray, gap: float) -> Array:
    """How far each part is moved along x, so that they lie beside each other with a gap."""
    left, right = np.full(parts.max() + 1, np.inf), np.full(parts.max() + 1, -np.inf)
    np.minimum.at(left, parts, x)
    np.maximum.at(right, parts, x)
    ends = np.cumsum(right - left + gap)
    return np.asarray(ends - ends[0] - right + right[0])


def _given_way(y: Array, R: Array, pairs: IntArray, steps: Array, back_steps: Array) -> tuple[Array, Array]:
    """Tiles moved and turned in turns, each to suit its neighbours; steps are a_ij and a_ji of the pairs (p, 2).

    Vectors are complex numbers: R_i a is r_i a, and where R_i is a reflection r_i times the conjugate of a.
    """
    n, (i, j) = len(y), pairs.T
    mirrored = np.linalg.det(R) < 0.0
    z, r, a, back = (rows[:, 0] + 1j * rows[:, 1] for rows in (y, R[:, :, 0], steps, back_steps))
    a, back = (np.where(mirrored[k], rows.conj(), rows) for k, rows in ((i, a), (j, back)))

    def sums(rows: Complexes) -> Complexes:
        """Of the numbers of all pairs, for each first chart."""
        return np.bincount(i, rows.real, n) + 1j * np.bincount(i, rows.imag, n)

    count, total, conjugates = np.bincount(i, minlength=n), sums(a), a.conj()
    for _ in range(ROUNDS):
        across = z[j]
        turn = sums(conjugates * across) - total.conj() * z
        r = np.where(count > 1, turn / np.maximum(np.abs(turn), 1e-300), r)
        wanted = (sums(across + 0.5 * back * r[j]) - 0.5 * r * total) / np.maximum(count, 1)
        z = np.where(count > 0, (z + wanted) / 2.0, z)
    return np.column_stack([z.real, z.imag]), _turned(r.real, r.imag, mirrored)


def _nearest_rotation(M: Array) -> Array:
    """The rotation nearest to a matrix (..., 2, 2), or the reflection where that is nearer."""
    turn = np.stack([M[..., 0, 0] + M[..., 1, 1], M[..., 1, 0] - M[..., 0, 1]], axis=-1)
    flip = np.stack([M[..., 0, 0] - M[..., 1, 1], M[..., 1, 0] + M[..., 0, 1]], axis=-1)
    flips = (flip**2).sum(-1) > (turn**2).sum(-1)
    c, s = np.moveaxis(np.where(flips[..., None], flip, turn), -1, 0)
    size = np.maximum(np.hypot(c, s), 1e-300)
    return _turned(c / size, s / size, flips)


def _turned(c: Array, s: Array, mirrored: BoolArray) -> Array:
    """Rotations by angles of these cosines and sines (..., 2, 2); reflections that turn the first axis by them."""
    sign = np.where(mirrored, -1.0, 1.0)
    return np.stack([np.stack([c, -sign * s], axis=-1), np.stack([s, sign * c], axis=-1)], axis=-2)
