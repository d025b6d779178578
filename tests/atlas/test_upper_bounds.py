"""Upper bounds of a function within charts, estimated from the centres: rarely exceeded, and of use."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from helpers import PythonSphere, slow_but
from numpy.typing import NDArray
from oracles.manifolds import Ellipsoid, traced

import graspatlas as ga
from graspatlas.atlas.grid import Grid, lay_grid

Array = NDArray[np.float64]
Function = Callable[[Array], Array]

#: Functions of points [n, m] that are smooth, with several maxima, and with a kink where two of them change places.
FUNCTIONS: dict[str, Function] = {
    "height": lambda X: X[:, -1],
    "waves": lambda X: np.sin(3.0 * X[:, 0]) * np.cos(2.0 * X[:, 1]) + 0.3 * X[:, -1] ** 2,
    "hill": lambda X: np.exp(-4.0 * ((X - X[0]) ** 2).sum(axis=1)),
    "smaller": lambda X: np.minimum(X[:, 0], 0.5 * X[:, 1]),
    "larger": lambda X: np.maximum(X[:, 0], 0.5 * X[:, 1]),
}


@cache
def sphere_atlas(k: int) -> ga.Atlas:
    radius = {1: 0.1, 2: 0.15, 3: 0.3}[k]
    return ga.build_atlas(ga.systems.Sphere(k + 1), np.eye(k + 1)[-1], radius=radius, epsilon=0.3, progress=False)


@cache
def ellipsoid_atlas() -> ga.Atlas:
    return traced(Ellipsoid(1.0, 0.7, 0.3), 0.1)


@pytest.fixture(scope="module")
def torus() -> ga.Atlas:
    return ga.build_atlas(ga.systems.Torus(1.0, 0.4), [1.4, 0.0, 0.0], radius=0.1, epsilon=0.1, progress=False)


class Flat(ga.System):
    """A flat space of some dimension in one more, within a box."""

    def __init__(self, dimension: int, half_width: float = 1.0) -> None:
        super().__init__(
            dimension + 1, 1, lower=[-half_width] + dimension * [-1.0], upper=[half_width] + dimension * [1.0]
        )

    def residual(self, x: Array) -> Array:
        return x[-1:]

    def jacobian(self, x: Array) -> Array:
        return np.eye(len(x))[-1:]


@cache
def samples(atlas: ga.Atlas) -> Grid:
    return lay_grid(atlas, atlas.radius / (6.0 if atlas.dimension < 3 else 3.0), progress=False)


def tops(atlas: ga.Atlas, function: Function) -> Array:
    """The largest value of a function among the samples of each chart."""
    grid = samples(atlas)
    values = function(np.vstack([atlas.centers[:1], grid.x]))[1:]  # "hill" is about the first centre
    highest = np.full(atlas.n_charts, -np.inf)
    np.maximum.at(highest, grid.charts, values)
    return highest


def check_bounds(atlas: ga.Atlas, function: Function, most_open: float = 0.05) -> None:
    """At most one chart in a hundred exceeds its bound, few bounds exceed the maximum, and none is far too high."""
    values = function(atlas.centers)
    bounds = ga.estimate_upper_bounds(atlas, values)
    highest = tops(atlas, function)
    known = np.isfinite(bounds)
    assert known.mean() > 0.98
    assert (bounds >= values).all()
    assert (highest > bounds + 1e-12).sum() <= max(1, 0.01 * atlas.n_charts)
    # Those that it exceeds, it exceeds by little.
    assert (highest - bounds).max() < 0.02 * np.ptp(values)
    assert (bounds[known] > highest.max()).mean() < most_open
    assert np.median((bounds - highest)[known]) < 0.25 * np.ptp(values)


@pytest.mark.parametrize("name", FUNCTIONS)
@pytest.mark.parametrize("k", slow_but([1, 2, 3], 1, 2))
def test_on_spheres(k: int, name: str) -> None:
    """The charts of three dimensions are so wide that less than half a wave lies in one."""
    check_bounds(sphere_atlas(k), FUNCTIONS[name], 0.3 if k == 3 else 0.06)


@pytest.mark.parametrize("name", FUNCTIONS)
def test_on_a_torus(torus: ga.Atlas, name: str) -> None:
    """Its height has a whole circle of maxima."""
    check_bounds(torus, FUNCTIONS[name], 0.15 if name == "height" else 0.05)


@pytest.mark.parametrize("name", ["height", "waves", "smaller"])
def test_on_a_flat_ellipsoid(name: str) -> None:
    check_bounds(ellipsoid_atlas(), FUNCTIONS[name])


@pytest.mark.parametrize("dimension", [1, 2, 3])
def test_a_linear_function_is_bounded_by_itself(dimension: int) -> None:
    """On flat charts the estimate of a linear function is the function at the highest corner."""
    atlas = ga.build_atlas(Flat(dimension), np.zeros(dimension + 1), radius=0.4, epsilon=0.3, progress=False)
    slope = np.append(np.arange(1.0, dimension + 1.0), 0.0)
    values = atlas.centers @ slope + 5.0
    bounds = ga.estimate_upper_bounds(atlas, values)
    corners = [slope @ atlas.bases[i].T @ atlas.polytope(i).T for i in range(atlas.n_charts)]
    exact = values + [corner.max() for corner in corners]
    known = np.isfinite(bounds)
    assert known.sum() > atlas.n_charts / 2
    np.testing.assert_allclose(bounds[known], exact[known], rtol=1e-9)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_paraboloid_is_bounded_at_the_rim_too(sign: float) -> None:
    """Charts at the bounds have neighbours on one side alone, which tilts what their slopes would be."""
    atlas = ga.build_atlas(Flat(2, 0.3), [0.0, 0.0, 0.0], radius=0.15, epsilon=0.3, progress=False)
    bowl = lambda X: sign * (X[:, 0] ** 2 + X[:, 1] ** 2)  # noqa: E731
    bounds = ga.estimate_upper_bounds(atlas, bowl(atlas.centers))
    highest = tops(atlas, bowl)
    known = np.isfinite(bounds)
    assert known.mean() > 0.9
    assert (highest <= bounds + 1e-9).all()
    # Of a cap only the charts round its top reach above it.
    if sign < 0.0:
        near = np.linalg.norm(atlas.centers, axis=1) < 4.0 * atlas.radius
        assert not (bounds > 1e-9)[known & ~near].any()


def test_a_spike_between_the_centres_is_not_seen(torus: ga.Atlas) -> None:
    """What the estimate cannot know, as the docs say: values at the centres tell nothing of it."""
    chart = 40
    peak = torus.point(chart, torus.polytope(chart)[0] / 2.0)
    assert peak is not None
    width = 0.05 * torus.radius

    def spiked(X: Array) -> Array:
        return X[:, -1] + np.exp(-0.5 * ((X - peak) ** 2).sum(axis=1) / width**2)

    bounds = ga.estimate_upper_bounds(torus, spiked(torus.centers))
    assert spiked(peak[None])[0] > 1.0 + peak[-1] - 1e-9
    assert bounds[chart] < peak[-1] + 0.1
    # One that the centres see raises the bounds around it.
    wide = torus.centers[:, -1] + np.exp(-0.5 * ((torus.centers - peak) ** 2).sum(axis=1) / torus.radius**2)
    assert ga.estimate_upper_bounds(torus, wide)[chart] >= 1.0 + peak[-1]


def test_a_constant_leaves_nothing_open(torus: ga.Atlas) -> None:
    bounds = ga.estimate_upper_bounds(torus, np.full(torus.n_charts, 0.3))
    np.testing.assert_allclose(bounds, 0.3, rtol=1e-12)


def test_it_scales_with_the_function(torus: ga.Atlas) -> None:
    values = FUNCTIONS["waves"](torus.centers)
    bounds = ga.estimate_upper_bounds(torus, values)
    np.testing.assert_allclose(ga.estimate_upper_bounds(torus, 1e6 * values - 7.0), 1e6 * bounds - 7.0, rtol=1e-9)


def test_too_few_neighbours_are_infinite() -> None:
    atlas = ga.build_atlas(PythonSphere(3), [0.0, 0.0, 1.0], radius=0.2, epsilon=0.3, max_charts=3, progress=False)
    assert np.isinf(ga.estimate_upper_bounds(atlas, np.arange(3.0))).all()
    whole = sphere_atlas(2)
    # Without their facets to neighbours on one side, charts do not know how the function changes across it.
    lost = 7
    cut = (np.repeat(np.arange(whole.n_charts), np.diff(whole.facet_start)) == lost) & (
        whole.facet_normals[:, 0] > -0.9
    )
    alone = replace(whole, facet_tags=np.where(cut, -1, whole.facet_tags).astype(np.int32))
    bounds = ga.estimate_upper_bounds(alone, whole.centers[:, 0])
    assert bounds[lost] == np.inf
    assert np.isinf(bounds).sum() == 1


@pytest.mark.parametrize("value", [np.inf, -np.inf, 1e308])
def test_values_that_are_not_finite_or_huge(torus: ga.Atlas, value: float) -> None:
    values = torus.centers[:, -1].copy()
    values[5] = value
    bounds = ga.estimate_upper_bounds(torus, values)
    assert np.isinf(bounds[5])
    assert np.isinf(bounds[torus.neighbours[5]]).sum() >= 3
    assert not np.isnan(bounds).any()
    away = np.setdiff1d(np.arange(torus.n_charts), np.concatenate([torus.neighbours[j] for j in torus.neighbours[5]]))
    clean = ga.estimate_upper_bounds(torus, torus.centers[:, -1])
    np.testing.assert_allclose(bounds[away], clean[away], rtol=1e-12)


def test_five_thousand_charts_take_a_moment(torus: ga.Atlas) -> None:
    atlas = ga.build_atlas(ga.systems.Torus(1.0, 0.4), [1.4, 0.0, 0.0], radius=0.037, epsilon=0.1, progress=False)
    assert atlas.n_charts > 4500
    took = []
    for _ in range(5):
        start = time.perf_counter()
        ga.estimate_upper_bounds(atlas, atlas.centers[:, 0])
        took.append(time.perf_counter() - start)
    assert min(took) < 0.1


def test_misuse(torus: ga.Atlas) -> None:
    for values in (np.zeros(3), 1.0, np.zeros((torus.n_charts, 2))):
        with pytest.raises(
            ga.GraspAtlasError, match=f"values must be {torus.n_charts} numbers, one a chart, got shape"
        ):
            ga.estimate_upper_bounds(torus, values)
    with pytest.raises(ga.GraspAtlasError, match="NaN among them"):
        ga.estimate_upper_bounds(torus, np.full(torus.n_charts, np.nan))
    with pytest.raises(ga.GraspAtlasError, match="values must be an array of numbers"):
        ga.estimate_upper_bounds(torus, "high")
