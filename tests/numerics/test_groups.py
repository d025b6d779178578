"""Groups of linked things, as SciPy's connected components."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from graspatlas.numerics.groups import linked_groups


@pytest.mark.parametrize("links", [0, 20, 80, 300])
def test_groups_are_the_connected_components(links: int) -> None:
    rng = np.random.default_rng(links)
    pairs = rng.integers(0, 100, (links, 2))
    graph = coo_array((np.ones(links), pairs.T), shape=(100, 100))
    assert linked_groups(100, pairs).tolist() == connected_components(graph, directed=False)[1].tolist()


def test_a_long_chain_is_one_group() -> None:
    order = np.random.default_rng(0).permutation(2000)
    assert set(linked_groups(2000, np.column_stack([order[:-1], order[1:]]))) == {0}


def test_nothing() -> None:
    assert linked_groups(0, np.zeros((0, 2))).tolist() == []
