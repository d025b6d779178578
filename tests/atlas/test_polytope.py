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
