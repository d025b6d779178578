"""Trials of a result's grasps: which are tried, what is stored, what wrong input says."""

from __future__ import annotations

import json
import signal
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from helpers import tripod_problem

import graspatlas as ga
from graspatlas.simulation import runs
from graspatlas.simulation.protocols import PROTOCOLS
from graspatlas.simulation.runs import simulate_grasps
from graspatlas.simulation.self_test import self_test

Cli = Callable[..., tuple[int, str, str]]


@pytest.fixture(scope="module")
def result() -> ga.Result:
    return ga.optimize(ga.load_problem("allegro_sphere_3"), max_charts=500)


@pytest.fixture(scope="module")
def trials(result: ga.Result) -> ga.Simulation:
    return ga.simulate(result, sample=4, seed=3)


def test_the_best_comes_first_and_a_sample_is_of_accepted_charts(result: ga.Result, trials: ga.Simulation) -> None:
    assert trials.charts[0] == result.best.chart
    assert len(trials) == 5
    assert result.accepted[trials.charts].all()
    assert (ga.simulate(result, sample=4, seed=3).charts == trials.charts).all()
    assert trials.complete
    assert np.isfinite(trials.breaking_forces[0])
    assert np.isnan(trials.breaking_forces[1:]).all()


def test_closed_grasps_hold_and_touch_where_they_say(trials: ga.Simulation) -> None:
    assert trials.held.all()
    assert np.abs(trials.contact_distances).max() < 5e-5
    assert trials.depths.max() < 5e-5


def test_the_best_is_tried_once(result: ga.Result) -> None:
    few = replace(result, accepted=np.isin(np.arange(result.atlas.n_charts), result.candidates()[:3]))
    assert sorted(ga.simulate(few, everything=True).charts.tolist()) == few.candidates().tolist()
    assert sorted(ga.simulate(few, sample=99).charts.tolist()) == few.candidates().tolist()
    with pytest.raises(ga.GraspAtlasError, match="no grasp to try"):
        simulate_grasps(ga.Grasps(result.problem, result.atlas.centers[:0]))


def test_chosen_charts_are_tried_in_their_order(result: ga.Result) -> None:
    charts = [int(c) for c in result.candidates()[[2, 0]]]
    assert ga.simulate(result, charts=charts).charts.tolist() == charts


def test_the_refined_best_is_tried_where_there_is_one() -> None:
    result = ga.optimize(ga.load_problem("gripper_skittle"), max_charts=300, refine=True)
    trial = ga.simulate(result)
    assert trial.refined.tolist() == [True]
    assert trial.trial(0)["refined"]


def test_stated_contacts_are_those_of_the_requirement(result: ga.Result) -> None:
    trials = ga.simulate(result, stated_contacts=True)
    assert (trials.friction, trials.torsional) == (0.5, 0.0)
    assert trials.breaking_forces[0] < ga.simulate(result).breaking_forces[0]
    soft = ga.simulate(replace(result, requirements=(ga.ForceClosure(0.7, 0.0, 0.004),)), stated_contacts=True)
    assert (soft.friction, soft.torsional) == (0.7, 0.004)
    with pytest.raises(ga.GraspAtlasError, match="no force_closure"):
        ga.simulate(replace(result, requirements=()), stated_contacts=True)


def test_trials_are_stored_and_read_again(trials: ga.Simulation, tmp_path: Path) -> None:
    trials.save(tmp_path / "trials.json")
    read = ga.load_simulation(tmp_path / "trials.json")
    for name, value in vars(trials).items():
        assert np.array_equal(
            getattr(read, name), value, equal_nan=isinstance(value, np.ndarray) and value.dtype == float
        )
    assert read.summary() == trials.summary()


@pytest.mark.parametrize("text", ["", "{}", "[1]", '{"format": "graspatlas simulation", "version": 9}', "\x00"])
def test_a_file_of_something_else_is_refused(text: str, tmp_path: Path) -> None:
    (tmp_path / "no.json").write_text(text)
    with pytest.raises(ga.GraspAtlasError, match="holds no simulation"):
        ga.load_simulation(tmp_path / "no.json")


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"protocol": "dexgrasp"}, "dexgraspbench"),
        ({"distance": 0.0}, "distance"),
        ({"normal_force": -1.0}, "normal_force"),
        ({"charts": [10**6]}, "chart"),
        ({"charts": []}, "charts names none"),
        ({"charts": [0], "sample": 3}, "only one of"),
        ({"sample": 0}, "sample"),
        ({"sample": 2, "seed": -1}, "seed must be a whole number of at least 0"),
    ],
)
def test_wrong_arguments_are_named(result: ga.Result, options: dict[str, object], words: str) -> None:
    with pytest.raises(ga.GraspAtlasError, match=words):
        ga.simulate(result, **options)  # type: ignore[arg-type]


def test_what_is_no_result_is_refused() -> None:
    with pytest.raises(ga.GraspAtlasError, match=r"graspatlas\.Result"):
        ga.simulate("schunk_can")  # type: ignore[arg-type]


def test_a_hand_without_shapes_is_refused() -> None:
    problem = tripod_problem()
    with pytest.raises(ga.GraspAtlasError, match="no collision shape"):
        simulate_grasps(ga.Grasps(problem, problem.x1_array))


def test_ctrl_c_keeps_what_was_tried(result: ga.Result, monkeypatch: pytest.MonkeyPatch) -> None:
    tried, rounds = runs._tried, []

    def pressed(*arguments: object) -> object:
        if rounds:
            signal.raise_signal(signal.SIGINT)
        rounds.append(0)
        return tried(*arguments)  # type: ignore[arg-type]

    monkeypatch.setattr(runs, "_tried", pressed)
    monkeypatch.setattr(runs, "TOGETHER", 2)
    trials = ga.simulate(result, sample=5)
    assert not trials.complete
    assert len(trials) == 2


def test_self_test() -> None:
    held, lost, passed = self_test()
    assert passed
    assert held.survived.all()
    assert not lost.survived.any()


def test_the_command_prints_and_stores(result: ga.Result, tmp_path: Path, cli: Cli) -> None:
    (tmp_path / "out").mkdir()
    result.save(tmp_path / "out" / "result.npz")
    status, out, _ = cli("simulate", tmp_path / "out", "--json", "--sample", 1)
    printed = json.loads(out)
    assert status == 0
    assert printed["protocol"] == "dexgraspbench"
    assert set(printed["best"]) >= {"survived", "of", "shift_mm", "turn_deg", "breaking_force_n"}
    assert printed["best"]["survived"] == printed["best"]["of"] == 6
    assert len(ga.load_simulation(tmp_path / "out" / "simulation-dexgraspbench.json")) == 2
    status, out, _ = cli("simulate", tmp_path / "out")
    assert status == 0
    assert "survived 6 of 6 pushes" in out


def test_the_command_refuses_what_it_cannot_do(result: ga.Result, tmp_path: Path, cli: Cli) -> None:
    status, _, err = cli("simulate")
    assert (status, "--self-test" in err) == (2, True)
    result.save(tmp_path / "result.npz")
    status, _, err = cli("simulate", tmp_path / "result.npz", "--protocol", "shaking")
    assert (status, "shake" in err) == (2, True)


def test_the_command_tries_nothing_where_no_grasp_will_do(result: ga.Result, tmp_path: Path, cli: Cli) -> None:
    none = replace(result, accepted=np.zeros(result.atlas.n_charts, bool))
    none.save(tmp_path / "none.npz")
    status, out, err = cli("simulate", tmp_path / "none.npz")
    assert (status, out) == (1, "")
    assert "no grasp meets the requirements" in err
    assert cli("simulate", tmp_path / "none.npz", "--chart", 0)[0] == 0


def test_the_command_without_mujoco(
    result: ga.Result, tmp_path: Path, cli: Cli, monkeypatch: pytest.MonkeyPatch
) -> None:
    result.save(tmp_path / "result.npz")
    monkeypatch.setitem(sys.modules, "mujoco", None)
    status, _, err = cli("simulate", tmp_path / "result.npz")
    assert status == 2
    assert len(err.strip().splitlines()) == 1
    assert "pip install 'graspatlas[mujoco]'" in err


def test_protocols_have_the_figures_of_their_sources() -> None:
    usual, hard, light = (PROTOCOLS[f"dexgraspbench{end}"] for end in ("", "-hard", "-30g"))
    assert (usual.mass, usual.friction, usual.torsional, usual.force, usual.stiffness) == (0.1, 0.6, 0.02, 1.0, 5.0)
    assert (hard.friction, hard.torsional, hard.force) == (0.3, 0.002, 0.3)
    assert (light.mass, light.force) == (0.03, 0.3)
    assert PROTOCOLS["multidex"].in_a_row
