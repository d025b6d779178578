"""An index without a maximum is called that, and no honest maximum is."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import graspatlas as ga
from graspatlas.analysis.unbounded import followed, is_sharp, levels_around, never_levels_off, rises_towards_one_point
from graspatlas.cli import main

Array = NDArray[np.float64]
Index = Callable[[ga.Grasps], Array]
RADIUS = 0.3


class Flat:
    """A point of R^k: the simplest manifold that can be climbed on."""

    def __init__(self, f: Callable[[Array], float], x: Array, value: float, reach: float) -> None:
        self.f, self.x, self.value, self.reach = f, x, value, reach
        self.Phi = np.eye(len(x))

    def gains(self, W: Array) -> Array:
        values = np.array([self.f(self.x + self.reach * w) for w in W])
        return (values - self.value) / abs(self.value)

    def better(self, W: Array) -> tuple[Array, float] | None:
        gains = self.gains(W)
        best = int(gains.argmax())
        return (self.x + self.reach * W[best], self.f(self.x + self.reach * W[best])) if gains[best] > 1e-7 else None


def grows_for_ever(f: Callable[[Array], float], k: int) -> bool:
    """What is found out about an index on R^k of which a climb ended near the origin."""

    def place_of(x: Array, value: float, reach: float) -> Flat:
        return Flat(f, x, value, reach)

    x = np.full(k, 1e-4)
    x, value = followed(place_of, x, f(x), RADIUS)
    return never_levels_off(levels_around(place_of, x, value, RADIUS))


POLES: dict[str, Callable[[Array], float]] = {
    "1/d": lambda x: 1.0 / np.linalg.norm(x),
    "1/d to a line": lambda x: 1.0 / np.linalg.norm(x[:-1]),
    "1/d^2": lambda x: 5.0 + 1e-3 / (x @ x),
    "1/sqrt d": lambda x: np.linalg.norm(x) ** -0.5,
    "-log d": lambda x: -float(np.log(np.linalg.norm(x))),
}
PEAKS: dict[str, Callable[[Array], float]] = {
    "smooth": lambda x: 3.0 - float(x @ x),
    "steep": lambda x: 3.0 - 1e6 * float(x @ x),
    "narrow": lambda x: 1.0 / (1.0 + 1e6 * float(x @ x)),
    "needle": lambda x: 1.0 / (1e-3 + np.linalg.norm(x)),
    "kink": lambda x: 3.0 - 100.0 * float(np.abs(x).sum()),
    "cusp": lambda x: 3.0 - float(np.sqrt(np.linalg.norm(x))),
    "step": lambda x: 2.0 if np.linalg.norm(x) < 1e-3 else 1.0,
    "constant": lambda x: 1.0,
    "negative": lambda x: -1.0 - float(x @ x),
}


@pytest.mark.parametrize("k", [2, 3, 5])
@pytest.mark.parametrize("name", POLES)
def test_poles_are_told_from_peaks(name: str, k: int) -> None:
    assert grows_for_ever(POLES[name], k)


@pytest.mark.parametrize("k", [2, 3, 5])
@pytest.mark.parametrize("name", PEAKS)
def test_peaks_are_told_from_poles(name: str, k: int) -> None:
    assert not grows_for_ever(PEAKS[name], k)


def test_few_grasps_around_tell_nothing() -> None:
    levels = np.full(5, np.nan)
    assert not is_sharp(levels)
    assert not never_levels_off(levels)
    assert not rises_towards_one_point(levels)


# On grasps


def inverse_distance(system: ga.System, x0: Array, soft: float = 0.0) -> Index:
    """1 / (distance to a grasp + soft)."""

    @ga.batched
    def index(grasps: ga.Grasps) -> Array:
        apart = [np.linalg.norm(system.difference(x0, x)) for x in grasps.x]
        return 1.0 / (np.array(apart) + soft)

    return index


def inverse_height(place: float) -> Index:
    """1 / distance to the curve of grasps that have the object at one height."""

    @ga.batched
    def index(grasps: ga.Grasps) -> Array:
        return 1.0 / np.abs(grasps.object_xyz[:, 1] - place)

    return index


@pytest.mark.parametrize("name", ["planar_hand", "allegro_sphere_3"])
def test_an_index_with_a_pole_is_unbounded(name: str) -> None:
    problem = ga.load_problem(name)
    atlas = ga.optimize(problem, radius=RADIUS, require=[]).atlas
    x0 = atlas.point(atlas.n_charts // 2, [0.11, 0.07])
    for index in (inverse_distance(atlas.system, x0), inverse_height(float(ga.Grasps(problem, x0).object_xyz[0, 1]))):
        result = ga.optimize(problem, radius=RADIUS, require=[], quality=index, refine=True)
        found = result.refinement
        assert found is not None
        assert found.unbounded[0]
        assert not found.converged[0]
        assert str(found.statuses[0]) == "unbounded"
        assert "requirements" in found.advice
    bounded = ga.optimize(
        problem, radius=RADIUS, require=[], quality=inverse_distance(atlas.system, x0, 0.02), refine=True
    )
    assert bounded.refinement is not None
    assert str(bounded.refinement.statuses[0]) == "maximum"
    assert bounded.refined_best.quality == pytest.approx(50.0, rel=1e-3)


@pytest.mark.parametrize("name", ["planar_hand", "schunk_oil_bottle", "allegro_sphere_3", "allegro_cylinder_4"])
@pytest.mark.parametrize("quality", ["manipulability_volume", "smallest_semi_axis", "inverse_condition_number"])
def test_honest_maxima_are_never_called_unbounded(name: str, quality: str) -> None:
    result = ga.optimize(ga.load_problem(name), radius=RADIUS, quality=quality, require=[])
    for chart in ga.local_maxima(result)[:5]:
        end = ga.climb(result, int(chart))
        assert not end.unbounded
        assert end.converged


# The can


@pytest.fixture(scope="module")
def bare_can() -> ga.Result:
    return ga.optimize(ga.load_problem("schunk_can"), radius=0.4, require=[], refine=True)


def test_the_cans_volume_has_no_maximum(bare_can: ga.Result, tmp_path: Path) -> None:
    found = bare_can.refinement
    assert found is not None
    assert found.unbounded[0]
    assert not found.converged[found.unbounded].any()
    assert found.converged[~found.unbounded].any(), "the can has maxima too"
    summary = bare_can.summary()["refined"]
    assert (summary["status"], summary["converged"], summary["gain"]) == ("unbounded", False, None)
    assert summary["n_unbounded"] == found.unbounded.sum()
    bare_can.save(tmp_path / "can.npz")
    again = ga.load_result(tmp_path / "can.npz").refinement
    assert again is not None
    assert again.statuses == found.statuses
    np.testing.assert_array_equal(again.steps, found.steps)


@pytest.mark.slow
def test_the_command_line_says_so(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["optimize", "schunk_can", "--radius", "0.4", "--require", "none", "--refine", "--output", str(tmp_path)]
    assert main(words) == 0
    said = capsys.readouterr().out
    assert "refined best 1" not in said
    assert "no refined best among the relevant grasps: the index grows without bound at" in said
    assert "state requirements that rule such grasps out, such as force_closure:0.5:0.02" in said
    summary = json.loads((tmp_path / "summary.json").read_text(encoding="utf-8"))
    assert summary["refined"]["status"] == "unbounded"


def test_a_climb_that_is_given_up_is_no_maximum(capsys: pytest.CaptureFixture[str]) -> None:
    problem = ga.load_problem("planar_hand")
    result = ga.optimize(problem, radius=0.25, refine="feasible", refine_steps=1)
    found = result.refinement
    assert found is not None
    assert str(found.statuses[0]) == "given up"
    summary = result.summary()["refined"]
    assert (summary["status"], summary["steps"], summary["converged"]) == ("given up", 1, False)
    assert "more steps, refine_steps (--refine-steps) 10" in summary["advice"]
    assert main(["optimize", "planar_hand", "--radius", "0.25", "--refine", "feasible", "--refine-steps", "1"]) == 0
    said = capsys.readouterr().out
    assert "not yet a maximum among all feasible grasps" in said
    assert "given up after 1 steps, still rising" in said
    more = ga.refine(result, all_motions=True)
    assert str(more.statuses[0]) == "maximum"
    assert more.advice == ""
    assert replace(result, refinement=more).refined_best.quality > result.refined_best.quality


def test_wrong_steps_are_refused() -> None:
    with pytest.raises(ga.GraspAtlasError, match="refine_steps must be a whole number"):
        ga.optimize(ga.load_problem("planar_hand"), refine=True, refine_steps=0)
