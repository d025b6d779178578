"""First grasps that are found: they meet the requirements, away from limits and rims, near the pose guess."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from helpers import without_x1

import graspatlas as ga
from graspatlas.cli import main
from graspatlas.commands.diagnosis import diagnose
from graspatlas.optimizer.first_grasp import ROOMS, with_good_first_grasp
from graspatlas.problem_files.first_grasp_in_file import with_x1

#: Bundled problems, and the share of all ranges that a first grasp keeps off their ends; the box leaves less room.
PROBLEMS = {
    "schunk_can": ROOMS[0],
    "schunk_oil_bottle": ROOMS[0],
    "allegro_box_4": 0.01,
    "allegro_cylinder_4": ROOMS[0],
    "three_finger_cup": ROOMS[0],
}


def bare(name: str) -> ga.Problem:
    """A bundled problem, with nothing said of a first grasp or a reference."""
    return replace(ga.load_problem(name), x1=None, reference=None)


def shares_to_the_ends(problem: ga.Problem) -> list[float]:
    """Distance of joints and patch parameters from the nearer end of their ranges, as a share of these."""
    positions = problem.hand.joint_positions(problem.x1_array[: problem.hand.model.hand_q_size])
    followers = {mimic.joint for mimic in problem.hand.mechanism.mimics}
    ranges = [(positions[name], *ends) for name, ends in problem.hand.limits_by_name.items() if name not in followers]
    values = problem.x1_array[len(problem.x1_array) - len(problem.parameter_names) :]
    free = [patch.interval(name) for contact in problem.contacts for patch, name in contact.free()]
    ranges += [(value, *ends) for value, ends in zip(values, free, strict=True) if ends]
    return [min(value - low, high - value) / (high - low) for value, low, high in ranges if np.isfinite(high - low)]


@pytest.mark.parametrize("name", PROBLEMS)
def test_it_meets_the_requirements_away_from_all_ends(name: str) -> None:
    problem = bare(name)
    assert problem.requirements
    k = problem.defaults["dimension"]
    found = with_good_first_grasp(problem, k, problem.requirements)
    grasp = ga.Grasps(found, found.x1_array[None])
    assert all(requirement.met(grasp)[0] for requirement in problem.requirements)
    assert min(shares_to_the_ends(found)) >= PROBLEMS[name] - 1e-6
    assert np.abs(found.full_system.evaluate_residual(found.x1_array)).max() < 1e-9
    assert np.abs(found.frozen_residual(found.x1_array, k)).max(initial=0.0) < 1e-9
    assert ga.build_atlas(found.system(k), found.start(k), radius=0.2, epsilon=0.5, max_charts=20).n_charts == 20
    again = with_good_first_grasp(problem, k, problem.requirements)
    np.testing.assert_array_equal(again.x1_array, found.x1_array)


def test_an_atlas_of_one_that_is_found_holds_grasps_that_will_do() -> None:
    result = ga.optimize(bare("schunk_can"))
    assert result.atlas.n_charts > 100
    assert result.accepted[0]
    assert result.problem.x1 is not None


def test_requirements_that_nothing_meets_leave_a_feasible_one() -> None:
    problem = replace(bare("three_finger_cup"), requirements=(ga.ForceClosure(0.5, 10.0),))
    found = with_good_first_grasp(problem, 2, problem.requirements, max_seconds=3.0)
    assert np.abs(found.full_system.evaluate_residual(found.x1_array)).max() < 1e-9
    marks = {finding.subject: finding for finding in diagnose(problem)}
    assert marks["requirements"].mark == "note"
    assert "misses force_closure:0.5:10" in marks["requirements"].text


def test_it_lies_anywhere_where_the_mean_posture_leaves_none(monkeypatch: pytest.MonkeyPatch) -> None:
    """Also where nothing meets the requirements."""
    monkeypatch.setattr("graspatlas.optimizer.first_grasp.BATCHES", 1)
    found = with_good_first_grasp(bare("planar_hand"), 2, (lambda grasp: False,))
    assert np.abs(found.full_system.evaluate_residual(found.x1_array)).max() < 1e-9
    assert ga.build_atlas(found.system(2), found.start(2), radius=0.1, epsilon=0.5, max_charts=20).n_charts == 20


def test_the_nearest_to_the_guess_is_taken() -> None:
    known = ga.load_problem("schunk_can")
    assert known.x1 is not None
    guess = ga.PoseGuess(known.x1.object_xyz, known.x1.object_quat_xyzw)
    problem = replace(without_x1("schunk_can"), pose_guess=guess)
    found = with_good_first_grasp(problem, 2, known.requirements).x1
    assert found is not None
    assert np.linalg.norm(np.subtract(found.object_xyz, guess.xyz)) < 0.02
    grasps = ga.Grasps(known, known.at(with_good_first_grasp(problem, 2, known.requirements).x1_array).x1_array[None])
    assert all(requirement.met(grasps)[0] for requirement in known.requirements)


def test_one_from_which_no_atlas_of_that_dimension_grows_is_passed_over(monkeypatch: pytest.MonkeyPatch) -> None:
    """Also where it was found among all feasible grasps: there it may be regular all the same."""
    asked: list[tuple[int, np.ndarray]] = []

    def can_grow(system: ga.System, x: np.ndarray) -> bool:
        asked.append((system.dimension, x))
        return len(asked) > 3

    monkeypatch.setattr("graspatlas.optimizer.first_grasp.can_grow", can_grow)
    problem = bare("planar_hand")
    found = with_good_first_grasp(problem, 2, problem.requirements)
    assert [dimension for dimension, _ in asked] == [2, 2, 2, 2]
    np.testing.assert_array_equal(found.x1_array, asked[3][1])
    slice_of_the_mean = replace(problem, reference=problem.reference_posture)
    assert np.abs(slice_of_the_mean.frozen_residual(found.x1_array, 2)).max() > 1e-3, "found among all"


def test_one_that_is_far_from_the_guess_is_pointed_out() -> None:
    problem = replace(without_x1("schunk_can"), pose_guess=ga.PoseGuess((0.0, 0.0, -0.3)))
    finding = next(each for each in diagnose(problem) if each.subject == "first grasp")
    assert finding.mark == "note"
    assert "no nearer one was found" in finding.hint


def test_the_coupling_that_leaves_none_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    """The fingers' planes stay parallel and the thumb's does not meet them: no three points of a ball are opposed."""
    monkeypatch.setattr("graspatlas.search.grasp_search.MAX_TRIES", 300)
    monkeypatch.setattr("graspatlas.optimizer.first_grasp.BATCHES", 1)
    problem = bare("allegro_sphere_3")
    with pytest.raises(ga.GraspAtlasError, match=r"without the coupling \{joint_0.0: 1\}.* there are some"):
        with_good_first_grasp(problem, 2, ())


@pytest.fixture
def stated(tmp_path: Path) -> Path:
    """The can's problem in a file, without its first grasp, with a comment."""
    table = without_x1("schunk_can").to_dict()
    path = tmp_path / "can.json"
    path.write_text(json.dumps(table))
    return path


def test_check_writes_it_into_the_file(stated: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", str(stated), "--write-x1"]) == 0
    assert "written into" in capsys.readouterr().out
    problem = ga.load_problem(stated)
    found = with_good_first_grasp(without_x1("schunk_can"), 2, problem.requirements)
    np.testing.assert_allclose(problem.x1_array, found.x1_array, atol=1e-9)
    assert main(["check", str(stated), "--write-x1"]) == 2
    assert "states an x1 already" in capsys.readouterr().err
    assert main(["check", "schunk_can", "--write-x1"]) == 2
    assert "bundled problem" in capsys.readouterr().err


@pytest.mark.parametrize("line", ["", "x1: null # none yet\n", "x1:\n"])
def test_comments_of_a_file_are_kept(line: str) -> None:
    x1 = ga.load_problem("schunk_can").x1
    assert x1 is not None
    text = f"# the can\nname: can # as it is\n{line}length_scale: 0.01 # metres\n"
    written = with_x1(text, x1)
    assert written.startswith("# the can\nname: can # as it is\nlength_scale: 0.01 # metres\n")
    assert written.count("x1:") == 1
    import yaml

    read = ga.FirstGrasp.from_dict(yaml.safe_load(written)["x1"])
    np.testing.assert_allclose(list(read.joints.values()), list(x1.joints.values()), atol=1e-11)
    np.testing.assert_allclose(read.object_xyz, x1.object_xyz, atol=1e-11)
    with pytest.raises(ga.GraspAtlasError, match="states an x1 already"):
        with_x1(written, x1)
