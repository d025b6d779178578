"""Shortest ways along links from thing to thing."""

from __future__ import annotations

import numpy as np

from graspatlas.support.arrays import Array, IntArray

__all__ = ["shortest_ways"]


def shortest_ways(count: int, pairs: IntArray, lengths: Array, starts: IntArray) -> IntArray:
    """The thing before each on its shortest way from the nearest start [count]; -1 of starts and of what none leads to.

    All things whose way has become shorter correct those behind them at once, until no way becomes shorter.

    Args:
        count: How many things there are.
        pairs: Links, each from its first thing to its second (p, 2).
        lengths: How long they are (p,), positive.
        starts: Where ways start (s,).

    Source: R. Bellman, "On a routing problem", Quarterly of Applied Mathematics 16 (1958).
    """
    order = np.argsort(pairs[:, 0], kind="stable")
    (tails, heads), lengths = pairs[order].T, lengths[order]
    rows = np.searchsorted(tails, np.arange(count + 1))
    way, before = np.full(count, np.inf), np.full(count, -1, np.int64)
    way[starts] = 0.0
    front = np.asarray(starts)
    while len(front):
        many = rows[front + 1] - rows[front]
        links = np.repeat(rows[front] - np.cumsum(many) + many, many) + np.arange(many.sum())
        found = way[tails[links]] + lengths[links]
        shorter = found < way[heads[links]]
        links, found = links[shorter], found[shorter]
        np.minimum.at(way, heads[links], found)
        links = links[found == way[heads[links]]]
        before[heads[links]] = tails[links]
        front = np.unique(heads[links])
    return before
