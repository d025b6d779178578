"""Predicted against simulated forces."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import graspatlas as ga


@pytest.fixture(scope="module")
def result(bottle: ga.Problem) -> ga.Result:
    return ga.optimize(bottle, radius=0.2, epsilon=0.5, dimension=2, require=[], max_charts=30)


def simulation(result: ga.Result, forces: list[float]) -> ga.Simulation:
    """Trials as if the simulation had lost the object at these forces."""
    n = len(forces)
    one = np.zeros((n, 1))
    return ga.Simulation(
        problem=result.problem.name,
        protocol="shake",
        friction=0.5,
        torsional=0.0,
        distance=0.01,
        normal_force=5.0,
        seed=0,
        contacts=tuple(contact.frame for contact in result.problem.contacts),
        pushes=np.eye(3)[:1],
        charts=np.arange(n),
        refined=np.zeros(n, bool),
        survived=one > 0,
        shifts=one,
        turns=one,
        closing_shifts=one[:, 0],
        lost_closing=np.array(forces) == 0.0,
        unstable=np.zeros(n, bool),
        contact_distances=one,
        depths=one[:, 0],
        pregrasp_distances=np.full(n, 0.01),
        reached=np.ones(n, bool),
        closes=np.arange(n) < 4,
        breaking_forces=np.array(forces),
        breaking_directions=np.zeros((n, 3)),
        seconds=1.0,
    )


def test_dots_and_agreement(result: ga.Result) -> None:
    trials = simulation(result, [1.0, 2.0, 3.0, 5.0, 4.0, 0.0, np.inf, np.nan])
    figure = ga.plot_holding(result, trials, [1.5, 2.5, 4.0, 3.0, 0.0, 0.0, 9.0, 9.0])
    axes = figure.axes[0]
    drawn = {str(line.get_label()): np.array(line.get_data()) for line in axes.lines}
    # Ranks 1 2 4 3 against 1 2 3 4; differences 0.5, 0.5, 1, 2.
    closed = "4 closed by friction: rank correlation 0.80, median difference 0.75 N"
    assert_allclose(drawn[closed], [[1.5, 2.5, 4.0, 3.0], [1.0, 2.0, 3.0, 5.0]])
    assert_allclose(drawn["1 not closed by friction"], [[0.0], [4.0]])
    assert_allclose(drawn["1 lost while closing"], [[0.0], [0.0]])
    assert "1 never lost, not drawn" in drawn
    assert_allclose(drawn["as predicted"][0], drawn["as predicted"][1])
    legend = axes.get_legend()
    assert legend is not None
    assert legend.get_title().get_text().startswith(f"{result.problem.name}, shake\n6 grasps: rank correlation 0.")
    assert (axes.get_xlabel()[-3:], axes.get_ylabel()[-3:]) == ("[N]", "[N]")


def test_predictions_are_for_the_conditions_of_the_trials() -> None:
    result = ga.optimize(ga.load_problem("gripper_skittle"), max_charts=60)
    trials = ga.simulate(result, charts=result.candidates()[:3].tolist(), breaking=True)
    grasps = ga.Grasps(result.problem, result.atlas.centers[trials.charts])
    budget = 5.0 * len(trials.contacts)
    predicted = ga.quality.holding_force(grasps, friction=0.6, normal_force=budget, torsional=0.02)
    assert predicted.min() > 0.0
    figure = ga.plot_holding(result, trials)
    line = next(line for line in figure.axes[0].lines if "closed" in str(line.get_label()))
    assert_allclose(np.sort(line.get_data()[0]), np.sort(predicted))
    assert_allclose(np.sort(line.get_data()[1]), np.sort(trials.breaking_forces))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"problem": "planar_hand"}, "of 'planar_hand', the result of"),
        ({"breaking_forces": np.array([1.0, np.nan, np.inf])}, "breaking=True"),
    ],
)
def test_other_trials_are_refused(result: ga.Result, change: dict[str, object], words: str) -> None:
    trials = replace(simulation(result, [1.0, 2.0, 3.0]), **change)  # type: ignore[arg-type]
    with pytest.raises(ga.GraspAtlasError, match=words):
        ga.plot_holding(result, trials)


def test_predictions_must_be_as_many(result: ga.Result) -> None:
    with pytest.raises(ga.GraspAtlasError, match="each of 3 grasps"):
        ga.plot_holding(result, simulation(result, [1.0, 2.0, 3.0]), [1.0])
