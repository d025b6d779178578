"""Indices and the holding force as the compiled core follows them: their values, slopes, and the climbs on them."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partial

import numpy as np
import pytest
from numpy.typing import NDArray

import graspatlas as ga
from graspatlas import _core, quality
from graspatlas.collision.checker import CollisionChecker, collision_checker
from graspatlas.quality.evaluation import evaluate
from graspatlas.quality.holding_force import GAP
from graspatlas.quality.measures import index_measure
from graspatlas.requirements import HoldingForce

Array = NDArray[np.float64]
#: What slacks of requirements keep beyond zero; see cpp/graspatlas/climb/requirement_measures.hpp.
INSIDE = 1e-8
STEP = 1e-5
#: Problems and indices that have a value there.
EXACT = [
    ("three_finger_cup", "ferrari_canny_epsilon"),
    ("allegro_box_3", "ferrari_canny_epsilon"),
    ("planar_hand", "ferrari_canny_epsilon"),
    ("gripper_skittle", "soft_finger_epsilon"),
    ("planar_hand", "soft_finger_epsilon"),
    ("allegro_box_4", "joint_centrality"),
    ("schunk_can", "joint_centrality"),
    ("schunk_can", "manipulability_volume"),
    ("allegro_sphere_3", "inverse_condition_number"),
    ("planar_hand", "smallest_semi_axis"),
]
HELD = [(name, "holding_force") for name in ("allegro_box_3", "allegro_cylinder_4", "schunk_can", "planar_hand")]


@cache
def found(name: str) -> ga.Grasps:
    """Grasps from all over a problem, with force closure and without."""
    problem = ga.load_problem(name)
    return ga.Grasps(problem, ga.find_grasps(problem, count=60, seed=2))


def starts(name: str, index: str, count: int) -> Array:
    """Some of them where an index is not zero."""
    grasps = found(name)
    X = grasps.x[evaluate(index, grasps) > 1e-3]
    assert len(X) >= min(count, 3)
    return np.asarray(X[:count])


def measured(name: str, measure: _core.Measure, x: Array) -> dict[str, Array]:
    return dict(_core.measured(found(name).system, x, measure, 0.1))


def differences(name: str, row: dict[str, Array], value_at: Callable[[Array], Array]) -> Array:
    """Slopes of a function of grasps by central differences between points of the manifold."""
    system, dimension = found(name).system, len(row["Phi"])
    X = [_core.project(system, row["x"], row["Phi"], s * STEP * u) for u in np.eye(dimension) for s in (1.0, -1.0)]
    values = value_at(np.array(X))
    return np.asarray((values[::2] - values[1::2]) / (2.0 * STEP))


@pytest.mark.parametrize(("name", "index"), EXACT)
def test_values_and_slopes_are_those_of_the_index(name: str, index: str) -> None:
    X = starts(name, index, 6)
    measure = index_measure(index, found(name).problem, found(name).system, X)
    assert measure.any_thread
    for x in X:
        row = measured(name, measure, x)
        grasps = ga.Grasps(found(name).problem, row["x"][None], found(name).system)
        np.testing.assert_allclose(row["values"], evaluate(index, grasps), rtol=1e-10)
        slopes = differences(
            name, row, lambda X: evaluate(index, ga.Grasps(found(name).problem, X, found(name).system))
        )
        np.testing.assert_allclose(row["slopes"][0], slopes, atol=1e-7 * max(np.abs(slopes).max(), 1e-3))


@pytest.mark.parametrize(("name", "index"), HELD)
def test_the_holding_force_is_found_to_rounding(name: str, index: str) -> None:
    """The index of the package is that much below the force at most; only an exact one has its slopes."""
    X = starts(name, index, 6)
    grasps = found(name)
    measure = index_measure(index, grasps.problem, grasps.system, X)
    for x in X:
        row = measured(name, measure, x)
        below = evaluate(index, ga.Grasps(grasps.problem, row["x"][None], grasps.system))
        assert below <= row["values"] * (1.0 + 1e-12)
        assert row["values"] <= below * (1.0 + 1.5 * GAP)
        slopes = differences(name, row, lambda X: np.array([measured(name, measure, x)["values"][0] for x in X]))
        np.testing.assert_allclose(row["slopes"][0], slopes, atol=1e-7 * np.abs(slopes).max())


@pytest.mark.parametrize("name", ["allegro_box_3", "planar_hand"])
@pytest.mark.parametrize(
    "options", [{}, {"torsional": 0.005}, {"torque_length": 0.05}, {"friction": 0.8, "normal_force": 7.0}], ids=str
)
def test_a_requirement_has_a_row_for_each_direction(name: str, options: dict[str, float]) -> None:
    required = HoldingForce(1.0, **options)
    grasps = found(name)
    (measure,) = required.measures(grasps.problem, grasps.system)
    forces = quality.holding_force(grasps, **options)
    for x, force in list(zip(grasps.x, forces, strict=True))[:20]:
        row = measured(name, measure, x)
        assert len(set(row["ids"])) == len(row["ids"])
        if force > 0.0:
            least = (row["values"].min() + 1.0 + INSIDE) * (1.0 + GAP)
            assert force * (1.0 - 1e-7) <= least <= force * (1.0 + 1e-4)
        else:
            slack = quality.force_closure.force_closure_slack(
                ga.Grasps(grasps.problem, row["x"][None], grasps.system),
                options.get("friction", 0.5),
                options.get("torsional", 0.0),
            )
            np.testing.assert_allclose(
                row["values"], np.where(slack < -1.0, -2.0 - np.log(-slack), slack - 1.0), atol=1e-7
            )
        # Rows of other directions than the least move on their own.
        slopes = differences(name, row, partial(matched, name, measure, row["values"]))
        np.testing.assert_allclose(row["slopes"], slopes.T, atol=1e-6 * max(np.abs(slopes).max(), 1.0))


@pytest.mark.parametrize("name", ["schunk_can", "planar_hand", "gripper_skittle"])
@pytest.mark.parametrize("torsional", [0.0, 0.005])
def test_closure_has_the_slopes_of_its_slack(name: str, torsional: float) -> None:
    grasps = found(name)
    (measure,) = ga.ForceClosure(0.5, 0.02, torsional).measures(grasps.problem, grasps.system)
    slacks = quality.force_closure_slack(grasps, 0.5, torsional)
    assert (slacks > -1.0).any() or torsional == 0.0
    for x, slack in list(zip(grasps.x, slacks, strict=True))[:25]:
        row = measured(name, measure, x)
        expected = slack if slack >= -1.0 else -1.0 - np.log(min(-slack, 1e6))
        np.testing.assert_allclose(row["values"], expected - 0.02 - INSIDE, atol=1e-8)
        slopes = differences(name, row, lambda X: np.array([measured(name, measure, x)["values"][0] for x in X]))
        np.testing.assert_allclose(row["slopes"][0], slopes, atol=1e-4 * max(np.abs(slopes).max(), 1.0))


@pytest.mark.parametrize("name", ["schunk_can", "allegro_sphere_3"])
def test_distances_have_the_slopes_of_nearest_points(name: str) -> None:
    """Where the nearest points jump from one edge to another there is none; that is seldom."""
    grasps = found(name)
    required = ga.CollisionFree(5e-5)
    (measure,) = required.measures(grasps.problem, grasps.system)
    checker = collision_checker(grasps.problem, required.touch_depth, required.clearance)
    right: list[bool] = []
    for x in grasps.x:
        row = measured(name, measure, x)
        pairs = np.asarray(row["ids"], np.int32)
        apart = checker.nearest(row["x"][None], pairs).distances[0] > 1e-4
        clearances = checker.clearances(row["x"][None], pairs)[0]
        assert (row["values"] * grasps.problem.length_scale <= clearances).all()
        slopes = differences_of_clearances(name, row, checker, pairs)
        right += (np.abs(row["slopes"] - slopes) < 1e-3 * np.maximum(np.abs(slopes), 1.0))[apart].all(axis=1).tolist()
    assert len(right) > 50
    assert np.mean(right) > 0.95


def differences_of_clearances(
    name: str, row: dict[str, Array], checker: CollisionChecker, pairs: NDArray[np.int32], step: float = 1e-4
) -> Array:
    """Slopes of the distances of pairs [p, k], by steps that are long beside the error of distances."""
    system, units = found(name).system, np.eye(len(row["Phi"]))
    X = [_core.project(system, row["x"], row["Phi"], s * step * u) for u in units for s in (1.0, -1.0)]
    clearances = checker.clearances(np.array(X), pairs) / found(name).problem.length_scale
    return np.asarray((clearances[::2] - clearances[1::2]).T / (2.0 * step))


@pytest.mark.parametrize("name", ["schunk_can", "allegro_sphere_3"])
def test_joint_margins_have_a_row_for_each_limit(name: str) -> None:
    grasps = found(name)
    (measure,) = ga.JointMargin(0.1).measures(grasps.problem, grasps.system)
    lower, upper = grasps.problem.hand.joint_limits
    for x in grasps.x[:5]:
        row = measured(name, measure, x)
        q = row["x"][: len(lower)]
        left = np.concatenate([q - lower, upper - q])
        assert row["values"].min() == pytest.approx(left.min() - 0.1, abs=1e-7)
        assert len(row["values"]) == np.isfinite(left).sum()
        slopes = differences(name, row, lambda X: np.array([measured(name, measure, x)["values"] for x in X]))
        np.testing.assert_allclose(row["slopes"], slopes.T, atol=1e-7)


def matched(name: str, measure: _core.Measure, before: Array, X: Array) -> Array:
    """Values of the same rows at grasps nearby [n, rows]: those that have changed least."""
    near = (measured(name, measure, x)["values"] for x in X)
    return np.array([[values[np.abs(values - value).argmin()] for value in before] for values in near])


@pytest.mark.parametrize(("name", "index"), [*HELD[:1], *EXACT[:4], EXACT[5]])
def test_climbs_end_alike_on_any_number_of_threads(name: str, index: str) -> None:
    X, grasps = starts(name, index, 4), found(name)
    measure = index_measure(index, grasps.problem, grasps.system, X)
    one, two = (_core.climbs(grasps.system, X, measure, [], 0.2, 40, threads=n) for n in (1, 3))
    assert one["x"].tobytes() == two["x"].tobytes()
    assert one["kkt"].tobytes() == two["kkt"].tobytes()


@pytest.mark.parametrize(("name", "index"), [*HELD[:1], EXACT[0], EXACT[1], EXACT[3], EXACT[5]])
def test_climbs_end_on_maxima(name: str, index: str) -> None:
    X, grasps = starts(name, index, 20), found(name)
    system, problem = grasps.system, grasps.problem
    ends = _core.climbs(system, X, index_measure(index, problem, system, X), [], 0.3, 200)
    converged = np.array([status == "converged" for status in ends["status"]])
    assert converged.sum() >= 2
    tops = ga.Grasps(problem, ends["x"], system)
    assert (evaluate(index, tops) >= evaluate(index, ga.Grasps(problem, X, system)) * (1.0 - GAP)).all()
    random = np.random.default_rng(0)
    for x in tops.x[converged][:2]:
        Phi = measured(name, index_measure(index, problem, system, X), x)["Phi"]
        around = [_core.project(system, x, Phi, 1e-3 * random.normal(size=len(Phi))) for _ in range(30)]
        near = ga.Grasps(
            problem, [y for y in around if y is not None and min(system.slack(y), default=0.0) >= 0.0], system
        )
        at_top = evaluate(index, ga.Grasps(problem, x[None], system))
        assert (evaluate(index, near) <= at_top * (1.0 + 2.0 * GAP)).all()


def test_climbs_meet_a_holding_force() -> None:
    """From grasps without force closure too; and the ends have no more force than is asked for, where that binds."""
    grasps, required = found("allegro_box_3"), HoldingForce(3.0)
    X = grasps.x[~required.met(grasps)][:8]
    assert (quality.force_closure_margin(ga.Grasps(grasps.problem, X)) == 0.0).any()
    index = index_measure("manipulability_volume", grasps.problem, grasps.system, X)
    measures = required.measures(grasps.problem, grasps.system)
    one, two = (_core.climbs(grasps.system, X, index, measures, 0.3, 200, threads=n) for n in (1, 2))
    assert one["x"].tobytes() == two["x"].tobytes()
    ends = ga.Grasps(grasps.problem, one["x"][[status == "converged" for status in one["status"]]], grasps.system)
    assert len(ends) >= 4
    assert required.met(ends).all()
    assert quality.holding_force(ends).min() < 3.001


def test_an_index_of_the_users_keeps_its_own_values() -> None:
    grasps = found("planar_hand")

    @ga.batched
    def holding_force(grasps: ga.Grasps) -> Array:
        return np.asarray(grasps.q[:, 0])

    measure = index_measure(holding_force, grasps.problem, grasps.system, grasps.x)
    assert not measure.any_thread
    row = measured("planar_hand", measure, grasps.x[0])
    np.testing.assert_allclose(row["values"], row["x"][0], rtol=1e-12)
    named = index_measure(quality.holding_force, grasps.problem, grasps.system, grasps.x)
    assert named.any_thread


def test_wrong_arguments_are_refused() -> None:
    grasps = found("planar_hand")
    for measure, words in (
        (_core.epsilon_measure(0.0, 8, 0.0, 0.1), "friction"),
        (_core.epsilon_measure(0.5, 8, 0.0, 0.0), "length"),
        (_core.epsilon_measure(0.5, 2, 0.0, 0.1), "edges"),
    ):
        with pytest.raises(ga.GraspAtlasError, match=words):
            _core.measured(grasps.system, grasps.x[0], measure, 0.1)
