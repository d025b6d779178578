"""The Pareto front: against brute force and hand-made cases, as a figure and on the command line."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import ArrayLike, NDArray

import graspatlas as ga
from graspatlas.analysis.pareto import knee, values_of
from graspatlas.cli import main

Array = NDArray[np.float64]
VOLUME, CONDITION = "manipulability_volume", "inverse_condition_number"


def valued(result: ga.Result, values: ArrayLike, feasible: ArrayLike | None = None) -> tuple[ga.Result, list[str]]:
    """The result with made-up values [n, m] of m indices at its first n charts; the other charts are refused."""
    table = np.asarray(values, float)
    n, names = len(table), [f"index_{i}" for i in range(table.shape[1])]
    padded = np.full((result.atlas.n_charts, len(names)), 1e9)
    padded[:n] = table
    kept = np.zeros(result.atlas.n_charts, bool)
    kept[:n] = True if feasible is None else feasible
    others = dict(zip(names[1:], padded.T[1:], strict=True))
    return replace(result, quality=names[0], qualities=padded[:, 0], others=others, accepted=kept), names


def front_of(result: ga.Result, values: ArrayLike, feasible: ArrayLike | None = None) -> list[int]:
    made, names = valued(result, values, feasible)
    return ga.pareto_front(made, *names).tolist()


def brute_force(values: Array, feasible: NDArray[np.bool_]) -> list[int]:
    """Charts that no other dominates, the first of equals; straight from the definition."""
    front = []
    for i in np.flatnonzero(feasible):
        others = [j for j in np.flatnonzero(feasible) if j != i]
        dominated = any((values[j] >= values[i]).all() and (values[j] > values[i]).any() for j in others)
        repeated = any((values[j] == values[i]).all() for j in others if j < i)
        if not dominated and not repeated:
            front.append(int(i))
    return front


@st.composite
def tables(draw: st.DrawFn) -> tuple[Array, NDArray[np.bool_]]:
    """Values with many ties, and flags of which at least one is set."""
    n, m = draw(st.integers(1, 25)), draw(st.integers(2, 4))
    few = st.sampled_from([-2.0, -1.0, -0.0, 0.0, 1.0, 2.0, 1e300, np.inf])
    values = draw(st.lists(st.lists(few, min_size=m, max_size=m), min_size=n, max_size=n))
    flags = draw(st.lists(st.booleans(), min_size=n, max_size=n).filter(any))
    return np.array(values), np.array(flags)


@given(table=tables())
def test_front_is_that_of_brute_force(small_result: ga.Result, table: tuple[Array, NDArray[np.bool_]]) -> None:
    values, flags = table
    front = front_of(small_result, values, flags)
    assert sorted(front) == brute_force(values, flags)
    assert (np.diff(np.nan_to_num(values[front, 0], posinf=2e300)) <= 0.0).all()


@given(seed=st.integers(0, 2**31), m=st.integers(2, 4))
def test_front_is_that_of_brute_force_without_ties(small_result: ga.Result, seed: int, m: int) -> None:
    values = np.random.default_rng(seed).normal(size=(small_result.atlas.n_charts, m))
    assert sorted(front_of(small_result, values)) == brute_force(values, np.ones(len(values), bool))


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ([[1, 2]], [0]),
        ([[1, 2], [2, 1]], [1, 0]),
        ([[1, 2], [2, 3]], [1]),
        ([[1, 1], [1, 1], [1, 1]], [0]),
        ([[2, 1], [2, 3], [2, 2]], [1]),
        ([[0, 5], [3, 5], [1, 5]], [1]),
        ([[0, 4], [1, 3], [1, 3], [2, 2], [0, 0], [4, 0]], [5, 3, 1, 0]),
        ([[0, 0, 1], [0, 1, 0], [1, 0, 0], [0, 0, 0], [1, 0, 0]], [2, 1, 0]),
        ([[1, 1, 1], [0, 2, 1], [1, 1, 0]], [0, 1]),
    ],
)
def test_fronts_made_by_hand(small_result: ga.Result, values: list[list[float]], expected: list[int]) -> None:
    assert front_of(small_result, values) == expected


def test_a_refused_grasp_dominates_none(small_result: ga.Result) -> None:
    assert front_of(small_result, [[9, 9], [1, 2], [2, 1]], [False, True, True]) == [2, 1]


def test_the_front_of_a_quarter_circle_has_its_knee_in_the_middle(small_result: ga.Result) -> None:
    turn = np.linspace(0.0, np.pi / 2.0, 11)
    arc = np.column_stack([np.cos(turn), np.sin(turn)])
    inner = 0.9 * arc[1:-1]
    assert front_of(small_result, np.concatenate([inner, arc])) == list(range(9, 20))
    assert knee(arc) == 5
    assert knee([1e4, 1e-4] * arc) == 5


@pytest.mark.parametrize("front", [[[1, 2]], [[2, 1], [1, 2]], [[3, 0], [1, 1], [0, 3]], [[np.inf, 0], [1, 2]]])
def test_fronts_without_a_knee(front: list[list[float]]) -> None:
    assert knee(front) is None


def test_the_ends_of_the_front_are_the_best_by_each_index(can: ga.Problem) -> None:
    margin = "force_closure_margin"
    result = ga.optimize(can, radius=0.4, epsilon=0.5, quality=[VOLUME, margin], require=[ga.ForceClosure(0.5)])
    front = ga.pareto_front(result, VOLUME, margin)
    assert len(front) > 3
    assert front[0] == result.best.chart
    assert front[-1] == result.by(margin).best.chart
    assert result.accepted[front].all()
    assert ga.pareto_front(result, margin, VOLUME).tolist() == front[::-1].tolist()


def test_indices_may_be_callables(small_result: ga.Result) -> None:
    @ga.batched
    def height(grasps: ga.Grasps) -> Array:
        return grasps.T_palm_object[:, 2, 3]

    front = ga.pareto_front(small_result, VOLUME, height, CONDITION)
    values = np.column_stack([small_result.values(index) for index in (VOLUME, height, CONDITION)])
    assert sorted(front) == brute_force(values, small_result.accepted)


def test_misuse(small_result: ga.Result) -> None:
    with pytest.raises(ga.GraspAtlasError, match="two or more different indices"):
        ga.pareto_front(small_result, VOLUME)
    with pytest.raises(ga.GraspAtlasError, match="two or more different indices"):
        values_of(small_result, VOLUME, VOLUME)
    with pytest.raises(ga.GraspAtlasError, match="did you mean"):
        ga.pareto_front(small_result, VOLUME, "manipulability_volum")
    none = replace(small_result, accepted=np.zeros_like(small_result.accepted))
    with pytest.raises(ga.GraspAtlasError, match="no grasp meets"):
        ga.pareto_front(none, VOLUME, CONDITION)


def test_figure_shows_the_front(planar_result: ga.Result) -> None:
    half = replace(planar_result, accepted=planar_result.qualities < np.median(planar_result.qualities))
    figure = ga.plot_pareto(half, VOLUME, CONDITION)
    axes = figure.axes[0]
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("manipulability volume", "inverse condition number")
    values = values_of(half, VOLUME, CONDITION)
    front = values[ga.pareto_front(half, VOLUME, CONDITION)]
    drawn = {line.get_label(): line.get_xydata() for line in axes.lines}
    assert f"Pareto front, {len(front)} grasp{'s' if len(front) > 1 else ''}" in drawn
    np.testing.assert_array_equal(drawn["first grasp"], values[:1])
    np.testing.assert_array_equal(drawn["grasps"], values[half.accepted])
    np.testing.assert_array_equal(drawn["requirements not met"], values[~half.accepted])
    assert any(np.array_equal(points, front[::-1]) for points in drawn.values())
    ends = np.column_stack([axes.get_xlim(), axes.get_ylim()])
    assert (ends[0] < values[half.accepted].min(axis=0)).all()
    assert (ends[1] > values[half.accepted].max(axis=0)).all()
    assert len(figure.axes) == 4  # the front; both ends and the knee


@pytest.mark.slow
def test_figure_of_a_hand_in_space(small_result: ga.Result) -> None:
    figure = ga.plot_pareto(small_result, VOLUME, "smallest_semi_axis")
    assert len(figure.axes) > 1
    assert all(len(axes.images) == 1 for axes in figure.axes[1:])


def test_figure_of_a_front_of_one(planar_result: ga.Result) -> None:
    made, names = valued(planar_result, [[1.0, 1.0], [0.0, 0.5]])
    figure = ga.plot_pareto(made, *names)
    assert len(figure.axes) == 2
    assert "Pareto front, 1 grasp" in [line.get_label() for line in figure.axes[0].lines]


def test_command_line(planar_result: ga.Result, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    planar_result.save(tmp_path / "result.npz")
    front = ga.pareto_front(planar_result, VOLUME, CONDITION)
    values = values_of(planar_result, VOLUME, CONDITION)[front]
    assert main(["pareto", str(tmp_path), VOLUME, CONDITION, "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert data["indices"] == [VOLUME, CONDITION]
    assert [row["chart"] for row in data["front"]] == front.tolist()
    np.testing.assert_array_equal([row["values"] for row in data["front"]], values)
    assert data["knee"] == front[knee(values)]
    for name, start in (("front.png", b"\x89PNG"), ("front.svg", b"<?xml")):
        assert main(["pareto", str(tmp_path), VOLUME, CONDITION, "--picture", str(tmp_path / name)]) == 0
        assert (tmp_path / name).read_bytes().startswith(start)
    assert f"{len(front)} of {planar_result.atlas.n_charts} grasps" in capsys.readouterr().out
    assert main(["pareto", str(tmp_path), VOLUME, "volume"]) == 2
    assert main(["pareto", str(tmp_path), VOLUME, CONDITION, "--picture", "front.xyz"]) == 2
    assert capsys.readouterr().err.count("\n") == 2
