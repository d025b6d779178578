"""The polytope of a chart against Qhull, which computes the same thing another way."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import ConvexHull, HalfspaceIntersection, cKDTree

from graspatlas import GraspAtlasError
from graspatlas._core import Polytope


def random_cuts(seed: int, k: int, count: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    normals = rng.normal(size=(count, k))
    return normals / np.linalg.norm(normals, axis=1, keepdims=True), rng.uniform(0.1, 1.3, count)


def with_box(k: int, half_width: float, normals: np.ndarray, offsets: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    box = np.vstack([np.eye(k), -np.eye(k)])
    return np.vstack([box, normals]), np.r_[np.full(2 * k, half_width), offsets]


def brute_vertices(normals: np.ndarray, offsets: np.ndarray) -> np.ndarray:
    k = normals.shape[1]
    if k == 1:
        reach = offsets / normals[:, 0]
        return np.array([[reach[reach > 0].min()], [reach[reach < 0].max()]])
    found = HalfspaceIntersection(np.c_[normals, -offsets], np.zeros(k)).intersections
    return found[np.isfinite(found).all(axis=1)]


def volume(vertices: np.ndarray) -> float:
    return float(np.ptp(vertices)) if vertices.shape[1] == 1 else float(ConvexHull(vertices).volume)


def same_set(a: np.ndarray, b: np.ndarray, tolerance: float) -> bool:
    return bool(cKDTree(a).query(b)[0].max() < tolerance and cKDTree(b).query(a)[0].max() < tolerance)


@pytest.mark.parametrize("k", [1, 2, 3, 4, 5])
def test_starts_as_a_box(k):
    polytope = Polytope(k, 0.7)
    assert polytope.vertices.shape == (2**k, k)
    np.testing.assert_array_equal(np.abs(polytope.vertices), 0.7)
    assert volume(polytope.vertices) == pytest.approx(1.4**k)


@given(st.integers(0, 10**6), st.integers(1, 4), st.integers(1, 25))
def test_equals_the_intersection_of_half_spaces(seed, k, count):
    normals, offsets = random_cuts(seed, k, count)
    polytope, last = Polytope(k, 1.0), 2.0**k
    for i, (normal, offset) in enumerate(zip(normals, offsets, strict=True)):
        before = len(polytope.vertices)
        outside = (polytope.vertices @ normal - offset).max()
        removed = polytope.cut(normal, offset, i)
        assert removed == (outside > 1e-12 * (1.0 + offset))
        assert removed or len(polytope.vertices) == before
        now = volume(polytope.vertices)
        assert now <= last * (1 + 1e-12)
        last = now
    all_normals, all_offsets = with_box(k, 1.0, normals, offsets)
    assert (polytope.vertices @ all_normals.T - all_offsets).max() < 1e-10
    assert polytope.contains(np.zeros(k))
    expected = brute_vertices(all_normals, all_offsets)
    assert same_set(polytope.vertices, expected, 1e-6)
    assert last == pytest.approx(volume(expected), rel=1e-8)


@given(st.integers(0, 10**6), st.integers(1, 4), st.integers(1, 20))
def test_contains_what_is_inside_all_half_spaces(seed, k, count):
    normals, offsets = random_cuts(seed, k, count)
    polytope = Polytope(k, 1.0)
    for i, (normal, offset) in enumerate(zip(normals, offsets, strict=True)):
        polytope.cut(normal, offset, i)
    all_normals, all_offsets = with_box(k, 1.0, normals, offsets)
    points = np.random.default_rng(seed + 1).uniform(-1.1, 1.1, (60, k))
    points = np.vstack([points, 0.2 * points])
    inside = (points @ all_normals.T <= all_offsets).all(axis=1)
    assert [polytope.contains(p) for p in points] == inside.tolist()


@given(
    st.integers(2, 4),
    st.lists(
        st.tuples(st.lists(st.integers(-1, 1), min_size=4, max_size=4), st.sampled_from([0.5, 1.0, 1.5, 2.0])),
        min_size=1,
        max_size=14,
    ),
)
def test_half_spaces_through_vertices_and_twice_the_same(k, cuts):
    """Normals with entries -1, 0, 1 often pass through vertices, or repeat: the degenerate cases."""
    polytope = Polytope(k, 1.0)
    normals, offsets = [], []
    for direction, level in cuts:
        n = np.array(direction[:k], float)
        length = np.linalg.norm(n)
        if length == 0.0:
            continue
        normals.append(n / length)
        offsets.append(level / length)
        polytope.cut(normals[-1], offsets[-1], len(normals))
        assert polytope.cut(normals[-1], offsets[-1], len(normals)) is False
    all_normals, all_offsets = with_box(k, 1.0, np.array(normals).reshape(-1, k), np.array(offsets))
    assert (polytope.vertices @ all_normals.T - all_offsets).max() < 1e-10
    expected = brute_vertices(all_normals, all_offsets)
    assert volume(polytope.vertices) == pytest.approx(volume(expected), rel=1e-9)
    assert cKDTree(polytope.vertices).query(expected)[0].max() < 1e-7


@given(st.integers(0, 10**6), st.integers(1, 4))
def test_half_spaces_through_the_origin_keep_it(seed, k):
    """A chart's centre that lies on a bound has its polytope cut right there."""
    rng = np.random.default_rng(seed)
    polytope = Polytope(k, 1.0)
    normals = random_cuts(seed, k, k)[0]
    for i, normal in enumerate(normals):
        polytope.cut(normal, 0.0, i)
        assert polytope.contains(np.zeros(k), 1e-12)
    assert (polytope.vertices @ normals.T).max() < 1e-9
    points = rng.uniform(-1, 1, (40, k))
    clear = np.abs(points @ normals.T).min(axis=1) > 1e-9
    inside = (points @ normals.T <= 0.0).all(axis=1)
    assert [polytope.contains(p) for p in points[clear]] == inside[clear].tolist()


def outside(vertices: np.ndarray, radius: float, margin: float = 0.0) -> np.ndarray:
    return vertices[np.linalg.norm(vertices, axis=1) > radius + margin]


def all_outer(polytope: Polytope, radius: float) -> np.ndarray:
    """Vertices outside the ball of a polytope that lists only them, each closed when it is the farthest."""
    while (vertex := polytope.expandable_vertex(radius)) >= 0:
        polytope.close(vertex)
    return polytope.vertices


def bisectors(seed: int, k: int, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Half-spaces as neighbours make them, which leave something outside the unit ball or not."""
    rng = np.random.default_rng(seed)
    normals, _ = random_cuts(seed, k, count)
    return normals, rng.uniform(0.45, 1.0, count)


@given(st.integers(0, 10**6), st.integers(2, 4), st.integers(0, 40), st.integers(1, 4))
def test_outer_vertices_are_those_of_the_whole_polytope_outside_the_ball(seed, k, count, parts):
    """Whenever they are asked for on the way; the farthest is the farthest of all."""
    normals, offsets = bisectors(seed, k, count)
    whole, outer = Polytope(k, 1.0), Polytope(k, 1.0, outer=True)
    for part in np.array_split(np.arange(count), parts):
        for i in part:
            whole.cut(normals[i], offsets[i], i)
            outer.cut(normals[i], offsets[i], i)
        vertex = outer.expandable_vertex(1.0)
        expected = outside(whole.vertices, 1.0, 1e-6)
        assert vertex >= 0 or len(expected) == 0
        if vertex >= 0:
            farthest = np.linalg.norm(outer.vertices[vertex])
            assert farthest == pytest.approx(np.linalg.norm(whole.vertices, axis=1).max(), abs=1e-6)
    found = all_outer(outer, 1.0)
    expected = outside(whole.vertices, 1.0)
    if len(expected) and len(found):
        assert cKDTree(found).query(outside(expected, 1.0, 1e-6))[0].max(initial=0.0) < 1e-6
        assert cKDTree(expected).query(outside(found, 1.0, 1e-6))[0].max(initial=0.0) < 1e-6
    else:
        assert len(outside(expected, 1.0, 1e-6)) == len(outside(found, 1.0, 1e-6)) == 0


@given(st.integers(0, 10**6), st.integers(2, 4), st.integers(1, 12))
def test_vertices_that_were_closed_stay_so_until_they_are_cut_off(seed, k, count):
    normals, offsets = bisectors(seed, k, count)
    outer = Polytope(k, 1.0, outer=True)
    before = all_outer(outer, 1.0)
    for i, (normal, offset) in enumerate(zip(normals, offsets, strict=True)):
        outer.cut(normal, offset, i)
        vertex = outer.expandable_vertex(1.0)
        new = [vertex] if vertex >= 0 else []
        kept = before[before @ normal < offset - 1e-6]
        if len(kept):
            assert cKDTree(outer.vertices).query(kept)[0].max() < 1e-9
        assert all(abs(outer.vertices[v] @ normal - offset) < 1e-6 for v in new)
        before = all_outer(outer, 1.0)


@given(
    st.integers(2, 5),
    st.lists(
        st.tuples(st.lists(st.integers(-1, 1), min_size=5, max_size=5), st.sampled_from([0.5, 1.0, 1.5])),
        min_size=1,
        max_size=14,
    ),
)
def test_outer_vertices_where_many_facets_meet(k, cuts):
    """Half-spaces through vertices, or twice the same: vertices that lie on more than k facets are all found."""
    whole, outer = Polytope(k, 1.0), Polytope(k, 1.0, outer=True)
    for direction, level in cuts:
        n = np.array(direction[:k], float)
        length = np.linalg.norm(n)
        if length == 0.0:
            continue
        for polytope in (whole, outer):
            polytope.cut(n / length, level / length, 0)
    expected = outside(whole.vertices, 1.0, 1e-6)
    found = outside(all_outer(outer, 1.0), 1.0, 1e-6)
    assert (len(found) == 0) == (len(expected) == 0)
    if len(expected):
        assert same_set(found, expected, 1e-6)


def test_outer_vertices_of_a_ball_in_six_dimensions():
    """Tangent planes of a smaller ball: the farthest vertex is right, and none is left where the last ones cut all."""
    rng = np.random.default_rng(5)
    normals, _ = random_cuts(5, 6, 40)
    outer = Polytope(6, 1.0, outer=True)
    for i, normal in enumerate(normals):
        outer.cut(normal, 0.6, i)
    vertex = outer.expandable_vertex(1.0)
    farthest = outer.vertices[vertex]
    excess = normals @ farthest - 0.6
    assert excess.max() < 1e-6
    assert (np.sort(np.abs(excess))[: 6 - (np.abs(np.abs(farthest) - 1.0) < 1e-6).sum()] < 1e-6).all()
    inside = [u for u in rng.uniform(-1.0, 1.0, (200_000, 6)) if (normals @ u <= 0.6).all()]
    assert np.linalg.norm(inside, axis=1).max() < np.linalg.norm(farthest)
    for direction in np.r_[np.eye(6), -np.eye(6)]:
        outer.cut(direction, 0.4, 99)
    assert outer.expandable_vertex(1.0) == -1
    assert len(outer.vertices) == 0


def test_many_half_spaces_round_a_ball():
    """More facets than bits in a word: 500 tangent planes of a ball of radius 0.5."""
    normals, _ = random_cuts(3, 3, 500)
    polytope = Polytope(3, 1.0)
    for i, normal in enumerate(normals):
        polytope.cut(normal, 0.5, i)
    expected = brute_vertices(*with_box(3, 1.0, normals, np.full(500, 0.5)))
    assert same_set(polytope.vertices, expected, 1e-6)
    assert volume(polytope.vertices) == pytest.approx(volume(expected), rel=1e-9)
    assert volume(polytope.vertices) > 4 / 3 * np.pi * 0.125


def test_facets_that_were_cut_away_are_forgotten():
    """Nested triangles: only the last three facets remain, however many came before."""
    polytope = Polytope(2, 1.0)
    angles = np.deg2rad([90.0, 210.0, 330.0])
    for offset in np.linspace(0.4, 0.1, 40):
        for i, angle in enumerate(angles):
            polytope.cut([np.cos(angle), np.sin(angle)], offset, i)
    assert len(polytope.vertices) == 3
    np.testing.assert_allclose(np.linalg.norm(polytope.vertices, axis=1), 0.2, atol=1e-12)


def test_wrong_input():
    for dimension in (0, -1, 13):
        with pytest.raises(GraspAtlasError, match="dimensions"):
            Polytope(dimension, 1.0)
    polytope = Polytope(2, 1.0)
    with pytest.raises(GraspAtlasError, match="origin"):
        polytope.cut([1.0, 0.0], -0.1, 0)
    with pytest.raises(GraspAtlasError, match="origin"):
        polytope.cut([1.0, 0.0], float("nan"), 0)
    with pytest.raises(GraspAtlasError, match="normal must hold 2"):
        polytope.cut([1.0, 0.0, 0.0], 0.1, 0)
