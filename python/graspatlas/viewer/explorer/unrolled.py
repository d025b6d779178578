r"""A surface of charts laid out in the plane: each chart keeps its shape, and the gaps and overlaps show the curvature.

From the chart in the middle, charts are laid down one by one, each beside the one through which the shortest way leads
to it, with its tangent basis carried along. Then all give way a little, as rigid tiles, so that errors spread:

.. math:: \min_{y, R} \sum_{(i, j)} \| y_j - y_i - R_i a_{ij} \|^2, \qquad R_i \in SO(2)

with :math:`a_{ij}` the neighbour's centre in the chart's tangent space. Neighbours that the layout has torn apart, as
it must where the surface closes, stay apart.

Source: R. Schmidt, C. Grimm, B. Wyvill, "Interactive decal compositing with discrete exponential maps", SIGGRAPH 2006;
the tiles after O. Sorkine, M. Alexa, "As-rigid-as-possible surface modeling", SGP 2007.
"""

from __future__ import annotations

import heapq

import numpy as np

from graspatlas.atlas.atlas import Atlas
from graspatlas.support.arrays import Array, BoolArray, IntArray

__all__ = ["unrolled"]

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
    difference, centers = atlas.system.difference, atlas.centers
    moves = np.array([difference(centers[i], centers[j]) for i, j in pairs])
    return np.asarray(
        np.einsum("pkt,pt->pk", atlas.bases[pairs[:, 0]], moves.reshape(len(pairs), atlas.bases.shape[2]))
    )


def _laid_down(atlas: Atlas, pairs: IntArray, steps: Array) -> tuple[Array, Array]:
    """The layout by shortest ways from the middle; parts that no way leads to lie beside it."""
    n = atlas.n_charts
    y, R = np.zeros((n, 2)), np.tile(np.eye(2), (n, 1, 1))
    order = np.argsort(pairs[:, 0], kind="stable")
    ends = np.searchsorted(pairs[order, 0], np.arange(n + 1))
    lengths = np.linalg.norm(steps, axis=1)
    done = np.zeros(n, bool)
    while not done.all():
        left = np.flatnonzero(~done)
        middle = left[np.linalg.norm(atlas.centers[left] - atlas.centers[left].mean(axis=0), axis=1).argmin()]
        y[middle, 0] = 2.0 * atlas.radius + y[done, 0].max() if done.any() else 0.0
        queue: list[tuple[float, int, int]] = [(0.0, int(middle), -1)]
        while queue:
            distance, chart, pair = heapq.heappop(queue)
            if done[chart]:
                continue
            done[chart] = True
            if pair >= 0:
                origin = pairs[pair, 0]
                y[chart] = y[origin] + R[origin] @ steps[pair]
                R[chart] = R[origin] @ _nearest_rotation(atlas.bases[origin] @ atlas.bases[chart].T)
            for p in order[ends[chart] : ends[chart + 1]]:
                if not done[pairs[p, 1]]:
                    heapq.heappush(queue, (distance + lengths[p], int(pairs[p, 1]), int(p)))
    return y, R


def _given_way(y: Array, R: Array, pairs: IntArray, steps: Array, back_steps: Array) -> tuple[Array, Array]:
    """Tiles moved and turned in turns, each to suit its neighbours; steps are a_ij and a_ji of the pairs (p, 2)."""
    n, (i, j) = len(y), pairs.T
    count = np.bincount(i, minlength=n)
    mirrored = np.linalg.det(R) < 0.0

    def sums(rows: Array) -> Array:
        """Of the rows of all pairs, for each first chart."""
        return np.column_stack([np.bincount(i, column, n) for column in rows.T])

    for _ in range(ROUNDS):
        M = sums(((y[j] - y[i])[:, :, None] * steps[:, None, :]).reshape(-1, 4)).reshape(n, 2, 2)
        R = np.where((count > 1)[:, None, None], _nearest_rotation(M, mirrored), R)
        outward, inward = (np.einsum("pij,pj->pi", R[k], a) for k, a in ((i, steps), (j, back_steps)))
        wanted = sums(y[j] - (outward - inward) / 2.0) / np.maximum(count, 1)[:, None]
        y = np.where((count > 0)[:, None], (y + wanted) / 2.0, y)
    return y, R


def _nearest_rotation(M: Array, mirrored: BoolArray | None = None) -> Array:
    """The rotation nearest to a matrix (..., 2, 2), or the reflection where that is nearer, or where it is said."""
    turn = np.stack([M[..., 0, 0] + M[..., 1, 1], M[..., 1, 0] - M[..., 0, 1]], axis=-1)
    flip = np.stack([M[..., 0, 0] - M[..., 1, 1], M[..., 1, 0] + M[..., 0, 1]], axis=-1)
    flips = (flip**2).sum(-1) > (turn**2).sum(-1) if mirrored is None else mirrored
    c, s = np.moveaxis(np.where(flips[..., None], flip, turn), -1, 0)
    size = np.maximum(np.hypot(c, s), 1e-300)
    c, s, sign = c / size, s / size, np.where(flips, -1.0, 1.0)
    return np.stack([np.stack([c, -sign * s], axis=-1), np.stack([s, sign * c], axis=-1)], axis=-2)
