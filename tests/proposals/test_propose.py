"""What is proposed: grasps that meet the requirements, in files that state the same problems."""

from __future__ import annotations

import csv
import re
import shutil
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
import trimesh
from proposals.conftest import HAND, LINKS

import graspatlas as ga
from graspatlas.grasps.grasps import Grasps
from graspatlas.proposals.outcome import COLUMNS
from graspatlas.proposals.propose import _schedule
from graspatlas.proposals.trials.trial import LookEnd
from graspatlas.requirements.base import asked


def test_all_assignments_are_accounted_for(proposed: ga.Proposals) -> None:
    counts = proposed.counts
    assert counts.all == 27, "three links on three regions"
    assert counts.symmetric == 13, "the can may be turned upside down"
    assert len(proposed.tried) == counts.left
    assert proposed.status == ga.ProposalsEnd.COMPLETE
    scores = [each.score for each in proposed.tried]
    assert scores == sorted(scores)


def test_proposals_meet_the_requirements_and_the_best_comes_first(proposed: ga.Proposals) -> None:
    assert 1 <= len(proposed.proposals) <= 2
    values = [each.quality for each in proposed.proposals]
    assert values == sorted(values, reverse=True)
    for each in proposed.proposals:
        best = each.result.refined_best if each.result.refinement else each.result.best
        problem = each.result.problem
        assert np.abs(problem.full_system.evaluate_residual(best.x)).max() < 1e-9
        assert each.quality == best.quality
        assert each.quality >= each.tried.value - 1e-9, "the atlas does not lose what the look found"
        grasps = Grasps(problem, best.x[None], problem.full_system)
        assert asked(ga.ForceClosure(0.5, 0.02), grasps).all()
        assert asked(ga.CollisionFree(), grasps).all()


def test_the_problem_file_states_the_same_problem(proposed: ga.Proposals) -> None:
    for each in proposed.proposals:
        ours, theirs = each.result.problem, ga.load_problem(each.folder / "problem.yaml")
        assert theirs.contacts == ours.contacts
        assert theirs.requirements == ours.requirements
        assert theirs.x1 is not None
        assert ours.x1 is not None
        assert theirs.x1.joints == pytest.approx(ours.x1.joints, abs=1e-9)
        np.testing.assert_allclose(theirs.x1.object_xyz, ours.x1.object_xyz, atol=1e-9)
        assert theirs.motions is not None
        assert ours.motions is not None
        np.testing.assert_array_equal(theirs.motions.covariance, ours.motions.covariance)
        again = ga.optimize(theirs, dimension=2, progress=False, max_charts=60)
        assert again.best.quality == pytest.approx(each.result.best.quality, rel=0.5)
        assert again.accepted.any()


def test_the_results_are_those_that_are_stored(proposed: ga.Proposals) -> None:
    for each in proposed.proposals:
        np.testing.assert_array_equal(ga.load_result(each.folder / "result.npz").qualities, each.result.qualities)


def test_the_table_has_a_row_for_each_assignment(proposed: ga.Proposals, output: Path) -> None:
    with (output / "proposals.csv").open(encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    assert tuple(rows[0]) == COLUMNS
    assert [row["assignment"] for row in rows] == [each.name for each in proposed.tried]
    folders = {row["folder"]: float(row["value"]) for row in rows if row["folder"]}
    assert folders == {each.folder.name: pytest.approx(each.quality) for each in proposed.proposals}


def test_looks_are_not_done_twice_and_edits_stay(
    proposed: ga.Proposals, output: Path, can_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copytree(output, tmp_path / "again")
    edited = tmp_path / "again" / proposed.proposals[0].folder.name / "problem.yaml"
    edited.write_text(edited.read_text() + "# mine\n")

    def again(*_: object) -> None:
        raise AssertionError("it was looked at before")

    monkeypatch.setattr("graspatlas.proposals.trials.looks.look_at", again)
    found = ga.propose(HAND, can_file, tmp_path / "again", links=LINKS, top=1, max_seconds=None)
    assert [each.value for each in found.tried] == [each.value for each in proposed.tried]
    assert len(found.proposals) == 1
    assert edited.read_text().endswith("# mine\n")


def test_looks_by_functions_are_not_kept_since_two_may_have_one_name(can_file: Path, tmp_path: Path) -> None:
    def height(grasp: ga.Grasp) -> float:
        return 5.0 + float(grasp.object_xyz[2])

    found = ga.propose(HAND, can_file, tmp_path, links=LINKS, top=1, quality=height, max_seconds=None)
    assert found.proposals[0].tried.value > 4.0
    assert not list(tmp_path.glob("looks/*"))


def test_a_folder_of_other_arguments_is_refused(can_file: Path, output: Path, proposed: ga.Proposals) -> None:
    with pytest.raises(ga.GraspAtlasError, match="of another problem, of other options"):
        ga.propose(HAND, can_file, output, links=LINKS, top=1, seed=5)


def test_looks_of_an_obstacle_that_was_saved_anew_are_refused(can_file: Path, tmp_path: Path) -> None:
    stone = tmp_path / "stone.stl"
    trimesh.creation.box((0.1, 0.1, 0.1)).export(stone)
    obstacles = [ga.Obstacle.mesh("stone", stone, frame="object", pose=ga.Pose((1.0, 0.0, 0.0)))]
    words = {"links": LINKS, "top": 1, "max_seconds": 3.0, "obstacles": obstacles}
    assert ga.propose(HAND, can_file, tmp_path / "out", **words).tried
    trimesh.creation.box((0.1, 0.1, 0.2)).export(stone)
    with pytest.raises(ga.GraspAtlasError, match="of another problem, of other options"):
        ga.propose(HAND, can_file, tmp_path / "out", **words)


def test_time_ends_it_with_what_there_is(can_file: Path, tmp_path: Path) -> None:
    found = ga.propose(HAND, can_file, tmp_path, links=LINKS, top=1, max_seconds=0.01)
    assert found.status == ga.ProposalsEnd.TIME_LIMIT
    assert len(found.tried) < found.counts.left
    assert (tmp_path / "proposals.html").exists()


def test_a_hand_that_reaches_nothing_is_told_why(tmp_path: Path) -> None:
    trimesh.creation.box((0.9, 0.8, 0.9)).export(tmp_path / "crate.stl")
    with pytest.raises(ga.GraspAtlasError, match="check that its size fits the hand"):
        ga.propose(HAND, tmp_path / "crate.stl", tmp_path / "out", links=LINKS)


def test_requirements_that_nothing_meets_are_named(can_file: Path, tmp_path: Path) -> None:
    found = ga.propose(HAND, can_file, tmp_path, links=LINKS, require=[ga.HoldingForce(1e9)], top=1)
    assert not found.proposals
    assert found.refusals()
    assert all("holding_force" in reason or "no grasp was found" in reason for reason in found.refusals())
    assert all(each.end is not LookEnd.MET for each in found.tried)
    missed = [each for each in found.tried if each.end is LookEnd.MISSED]
    assert missed
    for each in missed:
        assert re.search(r"holding_force:1e\+09: withstands \S+ N, 1e\+09 N is required", each.lack)
    page = (tmp_path / "proposals.html").read_text(encoding="utf-8")
    assert page.count("nearest: holding_force") == len(missed)


def test_an_atlas_that_cannot_grow_is_said(
    output: Path, proposed: ga.Proposals, can_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails(*_: object) -> None:
        raise ga.GraspAtlasError("it is singular there")

    monkeypatch.setattr(import_module("graspatlas.proposals.trials.atlases"), "atlas_of", fails)
    shutil.copytree(output / "looks", tmp_path / "looks")
    found = ga.propose(HAND, can_file, tmp_path, links=LINKS, top=2, max_seconds=None)
    assert not found.proposals
    assert sum("it is singular there" in note for note in found.notes) == len(proposed.proposals)


@pytest.mark.parametrize(("seconds", "top"), [(90.0, 5), (20.0, 5), (3.0, 1), (600.0, 20)])
def test_there_is_time_for_each_part(seconds: float, top: int) -> None:
    looked, grown = _schedule(0.0, seconds, top)
    assert 0.5 * seconds <= looked < grown < seconds
    assert grown - looked > seconds - grown, "atlases take longer than pictures"


def test_without_a_limit_there_is_none() -> None:
    assert _schedule(0.0, float("inf"), 5) == (float("inf"), float("inf"))


@pytest.mark.slow
def test_workers_find_the_same(proposed: ga.Proposals, can_file: Path, tmp_path: Path) -> None:
    found = ga.propose(HAND, can_file, tmp_path, links=LINKS, top=2, max_seconds=None, workers=2)
    assert [each.value for each in found.tried] == [each.value for each in proposed.tried]
    assert [each.quality for each in found.proposals] == [each.quality for each in proposed.proposals]
