"""The grasps between which only taste can choose: none of the others is at least as good by every index.

The paper reads one index at a time on the atlas. The atlas holds all grasps, so it also holds every compromise between
several indices::

    result = ga.optimize(problem, quality=["manipulability_volume", "force_closure_margin"])
    front = ga.pareto_front(result, "manipulability_volume", "force_closure_margin")       # charts
    ga.plot_pareto(result, "manipulability_volume", "force_closure_margin")
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from graspatlas.errors import GraspAtlasError
from graspatlas.quality.batched import Quality, quality_name
from graspatlas.result.grasp_atlas import GraspAtlas, check_is_result
from graspatlas.support.arrays import Array, IntArray

__all__ = ["knee", "pareto_front", "values_of"]


def pareto_front(result: GraspAtlas, *indices: Quality) -> IntArray:
    """Charts that no other chart dominates, among those that meet the result's requirements.

    One chart dominates another when it is at least as good by every index and better by one; larger is better. Charts
    that are equal by every index count once, by the first of them.

    Args:
        result: The result; its atlas need not be complete, then the front is that of the charts there are.
        *indices: Two or more indices, each a name or a callable: see :mod:`graspatlas.quality`. Those that `optimize`
            was given, ``quality=[a, b]``, are not evaluated again.

    Returns:
        The front [p], the best by the first index first. Takes O(n log n) for two indices, O(n p) for more.

    Raises:
        GraspAtlasError: If fewer than two different indices are given, one is unknown or fails, or no grasp meets the
            requirements.
    """
    check_is_result(result)
    values = values_of(result, *indices)
    charts = np.flatnonzero(result.accepted)
    if len(charts) == 0:
        raise GraspAtlasError("no grasp meets the requirements, so there is no front: relax a requirement")
    return np.asarray(charts[_non_dominated(values[charts])], np.int64)


def values_of(result: GraspAtlas, *indices: Quality) -> Array:
    """Values of several indices at each chart centre [n, m].

    Raises:
        GraspAtlasError: If fewer than two different indices are given, or one is unknown or fails.
    """
    names = [quality_name(index) for index in indices]
    if len(names) < 2 or len(set(names)) < len(names):
        raise GraspAtlasError(f"a Pareto front needs two or more different indices, got {names}")
    return np.column_stack([result.values(index) for index in indices])


def _non_dominated(values: Array) -> IntArray:
    """Rows of values [n, m] that no row dominates, by decreasing first column; the first of equal rows."""
    order = np.lexsort((np.arange(len(values)), *(-values.T[::-1])))
    ranked = values[order]
    # In this order a row can only be dominated, or equalled, by a row before it.
    if values.shape[1] == 2:
        highest = np.maximum.accumulate(ranked[:, 1])
        keep = np.r_[True, ranked[1:, 1] > highest[:-1]]
        return np.asarray(order[keep])
    front: list[int] = []
    left = np.arange(len(ranked))
    while len(left):
        front.append(int(left[0]))
        left = left[(ranked[left] > ranked[left[0]]).any(axis=1)]
    return np.asarray(order[front])


def knee(values: ArrayLike) -> int | None:
    """The point of a front where giving up a little by one index stops to gain much by another.

    With every index scaled to run from 0 to 1 along the front, it is the point with the largest sum: for two indices
    the one farthest above the straight line between the front's ends.

    Args:
        values: Values of the indices along the front [p, m].

    Returns:
        Row of the knee; None when that point is the best by one index, as on a hollow front, or a value is infinite.

    Source: I. Das, "On characterizing the 'knee' of the Pareto curve based on Normal-Boundary Intersection",
        Structural Optimization 18, 1999.
    """
    front = np.asarray(values, float)
    if not np.isfinite(front).all():
        return None
    low, high = front.min(axis=0), front.max(axis=0)
    sums = ((front - low) / np.where(high > low, high - low, 1.0)).sum(axis=1)
    at = int(sums.argmax())
    return None if (front[at] == high).any() else at
