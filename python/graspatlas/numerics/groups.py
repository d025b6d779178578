"""Groups of things that are linked, directly or through others."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from graspatlas.support.arrays import IntArray

__all__ = ["linked_groups"]


def linked_groups(count: int, pairs: ArrayLike) -> IntArray:
    """Number of the group that each of so many things is in [count], groups numbered by their first members.

    Every thing points to one of its group, at first itself. A link lets the later of two groups point into the earlier
    one, all at once, until no link joins two groups.

    Args:
        count: How many things there are.
        pairs: Those that are linked (p, 2).
    """
    first = np.arange(count)
    i, j = np.asarray(pairs, np.int64).reshape(-1, 2).T
    while True:
        a, b = first[i], first[j]
        joined = a != b
        if not joined.any():
            return np.unique(first, return_inverse=True)[1].reshape(-1).astype(np.int64)
        i, j = i[joined], j[joined]
        low, high = np.minimum(a, b)[joined], np.maximum(a, b)[joined]
        np.minimum.at(first, high, low)
        while (first[first] != first).any():
            first = first[first]
