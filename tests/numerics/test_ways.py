"""Shortest ways, against SciPy's."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from graspatlas.numerics.ways import shortest_ways


def test_ways_are_those_of_scipy() -> None:
    rng = np.random.default_rng(3)
    n = 500
    pairs = np.unique(rng.integers(0, n, (900, 2)), axis=0)
    pairs = pairs[pairs[:, 0] != pairs[:, 1]]
    lengths = rng.uniform(0.1, 1.0, len(pairs))
    starts = np.array([3, 77, 200])
    graph = coo_array((lengths, pairs.T), (n, n)).tocsr()
    _, expected, _ = dijkstra(graph, indices=starts, min_only=True, return_predecessors=True)
    expected = np.where(expected < 0, -1, expected)
    assert (expected == -1).sum() > len(starts)  # no way leads to some
    np.testing.assert_array_equal(shortest_ways(n, pairs, lengths, starts), expected)


def test_no_links_lead_nowhere() -> None:
    np.testing.assert_array_equal(shortest_ways(3, np.zeros((0, 2), int), np.zeros(0), np.array([1])), [-1, -1, -1])
