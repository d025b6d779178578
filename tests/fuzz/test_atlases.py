"""Fuzzing of atlases and systems."""

from __future__ import annotations

import numpy as np
import pytest
from drawn import INF, anything, few, no_numbers, odd_numbers, tried, vectors
from helpers import Written
from hypothesis import given
from hypothesis import strategies as st

import graspatlas as ga
from graspatlas.atlas.coverage import measure_coverage
from graspatlas.atlas.verification import check_atlas
from graspatlas.systems import Angles, Rotations, Sphere, Torus

SYSTEMS = [
    (Sphere(2), [0.6, 0.8]),
    (Sphere(3), [0.0, 0.6, 0.8]),
    (Sphere(4), [0.0, 0.0, 0.6, 0.8]),
    (Torus(0.8, 0.5), [1.3, 0.0, 0.0]),
    (Angles(2), [3.1, -3.1]),
    (Rotations(), [0.0, 0.0, 0.0, 1.0]),
]


@given(
    case=st.sampled_from(SYSTEMS),
    radius=st.floats(0.0, 2.0) | odd_numbers | no_numbers,
    epsilon=st.floats(0.0, 1.0) | odd_numbers | no_numbers,
    max_charts=st.just(40) | anything,
)
@few(300)
def test_build_atlas_options(case, radius, epsilon, max_charts):
    system, x0 = case
    limits = {"max_charts": max_charts, "max_seconds": 0.05}
    atlas = tried(lambda: ga.build_atlas(system, x0, radius=radius, epsilon=epsilon, **limits))
    if atlas is not None:
        report = check_atlas(atlas)
        assert report, report


@given(case=st.sampled_from(SYSTEMS), data=st.data())
@few(150)
def test_build_atlas_first_points(case, data):
    system, x0 = case
    point = data.draw(anything | st.lists(odd_numbers, min_size=len(x0), max_size=len(x0)))
    atlas = tried(lambda: ga.build_atlas(system, point, radius=0.3, epsilon=0.3, max_charts=5))
    if atlas is not None:
        assert check_atlas(atlas)


@given(system=anything, max_seconds=anything)
@few(60)
def test_build_atlas_other_types(system, max_seconds):
    assert tried(lambda: ga.build_atlas(system, [1.0, 0.0], radius=0.1, epsilon=0.1)) is None
    options = {"radius": 0.5, "epsilon": 0.1, "max_charts": 9}
    atlas = tried(lambda: ga.build_atlas(Sphere(3), [0, 0, 1], max_seconds=max_seconds, **options))
    if atlas is not None:
        assert check_atlas(atlas)
        assert atlas.n_charts == 9 or (atlas.status is ga.Status.TIME_LIMIT and max_seconds < 1.0)
    elif isinstance(max_seconds, float):
        assert not 0.0 < max_seconds < INF


@given(n=anything, e=anything, lower=anything, upper=anything)
@few(150)
def test_systems_of_any_size(n, e, lower, upper):
    system = tried(lambda: ga.System(n, e, lower, upper), TypeError)
    if system is not None:
        assert (system.configuration_size, system.n_equations, system.dimension) == (n, e, n - e)
        finite = [np.isfinite(np.broadcast_to(np.asarray(bound, float), n)) for bound in (lower, upper)]
        assert len(system.bound_normals) == sum(int(flags.sum()) for flags in finite)
    torus = tried(lambda: Torus(n, e), TypeError)
    if torus is not None:
        assert n > e > 0.0
        assert abs(torus.evaluate_residual([n + e, 0.0, 0.0])[0]) <= 1e-12 * max(1.0, (n + e) ** 2)
    if not isinstance(n, int) or n < 1000:
        sphere = tried(lambda: Sphere(n), TypeError)
        assert sphere is None or sphere.evaluate_residual(np.eye(int(n))[0])[0] == 0.0
        angles = tried(lambda: Angles(n), TypeError)
        assert angles is None or (angles.dimension, angles.n_equations) == (n, 0)


@given(residual=anything, jacobian=anything, good=st.integers(0, 2))
@few(150)
def test_systems_that_return_anything(residual, jacobian, good):
    """The system is right for a while, then returns what it likes."""
    calls = 0

    def wrong(value, right):
        nonlocal calls
        calls += 1
        return right if calls <= 12 * good else value

    system = Written(3, 1, lambda x: wrong(residual, [x @ x - 1.0]), lambda x: wrong(jacobian, [2.0 * x]))
    atlas = tried(
        lambda: ga.build_atlas(system, [0.0, 0.6, 0.8], radius=0.3, epsilon=0.3, max_charts=10, max_seconds=0.5),
        TypeError,
        ValueError,
        OverflowError,
    )
    if atlas is not None:
        assert np.isfinite(atlas.centers).all()


@given(scale=st.floats(-6, 6), noise=st.floats(0.01, 10.0), seed=st.integers(0, 99))
@few(40)
def test_a_wrong_jacobian_is_found_out(scale, noise, seed):
    factor = 10.0**scale
    wrong = noise * np.random.default_rng(seed).normal(size=(1, 3))

    def build(jacobian):
        system = Written(3, 1, lambda x: [factor * (x @ x - 1.0)], jacobian)
        return ga.build_atlas(system, [0.0, 0.6, 0.8], radius=0.3, epsilon=0.3, max_charts=10)

    with pytest.raises(ga.GraspAtlasError, match="jacobian"):
        build(lambda x: factor * (2.0 * x[None] + wrong))
    assert build(lambda x: factor * 2.0 * x[None]).n_charts == 10


@pytest.mark.parametrize("scale", [0.5, -1.0, 1.02, 2.0])
def test_a_jacobian_that_misses_a_factor_is_found_out(scale):
    system = Written(3, 1, lambda x: [x @ x - 1.0], lambda x: [scale * 2.0 * x])
    with pytest.raises(ga.GraspAtlasError, match="jacobian"):
        ga.build_atlas(system, [0.0, 0.6, 0.8], radius=0.3, epsilon=0.3)


def test_equations_that_become_redundant_close_the_atlas_there():
    """A meridian of the upper half of a sphere; on the lower half its equation says nothing."""
    system = Written(
        3,
        2,
        lambda x: [x @ x - 1.0, x[1] * max(x[2], 0.0) ** 2],
        lambda x: [2.0 * x, [0.0, max(x[2], 0.0) ** 2, 2.0 * x[1] * max(x[2], 0.0)]],
    )
    atlas = ga.build_atlas(system, [0.0, 0.0, 1.0], radius=0.1, epsilon=0.2, max_charts=500)
    assert check_atlas(atlas)
    assert atlas.closed_vertices["curvature"] + atlas.closed_vertices["not_converged"] > 0
    assert atlas.n_charts < 100


def test_a_point_without_tangent_space_hides_nothing():
    """A double cone, bounded: at its apex the equation has no slope, and both halves are covered all the same."""

    class Cone(ga.System):
        def __init__(self):
            super().__init__(3, 1, lower=-0.4, upper=0.4)

        def residual(self, x):
            return [x[0] ** 2 + x[1] ** 2 - x[2] ** 2]

        def jacobian(self, x):
            return [[2.0 * x[0], 2.0 * x[1], -2.0 * x[2]]]

    atlas = ga.build_atlas(Cone(), [0.3, 0.0, 0.3], radius=0.05, epsilon=0.2)
    assert check_atlas(atlas)
    assert atlas.centers[:, 2].min() < -0.3
    assert measure_coverage(atlas, atlas.system).farthest < 0.5


@given(x=anything | vectors, u=anything, chart=anything)
@few(150)
def test_atlas_methods(sphere, x, u, chart):
    found = tried(lambda: sphere.locate(x))
    if found is not None:
        assert found[0] == -1 or found[1] < 0.2
    point = tried(lambda: sphere.point(0, u))
    assert point is None or abs(np.linalg.norm(point) - 1.0) < 1e-9
    tried(lambda: sphere.point(chart, [0.01, 0.0]), IndexError, TypeError, ValueError)
