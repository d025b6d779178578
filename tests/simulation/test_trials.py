"""Trials against what mechanics says, and the same for any number of threads."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from pinch import pinch

import graspatlas as ga
from graspatlas.simulation.protocols import PROTOCOLS
from graspatlas.simulation.runs import simulate_grasps

SHAKE = PROTOCOLS["shake"]


@pytest.fixture(scope="module")
def pinched() -> ga.Grasps:
    problem = pinch()
    return ga.Grasps(problem, problem.x1_array)


@pytest.mark.parametrize(("friction", "force"), [(0.3, 5.0), (0.5, 3.0), (0.5, 8.0), (0.8, 5.0)])
def test_a_pinched_box_slides_at_twice_friction_times_force(pinched: ga.Grasps, friction: float, force: float) -> None:
    protocol = replace(SHAKE, friction=friction, torsional=0.01)
    trial = simulate_grasps(pinched, protocol=protocol, normal_force=force, breaking=True)
    # The push goes on growing while the box slides out, by some 0.3 N.
    assert_allclose(trial.breaking_forces, 2.0 * friction * force, rtol=0.06, atol=0.25)
    assert abs(trial.breaking_directions[0, 0]) < 1e-9


def test_a_push_that_friction_cannot_hold_is_survived_in_no_direction_across(pinched: ga.Grasps) -> None:
    weak = replace(SHAKE, friction=0.05, torsional=0.01, force=1.0)
    trial = simulate_grasps(pinched, protocol=weak, normal_force=5.0)
    along_x = np.abs(trial.pushes[:, 0]) > 0.5
    assert trial.survived[0][along_x].all()
    assert not trial.survived[0][~along_x].any()
    assert trial.trial(0)["lost_while"] == "pushed"


def test_what_no_push_takes_away_has_no_breaking_force(pinched: ga.Grasps) -> None:
    sticky = replace(SHAKE, friction=4.0, torsional=0.05, stiffness=50.0, largest_torque=30.0)
    trial = simulate_grasps(pinched, protocol=sticky, normal_force=40.0, breaking=True)
    assert trial.breaking_forces[0] == np.inf
    assert trial.trial(0)["breaking_force_n"] is None


def test_names_of_the_users_hand_are_free() -> None:
    """A hand may have joints that are called as parts of a scene are."""
    problem = pinch()
    text = problem.hand.urdf.replace("left_slide", "object").replace("right_slide", "push_x")
    joints = {"object": 0.07, "push_x": 0.07}
    named = replace(problem, hand=ga.Hand("named", text), x1=ga.FirstGrasp(joints))
    assert simulate_grasps(ga.Grasps(named, named.x1_array)).held.all()


def test_nothing_moves_while_a_pinch_closes(pinched: ga.Grasps) -> None:
    trial = simulate_grasps(pinched, normal_force=5.0)
    assert trial.held.all()
    assert trial.closing_shifts[0] < 1e-5
    assert trial.depths[0] < 1e-9
    assert np.abs(trial.contact_distances).max() < 1e-9
    assert trial.reached.all()


def test_a_grasp_on_one_side_is_lost_while_closing() -> None:
    """Only one finger presses, the other stays away: the box is pushed off by more than 5 cm."""
    problem = pinch()
    joints = {"left_slide": 0.07, "right_slide": -0.01}
    one = replace(problem, contacts=problem.contacts[:1], x1=ga.FirstGrasp(joints))
    trial = simulate_grasps(ga.Grasps(one, one.x1_array), normal_force=40.0)
    assert trial.lost_closing.all()
    assert trial.trial(0)["lost_while"] == "closing"
    assert not trial.closes.any()
    assert trial.breaking_forces[0] == 0.0


def test_the_same_numbers_for_any_number_of_threads_and_company(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = ga.load_problem("allegro_sphere_3")
    result = ga.optimize(problem, max_charts=400)
    X = result.atlas.centers[result.candidates()[:5]]
    together = simulate_grasps(ga.Grasps(problem, X))
    monkeypatch.setattr("graspatlas.simulation.trials.available_threads", lambda: 1)
    alone = simulate_grasps(ga.Grasps(problem, X[3:4]))
    assert (alone.shifts[0] == together.shifts[3]).all()
    assert (alone.turns[0] == together.turns[3]).all()


def test_pushes_in_a_row_begin_where_the_last_ended(pinched: ga.Grasps) -> None:
    weak = replace(SHAKE, friction=0.05, torsional=0.01, in_a_row=True)
    trial = simulate_grasps(pinched, protocol=weak, normal_force=5.0)
    survived = trial.survived[0].tolist()
    assert survived == sorted(survived, reverse=True)
    assert survived[0]
    assert not survived[-1]


def test_a_simulation_that_becomes_unstable_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Servos a thousand times too stiff for the step of time: MuJoCo's numbers grow without bound."""
    monkeypatch.chdir(tmp_path)  # where MuJoCo writes its log
    problem = ga.load_problem("allegro_sphere_3")
    stiff = replace(PROTOCOLS["dexgraspbench"], stiffness=1e6, largest_torque=1e7)
    trials = simulate_grasps(ga.Grasps(problem, problem.x1_array), protocol=stiff)
    assert trials.unstable.all()
    assert not trials.held.any()
    assert trials.trial(0)["shift_mm"] is None
    assert json.dumps(trials.summary(), allow_nan=False)
    sound = simulate_grasps(ga.Grasps(problem, problem.x1_array), protocol="multidex")
    assert not sound.unstable.any()


@pytest.mark.parametrize("name", ["gripper_skittle", "planar_hand", "three_finger_cup"])
def test_first_grasps_hold(name: str) -> None:
    problem = ga.load_problem(name)
    trial = simulate_grasps(ga.Grasps(problem, problem.x1_array))
    assert trial.held.all(), trial.trial(0)
    assert trial.survived.shape == (1, 4 if name == "planar_hand" else 6)
