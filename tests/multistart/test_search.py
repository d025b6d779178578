"""The best of all feasible grasps: found again from any seed, kept, gone on with, and honest about what it is not."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh

import graspatlas as ga
from graspatlas.cli import main
from graspatlas.multistart.checkpoint import RoundFolder
from graspatlas.multistart.rounds import Plan, Round, RoundKind, run_round
from graspatlas.multistart.search import Search, one_by_one
from graspatlas.result.refinement import SearchEnd

#: The best inverse condition number of the planar hand over all its feasible grasps.
BEST = 0.0941901


@pytest.fixture(scope="module")
def problem() -> ga.Problem:
    return ga.load_problem("planar_hand")


@pytest.fixture(scope="module")
def found(problem: ga.Problem) -> ga.Result:
    return ga.optimize(problem, motions="all")


def plan_of(problem: ga.Problem, **changes: object) -> Plan:
    plan = Plan(problem, "inverse_condition_number", (), 2, 0.125, 0.4)
    return replace(plan, **changes)  # type: ignore[arg-type]


def test_the_best_is_found_and_said_to_be(found: ga.Result) -> None:
    refinement = found.refinement
    assert refinement is not None
    assert refinement.all_motions
    assert refinement.complete
    assert found.refined_best.quality == pytest.approx(BEST, rel=1e-6)
    assert refinement.kkt[refinement.converged].max() <= 1e-6
    assert (np.diff(refinement.qualities) <= 0.0).all()
    search = refinement.search
    assert search is not None
    assert search.status is SearchEnd.ENOUGH
    assert search.share_missing <= 0.01
    assert search.best_hits >= 3
    assert refinement.hits.sum() == search.met <= search.climbs
    assert found.check().passed


def test_a_slice_does_not_hold_it(found: ga.Result) -> None:
    assert found.refined_best.quality > 2.0 * found.best.quality
    assert found.gain > 1.0


def test_another_seed_finds_the_same(problem: ga.Problem, found: ga.Result) -> None:
    again = ga.optimize(problem, motions="all", seed=7)
    assert again.refined_best.quality == pytest.approx(found.refined_best.quality, rel=1e-6)


def test_one_seed_gives_the_same_to_the_bit(problem: ga.Problem, found: ga.Result) -> None:
    again = ga.optimize(problem, motions="all").refinement
    assert again is not None
    assert found.refinement is not None
    np.testing.assert_array_equal(again.x, found.refinement.x)
    np.testing.assert_array_equal(again.hits, found.refinement.hits)


def test_a_round_depends_on_its_number_alone(problem: ga.Problem) -> None:
    plan = plan_of(problem)
    second, third = run_round(plan, 2), run_round(plan, 3)
    again = run_round(plan, 3)
    np.testing.assert_array_equal(again.x, third.x)
    assert third.kind is RoundKind.RANDOM or third.kind is RoundKind.SLICE
    assert not np.array_equal(second.x, third.x)
    assert not np.array_equal(run_round(replace(plan, seed=1), 3).x, third.x)


def test_rounds_of_slices_take_turns(problem: ga.Problem) -> None:
    kinds = [run_round(plan_of(problem), number).kind for number in range(1, 7)]
    assert RoundKind.SLICE in kinds
    assert RoundKind.RANDOM in kinds


def test_no_end_is_counted_that_fails_a_requirement(problem: ga.Problem) -> None:
    closure = ga.ForceClosure(0.5, 0.1)
    plan = plan_of(problem, requirements=(closure,))
    ended = run_round(plan, 1)
    assert ended.met.any()
    grasps = ga.Grasps(problem, ended.x[ended.met], problem.full_system)
    assert closure.met(grasps).all()
    assert (ended.missed[~ended.met] > 0.0).all()
    assert (ended.value[~ended.met] == -np.inf).all()


def test_results_keep_what_the_search_said(found: ga.Result, tmp_path: Path) -> None:
    found.save(tmp_path / "all.npz")
    again = ga.load_result(tmp_path / "all.npz")
    assert again.refinement is not None
    assert found.refinement is not None
    assert again.refinement.search == found.refinement.search
    np.testing.assert_array_equal(again.refinement.kkt, found.refinement.kkt)
    refined = again.summary()["refined"]
    assert refined["starts"] == found.refinement.search.climbs  # type: ignore[union-attr]
    assert refined["share_missing"] <= 0.01  # type: ignore[operator]
    assert refined["kkt"] <= 1e-6  # type: ignore[operator]
    assert refined["peaks"][0]["quality"] == found.refined_best.quality
    json.dumps(refined)


def interrupted_after(rounds: int) -> object:
    def source(plan: Plan, first: int, deadline: float) -> Iterator[Round]:
        for count, one in enumerate(one_by_one(plan, first, deadline)):
            if count == rounds:
                raise KeyboardInterrupt
            yield one

    return source


def test_an_interrupted_search_keeps_what_it_has_and_goes_on(problem: ga.Problem, tmp_path: Path) -> None:
    plan = plan_of(problem)
    starts = problem.x1_array[None]
    whole = Search(plan, 0.01, None, False).run(starts, None)
    cut = Search(plan, 0.01, tmp_path / "rounds", False).run(starts, None, interrupted_after(2))  # type: ignore[arg-type]
    assert cut is not None
    assert whole is not None
    assert not cut.complete
    assert cut.search is not None
    assert cut.search.status is SearchEnd.INTERRUPTED
    assert cut.search.rounds == 3
    calls: list[int] = []

    def counting(plan: Plan, first: int, deadline: float) -> Iterator[Round]:
        for one in one_by_one(plan, first, deadline):
            calls.append(one.number)
            yield one

    went_on = Search(plan, 0.01, tmp_path / "rounds", False).run(starts, None, counting)
    assert went_on is not None
    assert calls[0] == 3
    np.testing.assert_array_equal(went_on.x, whole.x)
    np.testing.assert_array_equal(went_on.hits, whole.hits)
    with pytest.raises(ga.GraspAtlasError, match="another problem"):
        Search(plan_of(problem, seed=5), 0.01, tmp_path / "rounds", False).run(starts, None)
    (tmp_path / "rounds" / "round000001.npz").write_bytes(b"nothing")
    with pytest.raises(ga.GraspAtlasError, match="damaged"):
        Search(plan, 0.01, tmp_path / "rounds", False).run(starts, None)
    RoundFolder.remove(tmp_path / "rounds")
    assert not (tmp_path / "rounds").exists()


def test_rounds_of_a_mesh_that_was_saved_anew_are_of_another_search(problem: ga.Problem, tmp_path: Path) -> None:
    stone = tmp_path / "stone.stl"
    trimesh.creation.box((0.02, 0.02, 0.02)).export(stone)
    plan = plan_of(replace(problem, obstacles=(ga.Obstacle.mesh("stone", stone),)))
    before = RoundFolder(tmp_path, plan).digest
    assert RoundFolder(tmp_path, plan).digest == before
    trimesh.creation.box((0.02, 0.02, 0.03)).export(stone)
    assert RoundFolder(tmp_path, plan).digest != before


def test_the_limit_of_time_cuts_it_short(problem: ga.Problem) -> None:
    result = ga.optimize(problem, motions="all", share_missing=1e-9, max_seconds=1.5)
    assert result.refinement is not None
    assert result.refinement.search is not None
    assert result.refinement.search.status is SearchEnd.TIME_LIMIT
    assert not result.refinement.complete


def test_an_index_without_a_maximum_is_called_so(problem: ga.Problem) -> None:
    @ga.batched
    def pole(grasps: ga.Grasps) -> np.ndarray:
        return 1.0 / np.abs(grasps.object_xyz[:, 1] - 0.011)

    result = ga.optimize(problem, motions="all", quality=pole)
    assert result.refinement is not None
    assert result.refinement.unbounded[0]
    assert result.refinement.search is not None
    assert result.refinement.search.status is SearchEnd.UNBOUNDED


def test_requirements_that_nothing_meets_are_named(problem: ga.Problem, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("graspatlas.multistart.search.EMPTY_ROUNDS", 2)
    with pytest.raises(
        ga.GraspAtlasError, match=r"the nearest misses force_closure:0\.5:0\.3: margin 0\.\d+, 0\.3 is"
    ) as caught:
        ga.optimize(problem, motions="all", require=[ga.ForceClosure(0.5, 0.3)])
    assert isinstance(caught.value.result, ga.Result)  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"dimension": 2}, "there is no dimension to choose"),
        ({"refine": True}, "leave refine out"),
        ({"share_missing": 0.0}, "share_missing must lie between 0 and 1"),
        ({"share_missing": float("nan")}, "share_missing"),
        ({"seed": -1}, "seed"),
    ],
)
def test_what_does_not_go_together_is_said(problem: ga.Problem, options: dict[str, object], said: str) -> None:
    with pytest.raises(ga.GraspAtlasError, match=said):
        ga.optimize(problem, motions="all", **options)  # type: ignore[arg-type]


def test_motions_are_relevant_or_all(problem: ga.Problem) -> None:
    with pytest.raises(ga.GraspAtlasError, match="'relevant' or 'all'"):
        ga.optimize(problem, motions="some")


def test_the_command_line_searches(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["optimize", "planar_hand", "--motions", "all", "--output", str(tmp_path)]) == 0
    said = capsys.readouterr().out
    assert "among all feasible grasps" in said
    assert "maxima not found yet get" in said
    assert not (tmp_path / "checkpoint").exists()
    assert main(["optimize", "planar_hand", "--motions", "all", "--components"]) != 0
    assert "leave --components out" in capsys.readouterr().err


@pytest.mark.slow
def test_the_slice_has_no_grasp_that_holds_and_f_has() -> None:
    """None of the bottle's relevant grasps closes at friction 0.5."""
    holds = [ga.ForceClosure(0.5, 0.02), ga.CollisionFree(5e-5)]
    bests = []
    for seed in range(2):
        result = ga.optimize(ga.load_problem("schunk_oil_bottle"), motions="all", require=holds, seed=seed)
        assert not result.accepted.any()
        assert result.refinement is not None
        assert result.refinement.complete
        assert result.refinement.converged[0]
        assert result.check().passed
        bests.append(result.refined_best.quality)
    assert bests[0] == pytest.approx(bests[1], rel=1e-3)
    assert bests[0] > 56_600.0


@pytest.mark.slow
def test_the_can_is_better_than_its_slice_by_far() -> None:
    holds = [ga.ForceClosure(0.5, 0.02), ga.CollisionFree(5e-5)]
    bests = [
        ga.optimize(ga.load_problem("schunk_can"), motions="all", require=holds, seed=seed).refined_best.quality
        for seed in range(3)
    ]
    assert min(bests) > 734_800.0
    assert np.ptp(bests) < 1e-4 * max(bests)


def test_a_result_without_accepted_charts_is_drawn(problem: ga.Problem, tmp_path: Path) -> None:
    """F may hold grasps that meet a requirement which no chart of the slice meets."""
    closure = ga.ForceClosure(0.5, 0.145)
    result = ga.optimize(problem, motions="all", require=[closure])
    assert not result.accepted.any()
    assert result.gain == float("inf")
    assert result.check().passed
    assert result.summary()["refined"]["gain"] is None
    ga.save_picture(result, tmp_path / "best.png", width=320, height=180)
    ga.export_html(result, tmp_path / "best.html")
    assert (tmp_path / "best.png").stat().st_size > 5_000


def test_what_only_the_refined_best_meets_is_exported_and_tried(problem: ga.Problem, tmp_path: Path) -> None:
    result = ga.optimize(problem, motions="all", require=[ga.ForceClosure(0.5, 0.145)])
    assert not result.accepted.any()
    assert result.save_grasps(tmp_path / "best.json", best=3, refined=True) == 1
    assert result.save_grasps(tmp_path / "accepted.json", accepted=True, refined=True) == 1
    assert "refined" in repr(result)
