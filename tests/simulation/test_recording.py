"""One trial as it went: against the trials themselves, and against mechanics."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from pinch import pinch

import graspatlas as ga
from graspatlas.simulation.protocols import PROTOCOLS
from graspatlas.simulation.runs import simulate_grasps


@pytest.fixture(scope="module")
def grasps() -> ga.Grasps:
    problem = ga.load_problem("allegro_sphere_3")
    return ga.Grasps(problem, problem.x1_array)


@pytest.fixture(scope="module")
def recording(grasps: ga.Grasps) -> ga.Recording:
    return ga.record(grasps[0])


def test_the_object_is_lost_where_the_trial_says(grasps: ga.Grasps, recording: ga.Recording) -> None:
    trial = simulate_grasps(grasps)
    assert recording.breaking_force == pytest.approx(trial.breaking_forces[0], abs=1e-12)
    assert_allclose(recording.direction, trial.breaking_directions[0])
    assert recording.lost.any()
    assert (np.diff(recording.lost.astype(int)) >= 0).all()


def test_a_push_of_the_protocol_moves_the_object_as_in_the_trial(grasps: ga.Grasps) -> None:
    trial = simulate_grasps(grasps)
    for axis in (0, 5):
        held = ga.record(grasps[0], direction=trial.pushes[axis], growing=False)
        T = held.T_palm_object
        pushed = np.array(held.phases) == "push"
        center = T[pushed] @ [*held.grasp.problem.object.center_of_mass, 1.0]
        before = held.grasp.T_palm_object @ [*held.grasp.problem.object.center_of_mass, 1.0]
        assert np.linalg.norm(center - before, axis=1).max() == pytest.approx(trial.shifts[0, axis], abs=1e-12)
        assert not held.lost.any()
        assert_allclose(np.linalg.norm(held.pushes[pushed], axis=1), 1.0)
        assert held.times[-1] == pytest.approx(0.8 + 2.0)


def test_forces_of_the_fingers_balance_the_push_while_nothing_moves(recording: ga.Recording) -> None:
    at = len(recording) - int(0.6 / recording.protocol.step) - 1
    assert not recording.lost[at]
    assert recording.phases[at] == "push"
    assert_allclose(recording.contact_forces[at].sum(axis=0), -recording.pushes[at], atol=0.05)
    assert np.linalg.norm(recording.pushes[at]) > 0.5
    points = recording.contact_points[at]
    assert_allclose(points, recording.grasp.contact_points, atol=3e-3)
    normals = recording.grasp.contact_normals
    assert (np.einsum("mi,mi->m", recording.contact_forces[at], normals) < 0.0).all()


def test_it_begins_open_and_squeezes_before_it_is_pushed(recording: ga.Recording) -> None:
    phases = list(recording.phases)
    assert sorted(phases, key=["closing", "squeeze", "push"].index) == phases
    assert_allclose(recording.T_palm_object[0], recording.grasp.T_palm_object, atol=1e-9)
    assert np.isnan(recording.contact_points[0]).all()
    assert (recording.contact_forces[0] == 0.0).all()
    steps = phases.index("push")
    assert recording.times[steps - 1] == pytest.approx(0.8)
    assert (recording.pushes[:steps] == 0.0).all()
    names = recording.grasp.joints
    assert recording.joint_positions.shape == (len(recording), len(names))
    grasp = [recording.grasp.joint_positions[name] for name in names]
    at_grasp = recording.joint_positions[phases.index("squeeze")]
    assert np.abs(at_grasp - grasp).max() < 0.05
    assert np.abs(recording.joint_positions[0] - grasp).max() > 0.05


def test_a_pinched_box_in_numbers() -> None:
    problem = pinch()
    recording = ga.record(
        ga.Grasps(problem, problem.x1_array)[0], protocol=PROTOCOLS["shake"], direction=(0, 2, 0), normal_force=4.0
    )
    end = list(recording.phases).index("push") - 1
    assert_allclose(recording.contact_forces[end, :, 0], [4.0, -4.0], rtol=0.03)
    assert recording.breaking_force == pytest.approx(2 * 0.5 * 4.0, abs=0.4)
    assert_allclose(recording.direction, [0.0, 1.0, 0.0])
    assert "lost at 4." in repr(recording)


def test_a_hand_in_the_plane_has_poses_in_the_plane() -> None:
    problem = ga.load_problem("planar_hand")
    recording = ga.record(ga.Grasps(problem, problem.x1_array)[0], growing=False, direction=(1, 0, 0))
    assert_allclose(recording.T_palm_object[0], recording.grasp.T_palm_object, atol=1e-9)
    assert (recording.T_palm_object[:, 2, 3] == recording.T_palm_object[0, 2, 3]).all()


def test_what_is_lost_while_closing_is_pushed_by_nothing(can_result: ga.Result) -> None:
    """The best grasp of the can by volume alone has fingers deep in the can."""
    recording = ga.record(can_result)
    assert recording.breaking_force == 0.0
    assert set(recording.phases) == {"closing", "squeeze"}
    assert recording.lost[-1]
    assert (recording.name, recording.index) == ("best", "manipulability_volume")


def test_joint_configurations_are_those_of_positions(can_result: ga.Result) -> None:
    hand, grasp = can_result.problem.hand, can_result.best
    assert_allclose(hand.configuration(grasp.joint_positions), grasp.q)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"direction": (0, 0, 0)}, "not all 0"),
        ({"direction": (1, 0)}, "three numbers"),
        ({"chart": 3}, "give the result"),
        ({"protocol": "shaking"}, "shake"),
        ({"distance": 0.0}, "distance"),
        ({"normal_force": -1.0}, "normal_force"),
    ],
)
def test_wrong_arguments_are_named(grasps: ga.Grasps, options: dict[str, object], words: str) -> None:
    with pytest.raises(ga.GraspAtlasError, match=words):
        ga.record(grasps[0], **options)  # type: ignore[arg-type]


def test_what_is_no_result_is_refused() -> None:
    with pytest.raises(ga.GraspAtlasError, match=r"graspatlas\.Result"):
        ga.record("schunk_can")  # type: ignore[arg-type]


def test_the_command_writes_a_page(tmp_path: Path, cli: Callable[..., tuple[int, str, str]]) -> None:
    result = ga.optimize(ga.load_problem("allegro_sphere_3"), max_charts=100)
    result.save(tmp_path / "result.npz")
    page = tmp_path / "page.html"
    words = ("--html", page, "--chart", "best", "--force", 8)
    status, out, err = cli("simulate", tmp_path / "result.npz", *words)
    assert status == 0
    assert f"wrote {page}" in err
    force = re.search(r"growing push of (\d+\.\d+) N", out)
    assert force
    assert f"lost at {force[1]} N" in page.read_text(encoding="utf-8")
    assert "squeeze with 8 N" in page.read_text(encoding="utf-8")


@pytest.mark.slow
def test_the_command_writes_a_picture(tmp_path: Path, cli: Callable[..., tuple[int, str, str]]) -> None:
    result = ga.optimize(ga.load_problem("gripper_skittle"), max_charts=100)
    result.save(tmp_path / "result.npz")
    assert cli("simulate", tmp_path / "result.npz", "--picture", tmp_path / "moments.png")[0] == 0
    assert (tmp_path / "moments.png").stat().st_size > 10000
