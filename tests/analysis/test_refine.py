"""Refinement: maxima between the charts' centres that do not depend on r and keep the requirements."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import graspatlas as ga
from graspatlas.analysis.climb import climbs_from
from graspatlas.analysis.objective import Objective
from graspatlas.cli import main
from graspatlas.collision.checker import CollisionChecker

HOLDS = (ga.ForceClosure(0.5, 0.02), ga.CollisionFree())
#: Largest difference of refined bests that started from atlases of two radii.
AGREEMENT = 1e-3


@pytest.fixture(scope="module")
def can() -> ga.Result:
    """The can with requirements, refined; two indices."""
    quality = ["manipulability_volume", "smallest_semi_axis"]
    return ga.optimize(ga.load_problem("schunk_can"), radius=0.25, quality=quality, require=HOLDS, refine=True)


@pytest.mark.parametrize(
    ("name", "require", "quality"),
    [
        ("planar_hand", (), "inverse_condition_number"),
        *(
            pytest.param(*case, marks=pytest.mark.slow)
            for case in (
                ("planar_hand", (ga.ForceClosure(0.5, 0.11),), "manipulability_volume"),
                ("schunk_can", HOLDS, "manipulability_volume"),
                ("schunk_oil_bottle", (ga.CollisionFree(),), "manipulability_volume"),
                ("schunk_oil_bottle", (ga.ForceClosure(1.0),), "smallest_semi_axis"),
            )
        ),
    ],
)
def test_the_refined_best_does_not_depend_on_the_radius(name: str, require: tuple, quality: str) -> None:
    problem = ga.load_problem(name)
    radius = problem.defaults["radius"]
    bests = [
        ga.optimize(problem, radius=r, require=require, quality=quality, refine=True) for r in (radius, radius / 2.0)
    ]
    for result in bests:
        assert result.refinement is not None
        assert result.refinement.converged[0]
        assert result.gain >= 0.0
        assert result.refined_best.quality >= result.best.quality
    first, second = (result.refined_best.quality for result in bests)
    assert first == pytest.approx(second, rel=AGREEMENT)


def test_the_refined_best_keeps_its_requirements(can: ga.Result) -> None:
    best = can.refined_best
    assert np.abs(can.atlas.system.evaluate_residual(best.x)).max() <= 1e-9
    assert can.problem.full_system.slack(best.x).min() >= -1e-9
    one = ga.Grasps(can.problem, best.x)
    assert ga.quality.force_closure_margin(one, 0.5)[0] >= 0.02
    assert CollisionChecker(can.problem).free(one.x).all()
    assert CollisionChecker(can.problem).clearances(one.x).min() > 0.0
    tips = best.contact_points
    assert min(np.linalg.norm(tips[i] - tips[j]) for i in range(3) for j in range(i)) > 0.01


def test_random_local_searches_do_not_beat_it(can: ga.Result) -> None:
    rng = np.random.default_rng(5)
    starts = rng.choice(np.flatnonzero(can.accepted), 15, replace=False)
    ends = [ga.climb(can, int(chart)).quality for chart in starts]
    assert max(ends) <= can.refined_best.quality * (1.0 + AGREEMENT)
    assert np.ptp(ends) > 0.01 * can.refined_best.quality, "all ended on one peak: the test says nothing"


def test_more_freedom_is_never_worse(planar_result: ga.Result) -> None:
    result = replace(planar_result, refinement=ga.refine(planar_result))
    free = ga.refine(result, all_motions=True)
    assert free.all_motions
    assert free.qualities[0] > result.refined_best.quality
    system = result.problem.full_system
    assert all(np.abs(system.evaluate_residual(x)).max() <= 1e-9 for x in free.x)
    both = replace(result, refinement=free)
    assert both.check().passed
    assert both.refined_best.quality == free.qualities[0]


@pytest.mark.slow
def test_the_best_force_closure_in_f_is_that_of_equal_forces() -> None:
    """No margin exceeds that of contact forces that are all normal and equal, which three fingers can reach."""
    friction = 0.5
    result = ga.optimize(ga.load_problem("planar_hand"), quality="force_closure_margin", refine="feasible")
    known = friction / np.sqrt(1.0 + friction**2) / 3.0
    assert result.best.quality < 0.98 * known
    assert result.refined_best.quality == pytest.approx(known, rel=1e-5)
    assert result.refined_best.quality <= known + 1e-9


def test_results_keep_their_refinement_and_other_indices(can: ga.Result, tmp_path: Path) -> None:
    can.save(tmp_path / "can.npz")
    again = ga.load_result(tmp_path / "can.npz")
    assert again.refined_best.quality == can.refined_best.quality
    np.testing.assert_array_equal(again.refined_best.x, can.refined_best.x)
    assert again.gain == can.gain
    assert list(again.others) == ["smallest_semi_axis"]
    np.testing.assert_array_equal(again.values("smallest_semi_axis"), can.values("smallest_semi_axis"))
    assert again.check().passed
    summary = again.summary()
    assert summary["refined"]["quality"] == can.refined_best.quality
    assert summary["others"]["smallest_semi_axis"]["largest"] == can.by("smallest_semi_axis").best.quality


def test_a_forged_refinement_is_found_out(can: ga.Result) -> None:
    refinement = can.refinement
    assert refinement is not None
    better = replace(refinement, qualities=refinement.qualities * 1.01)
    assert not replace(can, refinement=better).check().passed
    moved = replace(refinement, x=refinement.x + 1e-6)
    assert not replace(can, refinement=moved).check().passed


def test_another_index_chooses_another_best(can: ga.Result) -> None:
    other = can.by("smallest_semi_axis")
    assert other.quality == "smallest_semi_axis"
    assert other.refinement is None
    assert other.best.quality == can.values("smallest_semi_axis")[can.accepted].max()
    back = other.by("manipulability_volume")
    np.testing.assert_array_equal(back.qualities, can.qualities)

    def height(grasp: ga.Grasp) -> float:
        return float(grasp.object_xyz[2])

    np.testing.assert_allclose(can.values(height), can.atlas.centers[:, 15])


def test_wrong_input_is_refused(can: ga.Result, planar_result: ga.Result) -> None:
    problem = ga.load_problem("planar_hand")
    with pytest.raises(ga.GraspAtlasError, match="refine must be"):
        ga.optimize(problem, refine="everywhere")
    with pytest.raises(ga.GraspAtlasError, match="different"):
        ga.optimize(problem, quality=["smallest_semi_axis", "smallest_semi_axis"])
    with pytest.raises(ga.GraspAtlasError, match="one index or several"):
        ga.optimize(problem, quality=[])
    with pytest.raises(ga.GraspAtlasError, match="refine=True"):
        _ = planar_result.refined_best
    with pytest.raises(ga.GraspAtlasError, match="does not meet the requirements"):
        ga.climb(can, int(np.flatnonzero(~can.accepted)[0]))
    with pytest.raises(ga.GraspAtlasError, match="a climb starts from"):
        ga.climb(can, np.zeros(3))
    with pytest.raises(ga.GraspAtlasError, match="misses its equations"):
        ga.climb(can, can.best.x + 1e-3)
    nothing = ga.optimize(problem, require=[lambda grasp: False], refine=True)
    assert nothing.refinement is None
    with pytest.raises(ga.GraspAtlasError, match="no grasp meets the requirements"):
        ga.refine(nothing)


@pytest.mark.parametrize(
    "call",
    [
        lambda given: ga.climb(given, 0),
        lambda given: ga.local_maxima(given),
        lambda given: ga.refine(given),
        lambda given: ga.densify(given, 0.1),
        lambda given: ga.pareto_front(given, "smallest_semi_axis", "manipulability_volume"),
    ],
    ids=["climb", "local_maxima", "refine", "densify", "pareto_front"],
)
def test_what_is_not_a_result_is_named(call: Callable[[Any], Any]) -> None:
    with pytest.raises(
        ga.GraspAtlasError, match=r"result must be a graspatlas\.Result, got .*see graspatlas\.optimize"
    ):
        call(ga.load_problem("planar_hand"))


def test_functions_that_files_do_not_keep_cannot_be_refined(tmp_path: Path) -> None:
    def low(grasp: ga.Grasp) -> bool:
        return bool(grasp.object_xyz[1] < 0.0)

    result = ga.optimize(ga.load_problem("planar_hand"), require=[low], refine=True)
    assert result.refined_best.object_xyz[1] < 0.0
    result.save(tmp_path / "low.npz")
    with pytest.raises(ga.GraspAtlasError, match="'low' is a function"):
        ga.refine(ga.load_result(tmp_path / "low.npz"))


def test_an_interrupted_refinement_keeps_what_it_has(planar_result: ga.Result, monkeypatch: pytest.MonkeyPatch) -> None:
    result = planar_result
    calls = 0

    def impatient(*arguments: object) -> list[ga.Climb]:
        nonlocal calls
        calls += 1
        if calls > 1:
            raise KeyboardInterrupt
        return climbs_from(*arguments)  # type: ignore[arg-type]

    monkeypatch.setattr("graspatlas.analysis.refine.BATCH", 1)
    monkeypatch.setattr("graspatlas.analysis.refine.climbs_from", impatient)
    first = ga.refine(result)
    assert not first.complete
    assert first.n_peaks == 1
    none = ga.refine(result)
    assert none.qualities[0] == result.best.quality
    assert not none.converged[0]


def test_an_interrupted_climb_in_f_keeps_those_in_r(monkeypatch: pytest.MonkeyPatch) -> None:
    result = ga.optimize(ga.load_problem("planar_hand"), radius=0.25)
    inside = ga.refine(result)

    def impatient(objective: Objective, *arguments: object) -> list[ga.Climb]:
        if objective.system.dimension > result.dimension:
            raise KeyboardInterrupt
        return climbs_from(objective, *arguments)  # type: ignore[arg-type]

    monkeypatch.setattr("graspatlas.analysis.refine.climbs_from", impatient)
    kept = ga.refine(result, all_motions=True)
    assert not kept.complete
    np.testing.assert_array_equal(kept.qualities, inside.qualities)


@pytest.mark.slow
def test_the_command_line_refines(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["optimize", "planar_hand", "--refine", "--quality", "inverse_condition_number"]
    words += ["--quality", "smallest_semi_axis", "--output", str(tmp_path)]
    assert main(words) == 0
    said = capsys.readouterr().out
    assert "refined best 0.0373" in said
    assert "smallest_semi_axis:" in said
    assert main(["check-result", str(tmp_path)]) == 0
    assert "refined grasps that fail a requirement" in capsys.readouterr().out
    assert main([*words, "--json"]) == 0
    summary = json.loads(capsys.readouterr().out)
    assert summary["refined"]["gain"] > 0.0
    assert main(["optimize", "planar_hand", "--refine", "feasible"]) == 0
    assert "among all feasible grasps" in capsys.readouterr().out


@pytest.mark.slow
def test_couplings_hold_among_all_feasible_grasps() -> None:
    """A coupling is what the hand is built like: climbing in F lets go of the other frozen motions only."""
    bundled = ga.load_problem("allegro_cylinder_3")
    couplings, h = bundled.motions.couplings[:3], len(bundled.hand.joints)
    motions = replace(bundled.motions, covariance=np.diag(np.linspace(1.0, 0.1, h)), couplings=couplings)
    problem = replace(bundled, motions=motions)
    assert problem.largest_dimension == problem.full_dimension - 3
    result = ga.optimize(problem, dimension=2, radius=0.4, refine="feasible")
    best = result.refined_best
    assert best.quality > ga.optimize(problem, dimension=2, radius=0.4, refine=True).refined_best.quality
    kept = motions.reordered(problem.hand.joints).couplings
    for x in (best.x, *ga.find_grasps(problem, count=3)):
        np.testing.assert_allclose(kept @ (x[:h] - problem.reference_array), 0.0, atol=1e-7)
    assert result.check().passed
