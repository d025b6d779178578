"""Functions of the user: what they see cannot be written to, what they return is a number or a flag or refused."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from helpers import Written

import graspatlas as ga
from graspatlas.grasps import Grasps
from graspatlas.quality import evaluate
from graspatlas.requirements import screen


@pytest.fixture(scope="module")
def planar() -> ga.Result:
    return ga.optimize(ga.load_problem("planar_hand"), require=())


def batch_of(result: ga.Result, charts: list[int]) -> Grasps:
    return Grasps(result.problem, result.atlas.centers[charts], result.atlas.system, charts)  # type: ignore[arg-type]


NO_NUMBERS = {
    "None": (None, "a return statement may be missing"),
    "text": ("1.5", "'1.5'"),
    "bytes": (b"1", "b'1'"),
    "complex": (1.0 + 2.0j, "complex"),
    "complex without imaginary part": (np.complex128(1.0), "complex"),
    "NaN": (float("nan"), "NaN"),
    "infinity": (float("inf"), "inf"),
    "minus infinity": (np.float64("-inf"), "-inf"),
    "object": (object(), "object"),
    "two numbers": ([1.0, 2.0], r"shape \(2,\)"),
    "masked": (np.ma.masked, "masked"),
    "masked array": (np.ma.array(1.0, mask=True), "masked"),
    "ragged": ([1.0, [2.0]], r"\[1.0, \[2.0\]\]"),
    "dictionary": ({"quality": 1.0}, "quality"),
    "date": (np.datetime64("2026-01-01"), "2026"),
    "huge": (10**400, "1000"),
}


@pytest.mark.parametrize("name", NO_NUMBERS)
def test_what_is_no_finite_number_is_refused(planar: ga.Result, name: str) -> None:
    """With the index's name, what it returned, and the number of the chart."""
    value, words = NO_NUMBERS[name]

    def mine(grasp: ga.Grasp) -> Any:
        return value if grasp.chart == 8 else 1.0

    with pytest.raises(ga.GraspAtlasError, match=words) as caught:
        evaluate(mine, batch_of(planar, [3, 8, 5]))
    assert "quality index 'mine'" in str(caught.value)
    assert "chart 8" in str(caught.value)

    @ga.batched
    def all_at_once(grasps: Grasps) -> Any:
        return [value if chart == 8 else 1.0 for chart in grasps.charts]

    with pytest.raises(ga.GraspAtlasError, match="quality index 'all_at_once'"):
        evaluate(all_at_once, batch_of(planar, [3, 8, 5]))


NUMBERS = [1, 1.5, True, np.float32(1.5), np.int8(3), np.array(2.5), np.ma.array(2.5), np.bool_(False), 2**62]


@pytest.mark.parametrize("value", NUMBERS, ids=str)
def test_what_is_a_number_is_one(planar: ga.Result, value: Any) -> None:
    some = batch_of(planar, [0, 1])
    np.testing.assert_array_equal(evaluate(lambda grasp: value, some), [float(value)] * 2)
    np.testing.assert_array_equal(evaluate(ga.batched(lambda grasps: np.array([value] * 2)), some), [float(value)] * 2)


NO_FLAGS = ["yes", "", None, float("nan"), 1, 0, 1.0, [True], [], np.ones(2, bool), np.ma.masked, 1j, Ellipsis]


@pytest.mark.parametrize("value", NO_FLAGS, ids=str)
def test_what_is_no_flag_is_refused(planar: ga.Result, value: Any) -> None:
    """Text and NaN count as true in Python, and an empty list as false."""

    def mine(grasp: ga.Grasp) -> Any:
        return value if grasp.chart == 8 else True

    with pytest.raises(ga.GraspAtlasError, match=r"requirement 'mine' must return one boolean.*chart 8"):
        screen([mine], batch_of(planar, [3, 8, 5]))
    with pytest.raises(ga.GraspAtlasError, match=r"requirement '<lambda>' must return an array of 3 booleans"):
        screen([ga.batched(lambda grasps: [value] * 3)], batch_of(planar, [3, 8, 5]))


@pytest.mark.parametrize("value", [True, np.bool_(True), np.array(True)], ids=["bool", "NumPy", "array"])
def test_what_is_a_flag_is_one(planar: ga.Result, value: Any) -> None:
    some = batch_of(planar, [3, 8, 5])
    flags, refused = screen([lambda grasp: value if grasp.chart != 8 else not value], some)
    assert flags.tolist() == [True, False, True]
    assert refused == {"<lambda>": 1}


def test_masked_flags_are_refused(planar: ga.Result) -> None:
    masked = np.ma.array([True, True, False], mask=[False, True, False])
    with pytest.raises(ga.GraspAtlasError, match="masked"):
        screen([ga.batched(lambda grasps: masked)], batch_of(planar, [3, 8, 5]))
    with pytest.raises(ga.GraspAtlasError, match="masked"):
        evaluate(ga.batched(lambda grasps: [1.0, np.ma.masked, 3.0]), batch_of(planar, [3, 8, 5]))


def test_charts_are_told_after_a_requirement_has_refused_some(planar: ga.Result) -> None:
    """The second requirement sees the charts that the first has left, by their own numbers."""
    seen = []

    def even(grasp: ga.Grasp) -> bool:
        return grasp.chart % 2 == 0

    def seen_by(grasp: ga.Grasp) -> bool:
        seen.append(grasp.chart)
        return True

    screen([even, seen_by], batch_of(planar, [3, 8, 5, 12]))
    assert seen == [8, 12]


# ------------------------------------------------------------------------------------------- read-only


def arrays_in(thing: Any, path: str, seen: dict[int, Any], depth: int = 5) -> list[tuple[str, np.ndarray[Any, Any]]]:
    """All arrays that can be reached from an object by attributes that may be read."""
    if isinstance(thing, np.ndarray):
        return [(path, thing)]
    if id(thing) in seen or depth == 0:
        return []
    seen[id(thing)] = thing  # kept alive, so that no other gets its id
    if isinstance(thing, tuple | list):
        return [found for i, part in enumerate(thing) for found in arrays_in(part, f"{path}[{i}]", seen, depth - 1)]
    if not type(thing).__module__.startswith("graspatlas.") or isinstance(thing, type):
        return []
    out = []
    for name in dir(thing):
        if not name.startswith("__") and name not in ("object_pose", "palm_pose"):
            try:
                value = getattr(thing, name)
            except (ga.GraspAtlasError, DeprecationWarning):  # an earlier name, which warns
                continue
            if not callable(value):
                out += arrays_in(value, f"{path}.{name}", seen, depth - 1)
    return out


@pytest.mark.parametrize(("name", "dimension"), [("planar_hand", 1), ("three_finger_cup", 2)])
def test_a_function_that_writes_into_a_grasp_changes_nothing(name: str, dimension: int) -> None:
    """Neither the grasp of others, nor the problem, nor the result: every array is read-only, or a copy of its own."""
    problem = ga.load_problem(name)
    options = {"dimension": dimension, "radius": 0.5, "max_charts": 20, "epsilon": 0.5, "quality": "joint_centrality"}
    result = ga.optimize(problem, **options, require=())  # type: ignore[arg-type]
    known = {key: array.copy() for key, array in result.atlas.to_arrays().items()}

    def look() -> dict[str, bytes]:
        many = Grasps(result.problem, result.atlas.centers, result.atlas.system)  # type: ignore[arg-type]
        things = {"batch": many, "grasp": many[3], "result": result}
        return {
            path: array.tobytes()
            for key, thing in things.items()
            for path, array in arrays_in(thing, key, {})
            if not path.endswith(".charts")
        }

    @ga.batched
    def spoils_a_batch(grasps: Grasps) -> Any:
        spoil(arrays_in(grasps, "", {}))
        return np.zeros(len(grasps))

    def spoils(grasp: ga.Grasp) -> bool:
        spoil(arrays_in(grasp, "", {}))
        return True

    written = []

    def spoil(arrays: list[tuple[str, Any]]) -> None:
        for path, array in arrays:
            try:
                array[...] = 7
                written.append(path)
            except ValueError as error:
                assert "read-only" in str(error)  # noqa: PT017

    before = look()
    assert {"batch.x", "grasp.q", "grasp.problem.x1_array", "result.qualities", "result.atlas.bases"} <= set(before)
    many = Grasps(result.problem, result.atlas.centers, result.atlas.system)  # type: ignore[arg-type]
    evaluate(spoils_a_batch, many)
    screen([spoils], many)
    assert ".x" not in written
    assert look() == before
    for key, array in known.items():
        np.testing.assert_array_equal(getattr(result.atlas, key), array)


def test_arrays_of_results_cannot_be_written_to(planar: ga.Result) -> None:
    result = planar.by("joint_centrality")
    for name, array in [*result.atlas.to_arrays().items(), ("qualities", result.qualities), *result.others.items()]:
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0
        assert name
    centers = result.atlas.centers.copy()
    centers[0] += 1.0  # what was copied is the user's
    assert replace(result.atlas, centers=centers).centers[0, 0] == result.atlas.centers[0, 0] + 1.0


def test_the_users_own_array_stays_writable(planar: ga.Result) -> None:
    X = planar.atlas.centers.copy()
    batch = Grasps(planar.problem, X)
    X[0, 0] += 1.0
    assert X.flags.writeable
    assert not batch.x.flags.writeable


# ------------------------------------------------------------------------------------------- nothing is lost


def test_a_function_that_always_fails_does_so_before_the_work() -> None:
    """At a radius at which the atlas would take hours."""
    bottle = ga.load_problem("schunk_oil_bottle")
    start = time.perf_counter()
    with pytest.raises(ga.GraspAtlasError, match="'<lambda>' returned NaN for chart 0"):
        ga.optimize(bottle, dimension=3, radius=1e-3, quality=lambda grasp: np.nan)
    with pytest.raises(ga.GraspAtlasError, match="requirement '<lambda>' must return one boolean"):
        ga.optimize(bottle, dimension=3, radius=1e-3, require=[lambda grasp: "yes"])
    with pytest.raises(ga.GraspAtlasError, match="a requirement is one of"):
        ga.optimize(bottle, dimension=3, radius=1e-3, require=["collision_free"])  # type: ignore[list-item]
    assert time.perf_counter() - start < 30.0


@pytest.mark.parametrize("where", ["index", "requirement", "second index", "batch"])
def test_an_error_after_the_atlas_carries_it(planar: ga.Result, where: str) -> None:
    def index(grasp: ga.Grasp) -> float:
        return 1.0 / (grasp.chart - 7)

    def requirement(grasp: ga.Grasp) -> Any:
        return grasp.chart < 7 or None

    @ga.batched
    def batch(grasps: Grasps) -> Any:
        return np.full(len(grasps), 1j)

    wrong: dict[str, Any] = {
        "index": {"quality": index, "require": ()},
        "requirement": {"require": [requirement]},
        "second index": {"quality": ["joint_centrality", index], "require": ()},
        "batch": {"quality": batch, "require": ()},
    }[where]
    with pytest.raises(ga.GraspAtlasError, match=r"'(index|requirement|batch)'") as caught:
        ga.optimize(planar.problem, **wrong)
    atlas = caught.value.atlas  # type: ignore[attr-defined]
    assert (atlas.centers == planar.atlas.centers).all()
    again = ga.optimize(planar.problem, atlas=atlas, require=())
    assert again.atlas is atlas
    assert (again.qualities == planar.qualities).all()
    assert again.check()


def test_an_error_of_the_refinement_carries_the_result(planar: ga.Result) -> None:
    centres = {x.tobytes() for x in planar.atlas.centers}

    def at_centres_only(grasp: ga.Grasp) -> float:
        return float(grasp.object_xyz[0]) if grasp.x.tobytes() in centres else float("nan")

    with pytest.raises(ga.GraspAtlasError, match="NaN") as caught:
        ga.optimize(planar.problem, atlas=planar.atlas, quality=at_centres_only, require=(), refine=True)
    kept = caught.value.result  # type: ignore[attr-defined]
    objects = Grasps(planar.problem, planar.atlas.centers).object_xyz
    assert kept.best.object_xyz[0] == objects[:, 0].max()


def test_an_atlas_of_something_else_is_refused(planar: ga.Result, small_result: ga.Result) -> None:
    planar_again = {"problem": planar.problem, "atlas": planar.atlas}
    with pytest.raises(ga.GraspAtlasError, match="give the atlas of the same call"):
        ga.optimize(planar.problem, atlas=small_result.atlas)
    with pytest.raises(ga.GraspAtlasError, match="radius"):
        ga.optimize(**planar_again, radius=2.0 * planar.atlas.radius)
    with pytest.raises(ga.GraspAtlasError, match="epsilon"):
        ga.optimize(**planar_again, epsilon=0.5 * planar.atlas.epsilon)
    with pytest.raises(ga.GraspAtlasError, match="must be a Atlas"):
        ga.optimize(planar.problem, atlas=planar)  # type: ignore[arg-type]
    moved = planar.problem.at(planar.atlas.centers[planar.atlas.n_charts // 2])
    with pytest.raises(ga.GraspAtlasError, match="from x1"):
        ga.optimize(moved, atlas=planar.atlas)
    assert ga.optimize(**planar_again, require=()).best.chart == planar.best.chart


def test_max_seconds_leaves_time_to_read(small_result: ga.Result) -> None:
    """An index that takes half a millisecond a grasp, at charts that take a tenth of that each."""

    def slow(grasp: ga.Grasp) -> float:
        end = time.perf_counter() + 5e-4
        while time.perf_counter() < end:
            pass
        return 1.0

    start = time.perf_counter()
    result = ga.optimize(small_result.problem, dimension=3, radius=0.03, quality=slow, require=(), max_seconds=2.0)
    seconds = time.perf_counter() - start
    assert result.status is ga.Status.TIME_LIMIT
    assert result.quality_seconds > 0.5
    assert 1.0 < seconds < 4.0


@pytest.mark.parametrize("where", ["relevant", "feasible"])
def test_max_seconds_ends_the_climbs(small_result: ga.Result, where: str) -> None:
    def slow(grasp: ga.Grasp) -> float:
        time.sleep(1e-2)
        return float(np.sin(40.0 * grasp.x).sum())

    start = time.perf_counter()
    options: dict[str, Any] = {"radius": small_result.atlas.radius, "quality": slow, "require": (), "max_seconds": 1.5}
    result = ga.optimize(small_result.problem, atlas=small_result.atlas, refine=where, **options)
    assert time.perf_counter() - start < 3.0
    assert result.refinement is not None
    assert not result.refinement.complete
    assert result.refined_best.quality >= result.best.quality


# ------------------------------------------------------------------------------------------- systems in Python


WRONG_SYSTEMS = {
    "NaN": (float("nan"), r"x0 could not be projected.* of Written returned NaN"),
    "infinity": (float("inf"), r"x0 could not be projected.* of Written returned infinity"),
    "complex": (1j, r"\(x\) must return real numbers; it returned complex numbers"),
    "text": ("1.0", r"\(x\) must return real numbers; it returned text"),
    "None": (None, r"\(x\) must return real numbers; it returned something of type list"),
    "object": (object(), r"\(x\) must return real numbers; it returned something of type list"),
    "masked": (np.ma.masked, r"\(x\) must return real numbers; .* with masked entries"),
}


@pytest.mark.parametrize("name", WRONG_SYSTEMS)
@pytest.mark.parametrize("method", ["residual", "jacobian"])
def test_a_system_must_return_real_numbers(method: str, name: str) -> None:
    value, words = WRONG_SYSTEMS[name]
    wrong = {"residual": lambda x: [value], "jacobian": lambda x: [[value, 2.0 * x[1]]]}
    right = {"residual": lambda x: [x @ x - 1.0], "jacobian": lambda x: [2.0 * x]}
    chosen: dict[str, Any] = right | {method: wrong[method]}
    with pytest.raises(ga.GraspAtlasError, match=words) as caught:
        ga.build_atlas(Written(2, 1, chosen["residual"], chosen["jacobian"]), [0.6, 0.8], radius=0.3, epsilon=0.3)
    assert method in str(caught.value)


@pytest.mark.parametrize("number", [np.float32, np.float64, np.longdouble, lambda x: np.ma.array(x), list, tuple])
def test_a_system_may_return_real_numbers_of_any_kind(number: Any) -> None:
    system = Written(2, 1, lambda x: number(np.array([x @ x - 1.0])), lambda x: np.array([2.0 * x]))
    atlas = ga.build_atlas(system, [0.6, 0.8], radius=0.3, epsilon=0.3)
    assert atlas.complete
    assert atlas.volumes.sum() == pytest.approx(2.0 * np.pi, rel=0.02)
