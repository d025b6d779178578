"""Grasps found without the atlas lie in it: random walks on the manifold, projected by Newton's method in NumPy."""

from __future__ import annotations

import numpy as np
import pytest
from oracles.random_walks import walks
from scipy.optimize import linprog, minimize

import graspatlas as ga
from graspatlas.atlas.coverage import measure_coverage


def assert_covered(atlas: ga.Atlas, x0: np.ndarray, count: int, seed: int, share: float, spread: float) -> None:
    points = walks(atlas, x0, count, seed)
    residuals = [np.abs(atlas.system.evaluate_residual(x)).max(initial=0.0) for x in points]
    assert max(residuals) < 1e-9
    found = [atlas.locate(x) for x in points]
    charts, distances = np.array([chart for chart, _ in found]), np.array([d for _, d in found])
    assert (charts >= 0).all()
    assert (distances == 0.0).mean() >= share
    # Flat charts of a curved manifold leave slivers, much narrower than a chart.
    assert distances.max() <= 0.15 * atlas.radius
    assert len(set(charts.tolist())) >= spread * atlas.n_charts


@pytest.mark.slow
def test_the_can_is_covered(can_result):
    assert_covered(can_result.atlas, can_result.problem.x1_array, 10_000, 1, 0.97, 0.5)


def test_the_bottle_is_covered(bottle_result):
    x0 = bottle_result.atlas.centers[0]
    assert_covered(bottle_result.atlas, x0, 3_000, 2, 0.97, 0.6)


def test_the_bottle_is_covered_in_three_dimensions(bottle):
    atlas = ga.build_atlas(bottle.system(3), bottle.x1_array, radius=0.2, epsilon=0.5)
    assert_covered(atlas, atlas.centers[0], 3_000, 3, 0.95, 0.3)


@pytest.mark.parametrize(
    ("system", "radius", "charts"),
    [(ga.systems.Sphere(3), 0.2, 0.9), (ga.systems.Torus(0.8, 0.5), 0.2, 0.9), (ga.systems.Sphere(4), 0.4, 0.9)],
    ids=["sphere", "torus", "3-sphere"],
)
def test_toys_are_covered(system, radius, charts):
    x0 = np.zeros(system.configuration_size)
    x0[0] = 1.3 if isinstance(system, ga.systems.Torus) else 1.0
    atlas = ga.build_atlas(system, x0, radius=radius, epsilon=0.1)
    assert_covered(atlas, x0, 4_000, 4, 0.95, charts)


def test_rotations_and_angles_are_covered():
    rng = np.random.default_rng(5)
    rotations = ga.build_atlas(ga.systems.Rotations(), [0, 0, 0, 1], radius=0.4, epsilon=0.5)
    for _ in range(1000):
        q = rng.normal(size=4)
        chart, distance = rotations.locate(q / np.linalg.norm(q))
        assert chart >= 0
        assert distance <= 0.15 * 0.4
    angles = ga.build_atlas(ga.systems.Angles(2), [0, 0], radius=0.2, epsilon=0.5)
    assert all(angles.locate(rng.uniform(-np.pi, np.pi, 2))[1] < 1e-9 for _ in range(1000))


def nearest_by_brute_force(atlas: ga.Atlas, x: np.ndarray) -> float:
    """Distance of x's image from the nearest polytope among all charts that are near enough."""
    best = np.inf
    for chart in range(atlas.n_charts):
        d = atlas.system.difference(atlas.centers[chart], x)
        u = atlas.bases[chart] @ d
        image = atlas.system.embed(atlas.centers[chart]) - atlas.system.embed(x)
        if np.linalg.norm(image) > 2 * atlas.radius or np.linalg.norm(d - u @ atlas.bases[chart]) > atlas.epsilon:
            continue
        normals, offsets, _ = atlas.facets(chart)
        if (normals @ u <= offsets).all():
            return 0.0
        if (normals @ u - offsets).max() < best:
            best = min(best, polytope_distance(u, normals, offsets))
    return best


def polytope_distance(u: np.ndarray, normals: np.ndarray, offsets: np.ndarray) -> float:
    start = linprog(np.zeros(len(u)), A_ub=normals, b_ub=offsets, bounds=(None, None)).x
    found = minimize(
        lambda w: ((w - u) ** 2).sum(),
        start,
        jac=lambda w: 2 * (w - u),
        constraints={"type": "ineq", "fun": lambda w: offsets - normals @ w, "jac": lambda w: -normals},
        method="SLSQP",
        options={"ftol": 1e-15, "maxiter": 200},
    )
    return float(np.sqrt(found.fun))


@pytest.mark.parametrize("k", [2, 3])
def test_locate_equals_brute_force(bottle, k):
    """Points above the edges of charts, so that some lie in no polytope; holes are cut by leaving charts out."""
    whole = ga.build_atlas(bottle.system(k), bottle.x1_array, radius=0.2 if k == 2 else 0.4, epsilon=0.5)
    short = ga.build_atlas(
        bottle.system(k), bottle.x1_array, radius=whole.radius, epsilon=0.5, max_charts=whole.n_charts // 2
    )
    rng = np.random.default_rng(6)
    distances = []
    for atlas in (whole, short):
        for _ in range(25):
            chart = rng.integers(whole.n_charts)
            x = whole.point(chart, rng.uniform(-1, 1, k) * whole.radius)
            if x is None:
                continue
            found, distance = atlas.locate(x)
            expected = nearest_by_brute_force(atlas, x)
            assert (found < 0) == np.isinf(expected)
            if found >= 0:
                assert distance == pytest.approx(expected, abs=1e-6)
                normals, offsets, _ = atlas.facets(found)
                u = atlas.bases[found] @ atlas.system.difference(atlas.centers[found], x)
                assert ((normals @ u <= offsets).all()) == (distance == 0.0)
            distances.append(distance)
    assert sum(d == 0.0 for d in distances) > 10
    assert sum(d > 0.0 for d in distances) > 3


def test_locate_far_away():
    atlas = ga.build_atlas(ga.systems.Sphere(3), [0, 0, 1], radius=0.1, epsilon=0.1, max_charts=5)
    assert atlas.locate([0.0, 0.0, -1.0]) == (-1, np.inf)
    with pytest.raises(ga.GraspAtlasError):
        atlas.locate([0.0, 1.0])
    with pytest.raises(ValueError, match=r"finite|NaN|nan"):
        atlas.locate([np.nan, 0.0, 1.0])


def test_coverage_finds_what_an_unfinished_atlas_leaves_out():
    system = ga.systems.Sphere(3)
    whole = ga.build_atlas(system, [1, 0, 0], radius=0.2, epsilon=0.2)
    found = measure_coverage(whole, system)
    assert found.points > 250
    assert found.inside > 0.97
    assert found.farthest < 0.05
    part = ga.build_atlas(system, [1, 0, 0], radius=0.2, epsilon=0.2, max_charts=60)
    assert measure_coverage(part, system).farthest == np.inf
