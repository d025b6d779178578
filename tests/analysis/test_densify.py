"""Denser grids: near every point of the manifold, inside polytopes and bounds, and where the index promises most."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from helpers import PythonSphere, Written, slow_but
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.spatial import cKDTree

import graspatlas as ga
from graspatlas.analysis.densify import by_promise, densify, jumps
from graspatlas.atlas.grid import Grid, _nearest_points, lay_grid, most_samples
from graspatlas.cli import main
from graspatlas.requirements.lost import Lost

Array = NDArray[np.float64]

ON_MANIFOLD = 1e-10  # largest entry of |R(x)|
INSIDE = 1e-9  # how far rounding may carry a point out of a half-space


def ball_atlas(k: int, radius: float = 0.3) -> ga.Atlas:
    """An atlas of the unit sphere of dimension k."""
    return ga.build_atlas(ga.systems.Sphere(k + 1), np.eye(k + 1)[-1], radius=radius, epsilon=0.3)


@pytest.fixture(scope="module")
def torus() -> ga.Atlas:
    return ga.build_atlas(ga.systems.Torus(1.0, 0.4), [1.4, 0.0, 0.0], radius=0.1, epsilon=0.1)


def excesses(atlas: ga.Atlas, grid: Grid) -> Array:
    """By how much each sample is outside its polytope; negative inside."""
    return np.array(
        [
            (normals @ u - offsets).max()
            for chart, u in zip(grid.charts, grid.u, strict=True)
            for normals, offsets, _ in [atlas.facets(int(chart))]
        ]
    )


def overlap(atlas: ga.Atlas, grid: Grid) -> float:
    """How deep a sample of one chart lies in the polytope of a neighbour, at most."""
    depth = 0.0
    for chart, x in zip(grid.charts, grid.x, strict=True):
        for other in atlas.neighbours[int(chart)]:
            normals, offsets, _ = atlas.facets(int(other))
            u = atlas.bases[other] @ atlas.system.difference(atlas.centers[other], x)
            depth = max(depth, -float((normals @ u - offsets).max()))
    return depth


@pytest.mark.parametrize("k", slow_but([1, 2, 3], 1, 2))
def test_samples_are_points_of_the_manifold_above_their_polytopes(k: int) -> None:
    atlas = ball_atlas(k)
    grid = lay_grid(atlas, 0.11)
    assert grid.complete
    assert (grid.not_converged, grid.outside) == (0, 0)
    assert max(np.abs(atlas.system.evaluate_residual(x)).max() for x in grid.x) < ON_MANIFOLD
    assert excesses(atlas, grid).max() < INSIDE
    assert (np.diff(grid.charts) >= 0).all()
    for i in range(0, len(grid), 37):
        np.testing.assert_array_equal(atlas.point(int(grid.charts[i]), grid.u[i]), grid.x[i])
    origins = grid.charts[(grid.u == 0.0).all(axis=1)]
    np.testing.assert_array_equal(origins, np.arange(atlas.n_charts))


@pytest.mark.parametrize(("spacing", "tolerance"), [(0.03, 0.06), pytest.param(0.012, 0.01, marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", ["sphere", "torus"])
def test_there_are_as_many_samples_as_cells_and_a_rim(
    sphere: ga.Atlas, torus: ga.Atlas, name: str, spacing: float, tolerance: float
) -> None:
    atlas, area = (sphere, 4.0 * np.pi) if name == "sphere" else (torus, 4.0 * np.pi**2 * 0.4)
    grid = lay_grid(atlas, spacing)
    interior = excesses(atlas, grid) < -INSIDE
    # Chart by chart the count of a lattice in a polygon is off by its rim; over all charts that averages out.
    cells = atlas.volumes.sum() / spacing**2
    assert interior.sum() == pytest.approx(cells, rel=tolerance)
    assert cells == pytest.approx(area / spacing**2, rel=0.015)
    corners = [atlas.polytope(i) for i in range(atlas.n_charts)]
    rim = sum(np.linalg.norm(c - np.roll(c, 1, axis=0), axis=1).sum() for c in corners)
    # A strip of half a cell's diagonal round each polygon, and its corners.
    assert (~interior).sum() < np.sqrt(0.5) * rim / spacing + 4.0 * atlas.n_charts
    assert len(grid) <= most_samples(atlas, spacing)


@pytest.mark.parametrize(
    ("k", "spacing"), [(1, 0.07), (2, 0.05), (2, 0.29), (2, 1.5), pytest.param(3, 0.12, marks=pytest.mark.slow)]
)
def test_every_point_of_a_polytope_has_a_sample_near(k: int, spacing: float) -> None:
    atlas = ball_atlas(k)
    grid = lay_grid(atlas, spacing)
    rng = np.random.default_rng(k)
    bound = np.sqrt(k) / 2.0 * spacing
    farthest = 0.0
    for chart in range(atlas.n_charts):
        corners = atlas.polytope(chart)
        U = np.vstack([corners, rng.dirichlet(np.full(len(corners), 0.3), size=100) @ corners])
        farthest = max(farthest, cKDTree(grid.u[grid.charts == chart]).query(U)[0].max())
    assert farthest <= bound + INSIDE
    if spacing < atlas.radius / 2.0:
        assert farthest > 0.8 * bound  # the bound says something


@pytest.mark.parametrize("k", slow_but([1, 2, 3], 1, 2))
def test_every_point_of_the_manifold_has_a_sample_near(k: int) -> None:
    atlas, spacing = ball_atlas(k), 0.1
    grid = lay_grid(atlas, spacing)
    X = np.random.default_rng(0).normal(size=(2000, k + 1))
    X /= np.linalg.norm(X, axis=1, keepdims=True)
    # Between polytopes, flat as they are, the sphere leaves slits of the third order in their radius; and above a
    # tangent space at an angle asin(r) lengths are longer than in it.
    slit = atlas.radius**3 / 2.0
    bound = (np.sqrt(k) / 2.0 * spacing + slit) / np.sqrt(1.0 - atlas.radius**2)
    distances = cKDTree(grid.x).query(X)[0]
    assert distances.max() <= bound
    assert distances.max() > 0.5 * bound


@pytest.mark.parametrize("k", slow_but([1, 2, 3], 1, 2))
def test_charts_do_not_sample_the_same_region(k: int) -> None:
    atlas = ball_atlas(k)
    # Flat polytopes of a curved manifold overlap by the third order in their radius.
    assert overlap(atlas, lay_grid(atlas, 0.1, charts=range(min(100, atlas.n_charts)))) < atlas.radius**3 / 2.0


def test_a_finer_atlas_overlaps_less() -> None:
    coarse, fine = (ball_atlas(2, radius) for radius in (0.3, 0.1))
    some = range(100)
    assert overlap(fine, lay_grid(fine, 0.033, charts=some)) < overlap(coarse, lay_grid(coarse, 0.1, charts=some)) / 9.0


def test_samples_keep_the_bounds() -> None:
    system = PythonSphere(3, lower=[-2.0, -2.0, 0.25], upper=[2.0, 0.55, 2.0])
    atlas = ga.build_atlas(system, [0.0, 0.0, 1.0], radius=0.2, epsilon=0.2)
    grid = lay_grid(atlas, 0.05)
    assert 0.25 - INSIDE <= grid.x[:, 2].min() < 0.26
    assert 0.54 < grid.x[:, 1].max() <= 0.55 + INSIDE
    assert grid.outside > 0  # the polytopes' facets only touch the curved bounds
    assert grid.not_converged == 0
    whole = lay_grid(ga.build_atlas(PythonSphere(3), [0.0, 0.0, 1.0], radius=0.2, epsilon=0.2), 0.05)
    assert len(grid) < len(whole)


def test_samples_that_do_not_reach_the_manifold_are_counted() -> None:
    """Above a part of the plane z = 0 the residual is not a number."""

    def residual(x: Array) -> Array:
        return np.array([x[2] if np.hypot(x[0] - 0.05, x[1]) > 0.02 else np.nan])

    system = Written(3, 1, residual, lambda x: np.array([[0.0, 0.0, 1.0]]))
    atlas = ga.build_atlas(system, [0.0, 0.0, 0.0], radius=0.1, epsilon=0.2, max_charts=5)
    grid = lay_grid(atlas, 0.01)
    hole = np.hypot(grid.x[:, 0] - 0.05, grid.x[:, 1]) <= 0.02
    assert not hole.any()
    assert 8 <= grid.not_converged <= 25  # the hole's area is that of 12.6 cells


@given(seed=st.integers(0, 2**31), k=st.integers(1, 4))
def test_nearest_points_of_polytopes(seed: int, k: int) -> None:
    rng = np.random.default_rng(seed)
    normals = rng.normal(size=(rng.integers(1, 4 * k), k))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    normals = np.concatenate([normals, np.eye(k), -np.eye(k)])
    offsets = rng.uniform(0.0, 1.0, len(normals))
    U = rng.normal(size=(6, k)) * 2.0
    U = U[(U @ normals.T - offsets).max(axis=1) > 0.0]
    for u, nearest in zip(U, _nearest_points(U, normals, offsets) if len(U) else U, strict=True):
        assert (normals @ nearest - offsets).max() < INSIDE
        found = minimize(
            lambda w, u=u: ((w - u) ** 2).sum(),
            np.zeros(k),
            jac=lambda w, u=u: 2.0 * (w - u),
            constraints={"type": "ineq", "fun": lambda w: offsets - normals @ w, "jac": lambda w: -normals},
            method="SLSQP",
            options={"ftol": 1e-14, "maxiter": 300},
        )
        assert np.linalg.norm(nearest - u) <= np.linalg.norm(found.x - u) + 1e-6


def test_some_charts_only(sphere: ga.Atlas) -> None:
    grid, whole = lay_grid(sphere, 0.04, charts=[7, 3, 7]), lay_grid(sphere, 0.04)
    assert np.unique(grid.charts).tolist() == [3, 7]
    np.testing.assert_array_equal(grid.x, whole.x[np.isin(whole.charts, [3, 7])])
    assert len(lay_grid(sphere, 0.04, charts=[])) == 0


def test_best_sample_lies_between_the_best_chart_and_the_refined_best(can: ga.Problem) -> None:
    holds = [ga.ForceClosure(friction=0.5)]
    result = ga.optimize(
        can, radius=0.3, epsilon=0.5, quality="manipulability_volume", require=holds, refine=True, progress=False
    )
    samples = densify(result, 0.1, progress=False)
    assert samples.accepted.all() == (samples.rejected["force_closure:0.5:0"] == 0)
    assert result.best.quality < samples.best.quality <= 1.001 * result.refined_best.quality
    # Halving the way to the refined best is little to ask of a grid three times as fine.
    assert samples.best.quality - result.best.quality > 0.3 * (result.refined_best.quality - result.best.quality)
    assert samples.best.chart in samples.charts
    assert np.abs(result.atlas.system.evaluate_residual(samples.best.x)).max() < ON_MANIFOLD
    assert samples.best.x.tolist() in samples.x[samples.accepted].tolist()
    # The charts' centres are samples, with the values that the result has.
    centres = (samples.u == 0.0).all(axis=1)
    np.testing.assert_array_equal(samples.charts[centres], np.arange(result.atlas.n_charts))
    np.testing.assert_allclose(samples.qualities[centres], result.qualities, rtol=1e-9)
    np.testing.assert_array_equal(samples.accepted[centres], result.accepted)
    slack = min(result.atlas.system.slack(x).min() for x in samples.x)
    assert slack >= -INSIDE


def test_an_index_that_peaks_between_the_centres_is_found(small_result: ga.Result) -> None:
    atlas = small_result.atlas
    chart = int(np.argmax([np.linalg.norm(atlas.polytope(i), axis=1).min() for i in range(atlas.n_charts)]))
    peak = atlas.point(chart, atlas.polytope(chart)[0] / 2.0)
    width = 0.1 * atlas.radius

    @ga.batched
    def spike(grasps: ga.Grasps) -> Array:
        away = np.array([np.linalg.norm(atlas.system.difference(peak, x)) for x in grasps.x])
        return np.exp(-0.5 * (away / width) ** 2)

    result = small_result.by(spike)
    assert result.best.quality < 0.01
    samples = densify(result, width)
    assert samples.best.chart == chart
    assert samples.best.quality > np.exp(-0.5 * 0.5)  # a sample lies within width / sqrt(2)


def test_jumps_by_hand(small_result: ga.Result) -> None:
    atlas = small_result.atlas
    i, neighbours = 3, atlas.neighbours[3]
    values = np.zeros(atlas.n_charts)
    values[i] = 5.0
    expected = np.zeros(atlas.n_charts)
    expected[[i, *neighbours]] = 5.0
    result = replace(small_result, qualities=values)
    np.testing.assert_array_equal(jumps(result), expected)
    # Refused, the chart counts as the worst that is not, and nothing is left to jump to.
    feasible = np.ones(atlas.n_charts, bool)
    feasible[i] = False
    np.testing.assert_array_equal(jumps(replace(result, accepted=feasible)), 0.0)
    np.testing.assert_array_equal(jumps(replace(result, accepted=feasible, qualities=values - 5.0)), 0.0)
    # Where the index is level, the border of those that hold still jumps: from the worst that holds.
    level = np.full(atlas.n_charts, 2.0)
    far = int(np.setdiff1d(np.arange(atlas.n_charts), [i, *neighbours])[-1])
    level[far] = 0.5
    got = jumps(replace(result, accepted=feasible, qualities=level))
    np.testing.assert_array_equal(got[[i, *np.setdiff1d(neighbours, atlas.neighbours[far])]], 1.5)
    np.testing.assert_array_equal(jumps(replace(result, accepted=np.zeros_like(feasible))), 0.0)


def test_a_share_fills_the_charts_that_promise_most(small_result: ga.Result) -> None:
    """The charts that could hold a better grasp, then those where the index jumps most."""
    n = small_result.atlas.n_charts
    samples = densify(small_result, 0.07, share=0.1)
    filled = np.unique(samples.charts)
    assert len(filled) == int(np.ceil(0.1 * n))
    gap = small_result.gap
    assert 0 < gap.n_charts < len(filled)
    assert set(gap.charts) <= set(filled)
    others = np.setdiff1d(filled, [*gap.charts, *gap.unknown])
    left = np.setdiff1d(np.arange(n), filled)
    assert len(others) > 0
    assert jumps(small_result)[others].min() >= jumps(small_result)[left].max()
    np.testing.assert_array_equal(np.unique(densify(small_result, 0.07, share=0.5 / n).charts), gap.charts[:1])
    everywhere = densify(small_result, 0.07)
    np.testing.assert_array_equal(samples.x, everywhere.x[np.isin(everywhere.charts, filled)])
    np.testing.assert_allclose(samples.qualities, everywhere.qualities[np.isin(everywhere.charts, filled)])


def test_interrupted_work_is_kept(small_result: ga.Result, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("graspatlas.atlas.grid.BLOCK", 40)
    whole = densify(small_result, 0.05)
    calls = []

    @ga.batched
    def stopped(grasps: ga.Grasps) -> Array:
        calls.append(len(grasps))
        if len(calls) == 4:
            raise KeyboardInterrupt
        return grasps.semi_axes[:, 0]

    samples = densify(replace(small_result, quality=stopped), 0.05)
    assert not samples.complete
    assert whole.complete
    assert len(samples) == len(samples.qualities) == len(samples.accepted) == sum(calls[:3])
    assert (np.diff(samples.charts) >= 0).all()
    # What was filled are the charts that promise most; the last of them may lack samples.
    filled = [int(chart) for chart in by_promise(small_result) if chart in samples.charts]
    np.testing.assert_array_equal(filled, by_promise(small_result)[: len(filled)])
    rows, theirs = np.isin(samples.charts, filled[:-1]), np.isin(whole.charts, filled[:-1])
    np.testing.assert_array_equal(samples.x[rows], whole.x[theirs])
    longest = ga.Grasps(small_result.problem, whole.x[theirs]).semi_axes[:, 0]
    np.testing.assert_allclose(samples.qualities[rows], longest, rtol=1e-12)
    assert samples.best.quality == samples.qualities.max()


def test_misuse(small_result: ga.Result, sphere: ga.Atlas) -> None:
    for spacing in (0.0, -1.0, np.inf, np.nan, True, "fine"):
        with pytest.raises(ga.GraspAtlasError, match="spacing must be a positive number"):
            lay_grid(sphere, spacing)  # type: ignore[arg-type]
    for share in (0.0, 1.1, np.nan, "all"):
        with pytest.raises(ga.GraspAtlasError, match="share must be above 0 and at most 1"):
            densify(small_result, 0.1, share=share)  # type: ignore[arg-type]
    for charts in ([-1], [sphere.n_charts], [0.5]):
        with pytest.raises(ga.GraspAtlasError, match="charts must be whole numbers"):
            lay_grid(sphere, 0.1, charts=charts)  # type: ignore[arg-type]
    stored = replace(small_result, requirements=(Lost("mine"),))
    with pytest.raises(ga.GraspAtlasError, match="requirement 'mine' is a function"):
        densify(stored, 0.1)
    none = replace(small_result, requirements=(ga.ForceClosure(0.01),))
    with pytest.raises(ga.GraspAtlasError, match="samples meets the requirements"):
        _ = densify(none, 0.1, share=0.01).best


@pytest.mark.parametrize("spacing", [1e-4, 1e-9, 1e-300, 5e-324])
def test_a_grid_that_is_too_fine_is_refused_with_one_that_fits(sphere: ga.Atlas, spacing: float) -> None:
    with pytest.raises(ga.GraspAtlasError, match="over 1e\\+07: fill a smaller share") as caught:
        lay_grid(sphere, spacing)
    fits = float(str(caught.value).rsplit(" ", 1)[1])
    assert most_samples(sphere, fits) <= 1e7
    assert most_samples(sphere, 0.8 * fits) > 1e7


def test_command_line(small_result: ga.Result, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    small_result.save(tmp_path / "result.npz")
    assert main(["densify", str(tmp_path), "0.07", "--share", "0.3", "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    samples = densify(small_result, 0.07, share=0.3)
    assert data["n_samples"] == data["n_accepted"] == len(samples)
    assert data["best"]["quality"] == pytest.approx(samples.best.quality)
    assert data["best_chart"] == pytest.approx(small_result.best.quality)
    with np.load(tmp_path / "samples.npz", allow_pickle=False) as stored:
        assert set(stored.files) == {"x", "charts", "u", "qualities", "accepted"}
        np.testing.assert_array_equal(stored["x"], samples.x)
    assert main(["densify", str(tmp_path / "result.npz"), "0.1"]) == 0
    said = capsys.readouterr().out
    assert f"best centre of a chart {small_result.best.quality:.9g}" in said
    assert "best sample" in said
    assert main(["densify", str(tmp_path), "1e-9"]) == 2
    assert main(["densify", str(tmp_path), "0.1", "--share", "2"]) == 2
    assert capsys.readouterr().err.count("\n") == 2
    assert sorted(p.name for p in tmp_path.iterdir()) == ["result.npz", "samples.npz"]


def test_chosen_charts_are_filled_as_all_of_them_are(planar_result: ga.Result) -> None:
    spacing = 0.4 * planar_result.atlas.radius
    everywhere, some = densify(planar_result, spacing), densify(planar_result, spacing, charts=[9, 4])
    wanted = np.isin(everywhere.charts, [4, 9])
    assert np.array_equal(some.x, everywhere.x[wanted])
    assert np.array_equal(some.qualities, everywhere.qualities[wanted])
    with pytest.raises(ga.GraspAtlasError, match="only one of share and charts"):
        densify(planar_result, spacing, charts=[4], share=0.5)
    with pytest.raises(ga.GraspAtlasError, match="chart 100000 does not exist"):
        densify(planar_result, spacing, charts=[100_000])
