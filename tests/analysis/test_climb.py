"""Local maxima of an index, climbs to them, and the peaks that climbs end on."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

import graspatlas as ga
from graspatlas.analysis.climb import climb
from graspatlas.analysis.peaks import local_maxima, peaks_of
from graspatlas.viewer.figures.indices import with_index

Array = NDArray[np.float64]


@pytest.fixture(scope="module")
def planar(planar_result: ga.Result) -> ga.Result:
    return with_index(planar_result, "inverse_condition_number")


@pytest.mark.parametrize("name", ["planar", "can_result", "bottle_result"])
def test_local_maxima_are_the_charts_that_no_neighbour_beats(name: str, request: pytest.FixtureRequest) -> None:
    result: ga.Result = request.getfixturevalue(name)
    q = result.qualities
    brute = {i for i, near in enumerate(result.atlas.neighbours) if all(q[i] > q[j] for j in near)}
    found = local_maxima(result)
    assert set(found.tolist()) == brute
    assert found[0] == result.best.chart
    assert (np.diff(q[found]) <= 0.0).all()
    assert len(found) > 1


def test_equal_charts_count_once(planar: ga.Result) -> None:
    level = replace(planar, qualities=np.ones(planar.atlas.n_charts))
    assert local_maxima(level).tolist() == [0]
    island = np.zeros(planar.atlas.n_charts)
    island[[7, *planar.atlas.neighbours[7]]] = 1.0
    first = min(7, *planar.atlas.neighbours[7])
    assert local_maxima(replace(planar, qualities=island)).tolist() == [first]


def test_local_maxima_meet_the_requirements(planar: ga.Result) -> None:
    feasible = np.ones(planar.atlas.n_charts, bool)
    feasible[planar.best.chart] = False
    result = replace(planar, accepted=feasible)
    found = local_maxima(result)
    assert planar.best.chart not in found
    assert found[0] == result.best.chart
    assert local_maxima(replace(planar, accepted=np.zeros_like(feasible))).size == 0


@pytest.mark.parametrize("name", ["planar", "can_result", "bottle_result"])
def test_climbing_ends_higher_and_on_the_manifold(name: str, request: pytest.FixtureRequest) -> None:
    result: ga.Result = request.getfixturevalue(name)
    system = result.atlas.system
    for chart in np.random.default_rng(4).choice(result.atlas.n_charts, 8, replace=False):
        end = climb(result, int(chart), max_steps=40)
        assert end.chart == chart
        assert end.qualities[0] == result.qualities[chart]
        assert end.quality >= end.qualities[0]
        assert end.n_steps == len(end.qualities) - 1 <= 40
        assert np.abs(system.evaluate_residual(end.x)).max() < 1e-9
        assert system.slack(end.x).min(initial=0.0) >= -1e-9
        again = ga.quality.evaluate(result.quality, ga.Grasps(result.problem, end.x, system))  # type: ignore[arg-type]
        assert end.quality == pytest.approx(again[0], rel=1e-6)


def test_a_climb_ends_at_a_maximum(planar: ga.Result) -> None:
    end = climb(planar, 0)
    assert end.converged
    system = planar.atlas.system
    Phi = np.linalg.svd(system.evaluate_jacobian(end.x))[2][system.n_equations :]
    random = np.random.default_rng(1)
    around = []
    for u in 1e-3 * random.normal(size=(200, 2)):
        x = ga._core.project(system, end.x, Phi, u)  # type: ignore[attr-defined]
        if system.slack(x).min() >= 0.0:
            around.append(x)
    values = ga.quality.evaluate(planar.quality, ga.Grasps(planar.problem, around, system))  # type: ignore[arg-type]
    assert values.max() <= end.quality * (1.0 + 1e-6)


def test_climbs_with_an_index_of_ones_own(planar: ga.Result) -> None:
    def left(grasp: ga.Grasp) -> float:
        return float(-grasp.object_xyz[0])

    result = ga.optimize(planar.problem, quality=left)
    end = climb(result, 5)
    assert end.converged
    assert end.quality > result.qualities[5]
    assert end.quality < result.best.quality + 0.005


def test_peaks_gather_the_climbs(planar: ga.Result) -> None:
    climbs = [climb(planar, chart) for chart in range(0, 700, 45)]
    peaks = peaks_of(planar, climbs)
    assert sorted(np.concatenate([p.climbs for p in peaks])) == list(range(len(climbs)))
    assert [p.quality for p in peaks] == sorted((p.quality for p in peaks), reverse=True)
    assert 2 <= len(peaks) < len(climbs)
    assert peaks_of(planar, []) == []


def test_wrong_climbs_are_named(planar: ga.Result) -> None:
    with pytest.raises(ga.GraspAtlasError, match="chart 99999 does not exist"):
        climb(planar, 99999)
    with pytest.raises(ga.GraspAtlasError, match="max_steps must be"):
        climb(planar, 0, max_steps=0)
