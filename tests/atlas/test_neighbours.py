"""Charts that are near each other: the search, and what neighbours agree on."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import graspatlas as ga
from graspatlas._core import Neighbours


def fill(points: np.ndarray) -> Neighbours:
    tree = Neighbours(points.shape[1])
    for point in points:
        tree.insert(point)
    return tree


def make_points(seed: int, size: int, count: int, kind: str) -> np.ndarray:
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(count, size))
    if kind == "lattice":
        return np.round(points)
    if kind == "sorted":
        return points[np.argsort(points[:, 0])]
    if kind == "reversed":
        return points[np.argsort(-points[:, 0])]
    if kind == "same":
        return np.repeat(points[:1], count, axis=0)
    if kind == "line":
        return np.arange(count)[:, None] * np.eye(size)[0] * 0.01
    return points


@given(
    st.integers(0, 10**6),
    st.integers(1, 30),
    st.integers(1, 400),
    st.sampled_from(["random", "lattice", "sorted", "reversed", "same", "line"]),
    st.sampled_from([0.0, 0.3, 1.0, 3.0]),
)
def test_equals_brute_force(seed, size, count, kind, distance):
    points = make_points(seed, size, count, kind)
    tree = fill(points)
    rng = np.random.default_rng(seed + 1)
    queries = [points[rng.integers(count)], rng.normal(size=size), points[0] + 1e-3]
    for query in queries:
        assert_within(tree, points, query, distance)


def assert_within(tree: Neighbours, points: np.ndarray, query: np.ndarray, distance: float) -> None:
    """All that are near are found, and of the others only some that are hardly farther away."""
    distances = np.linalg.norm(points - query, axis=1)
    far = np.linalg.norm(points[0] - query) + distance
    rounding = 1e-6 * (far + distance) * (points.shape[1] + 4)
    got = tree.within(query, distance)
    assert got == sorted(set(got))
    assert set(np.flatnonzero(distances <= distance)) <= set(got)
    assert set(got) <= set(np.flatnonzero(distances <= distance + rounding))


def test_distances_are_as_exact_far_from_zero() -> None:
    """What counts is how far points are from the first one, not from the origin."""
    rng = np.random.default_rng(3)
    points = np.round(rng.normal(size=(500, 6)) * 2**16) / 2**16  # which stay as they are far away
    near, far = fill(points), fill(points + 2.0**30)
    for query in points[:50]:
        assert len(near.within(query, 3.0)) > 1
        assert near.within(query, 3.0) == far.within(query + 2.0**30, 3.0)


@pytest.mark.parametrize("scale", [1e-50, 1e15, 1e25, 1e60])
def test_none_is_missed_whatever_the_scale(scale: float) -> None:
    """Far from lengths that single precision can hold more may be found than are near, never less."""
    points = np.random.default_rng(4).normal(size=(300, 3))
    tree = fill(points * scale)
    for query in points[:30]:
        near = np.flatnonzero(np.linalg.norm(points - query, axis=1) <= 0.7)
        assert set(near) <= set(tree.within(query * scale, 0.7000001 * scale))


def test_search_while_points_come():
    rng = np.random.default_rng(5)
    points = np.cumsum(rng.normal(scale=0.1, size=(3000, 4)), axis=0)
    tree = Neighbours(4)
    for i, point in enumerate(points):
        if i % 50 == 1:
            assert_within(tree, points[:i], point, 0.5)
        tree.insert(point)


def test_empty_and_wrong_input():
    tree = Neighbours(3)
    assert tree.within([0.0, 0.0, 0.0], 1e9) == []
    with pytest.raises(ga.GraspAtlasError, match="point must hold 3"):
        tree.insert([0.0, 0.0])


def pair_displacements(atlas: ga.Atlas) -> list[tuple[int, int, np.ndarray]]:
    difference = atlas.system.difference
    return [(i, j, difference(atlas.centers[i], atlas.centers[j])) for i, j in atlas.neighbour_pairs]


def assert_neighbours_agree(atlas: ga.Atlas) -> None:
    """The invariants of neighbours, written again from the paper: eqs (17), (18) and Fig. 6b."""
    partners = {}
    for i, j, d in pair_displacements(atlas):
        assert i < j
        assert np.linalg.norm(d) <= 2 * atlas.radius * (1 + 1e-12)
        for chart, other, shift in ((i, j, d), (j, i, -d)):
            image = atlas.bases[chart] @ shift
            partners[chart, other] = image
            assert np.linalg.norm(shift - image @ atlas.bases[chart]) <= atlas.epsilon * (1 + 1e-9)
            # Every vertex of a chart is at least as near to its own centre as to its neighbour's image.
            vertices = atlas.polytope(chart)
            assert (vertices @ image - 0.5 * image @ image).max() <= 1e-9
        cosines = np.linalg.svd(atlas.bases[i] @ atlas.bases[j].T, compute_uv=False)
        assert cosines.min() >= 1 - atlas.epsilon - 1e-9
    for chart in range(atlas.n_charts):
        for normal, offset, tag in zip(*atlas.facets(chart), strict=True):
            if tag >= 0:
                np.testing.assert_allclose(2 * offset * normal, partners[chart, int(tag)], atol=1e-12)


def test_neighbours_agree_on_toys(sphere):
    assert_neighbours_agree(sphere)
    for system, radius in (
        (ga.systems.Torus(0.8, 0.5), 0.2),
        (ga.systems.Rotations(), 0.6),
        (ga.systems.Angles(2), 0.4),
    ):
        x0 = {3: [1.3, 0, 0], 4: [0, 0, 0, 1], 2: [0, 0]}[system.configuration_size]
        assert_neighbours_agree(ga.build_atlas(system, x0, radius=radius, epsilon=0.3))


def test_neighbours_agree_on_grasps(small_result, bottle):
    assert_neighbours_agree(small_result.atlas)
    solid = ga.build_atlas(bottle.system(3), bottle.x1_array, radius=0.4, epsilon=0.5)
    assert solid.n_charts > 200
    assert_neighbours_agree(solid)


def test_all_pairs_are_found(sphere):
    """On the sphere, charts within 2 r of each other all cut each other when epsilon allows it."""
    distances = np.linalg.norm(sphere.centers[:, None] - sphere.centers[None], axis=2)
    i, j = np.nonzero(np.triu(distances <= 2 * sphere.radius, k=1))
    assert set(map(tuple, sphere.neighbour_pairs.tolist())) == set(zip(i.tolist(), j.tolist(), strict=True))
    for chart in (0, 100, sphere.n_charts - 1):
        near = np.flatnonzero((distances[chart] <= 2 * sphere.radius) & (np.arange(sphere.n_charts) != chart))
        assert sphere.neighbours[chart].tolist() == near.tolist()


def test_polytopes_hold_exactly_their_vertices(small_result):
    atlas = small_result.atlas
    for chart in range(0, atlas.n_charts, 7):
        normals, offsets, _ = atlas.facets(chart)
        slack = offsets - atlas.polytope(chart) @ normals.T
        assert slack.min() > -1e-9
        assert ((slack < 1e-9).sum(axis=1) >= atlas.dimension).all()
        assert offsets.min() >= 0.0
        np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0, atol=1e-12)
