"""Why grasps are rejected, and which comes nearest to being accepted: against the definition, worked out apart."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import graspatlas as ga
from graspatlas.collision.checker import CollisionChecker
from graspatlas.collision.clash import Clash
from graspatlas.collision.shapes import Shape
from graspatlas.requirements.rejections import nearest, rejections

Array = NDArray[np.float64]
APART, RADIUS = 0.012, 0.6


@pytest.fixture(scope="module")
def bare(can: ga.Problem) -> ga.Result:
    return ga.optimize(can, radius=RADIUS, require=[])


def read_again(bare: ga.Result, *requirements: Any) -> ga.Result:
    """The same atlas with other requirements."""
    return ga.optimize(bare.problem, radius=RADIUS, require=requirements, atlas=bare.atlas)


def grasps_of(result: ga.Result) -> ga.Grasps:
    return ga.Grasps(result.problem, result.atlas.centers, result.system)


def lacking_closure(grasps: ga.Grasps, margin: float) -> Array:
    return np.maximum(margin - ga.quality.force_closure_slack(grasps, 0.5), 0.0)


def lacking_joints(grasps: ga.Grasps, distance: float) -> Array:
    lower, upper = grasps.problem.hand.joint_limits
    return np.maximum(distance - np.minimum(grasps.q - lower, upper - grasps.q).min(axis=1), 0.0)


@pytest.mark.parametrize(("margin", "distance"), [(0.3, 0.05), (0.02, 0.4), (0.35, 0.6)])
def test_the_nearest_is_that_of_the_definition(bare: ga.Result, margin: float, distance: float) -> None:
    """Fewest requirements that reject it, then the least of the largest shortfalls."""
    result = read_again(bare, ga.ForceClosure(0.5, margin), ga.JointMargin(distance))
    assert not result.accepted.any()
    lacks = np.array([lacking_closure(grasps_of(result), margin), lacking_joints(grasps_of(result), distance)])
    order = np.lexsort((lacks.max(axis=0), (lacks > 0.0).sum(axis=0)))
    assert result.nearest is not None
    assert result.nearest.chart == order[0]
    found = result.rejections(int(order[0]))
    assert len(found) == (lacks[:, order[0]] > 0.0).sum()
    assert max(each.shortfall for each in found) == pytest.approx(lacks[:, order[0]].max(), abs=1e-6)


def test_shapes_that_collide_are_the_worst_pair(bare: ga.Result) -> None:
    requirement = ga.CollisionFree(5e-5, APART)
    result = read_again(bare, requirement)
    checker = CollisionChecker(bare.problem, 5e-5, APART)
    slacks = checker.clearances(result.atlas.centers)
    assert result.nearest is not None
    chart = result.nearest.chart
    assert slacks[chart].min() == pytest.approx(slacks.min(axis=1).max(), abs=1e-5)
    (found,) = result.rejections(chart)
    pair = int(slacks[chart].argmin())
    assert found.clash is not None
    assert tuple(shape.name for shape in found.clash.shapes) == checker.pairs[pair]
    assert found.shortfall == pytest.approx(-slacks[chart].min() / bare.problem.length_scale, abs=1e-3)
    first, second = found.clash.names
    apart = 1000.0 * (slacks[chart, pair] + APART)
    assert found.why == f"{first} is {apart:.3g} mm from {second}, {1000.0 * APART:.3g} mm is required"
    points = checker.nearest(result.atlas.centers[chart][None], [pair])
    np.testing.assert_allclose(found.clash.point, 0.5 * (points.on_first + points.on_second)[0, 0], atol=1e-9)


def test_depths_in_object_and_obstacle_are_said() -> None:
    problem = ga.load_problem("allegro_cylinder_3")
    table = ga.Obstacle.plane("table", [0.0, 0.0, -0.02])
    result = ga.optimize(replace(problem, obstacles=(table,)), radius=RADIUS, require=[ga.CollisionFree()])
    assert not result.accepted.any()
    assert result.nearest is not None
    (found,) = result.rejections(result.nearest.chart)
    assert found.clash is not None
    assert found.clash.names[1] == "table"
    assert found.clash.groups == ("hand", "obstacle") if found.clash.names[0] != "cylinder" else ("object", "obstacle")
    assert found.why == f"{found.clash.names[0]} is {-1000.0 * found.clash.distance:.3g} mm inside table"


@dataclass(frozen=True)
class Outside(ga.requirements.Requirement):
    """A requirement of one's own, of which only the answer is known."""

    def met(self, grasps: ga.Grasps) -> NDArray[np.bool_]:
        return np.zeros(len(grasps), bool)

    def __str__(self) -> str:
        return "outside"


def test_what_cannot_be_measured_does_not_hide_the_rest(bare: ga.Result) -> None:
    result = read_again(bare, Outside(), ga.ForceClosure(0.5, 0.3))
    assert result.nearest is not None
    chart = result.nearest.chart
    lacks = lacking_closure(grasps_of(result), 0.3)
    assert chart == lacks.argmin()
    assert [(each.requirement, np.isfinite(each.shortfall)) for each in result.rejections(chart)] == [
        ("outside", False),
        ("force_closure:0.5:0.3", True),
    ]
    assert result.summary()["nearest"]["rejected_by"][0] == {"requirement": "outside", "shortfall": None, "why": ""}


def test_functions_are_not_asked_again_and_count_last(bare: ga.Result, tmp_path: Path) -> None:
    calls = []

    def never(grasp: ga.Grasp) -> bool:
        calls.append(grasp.chart)
        return False

    result = read_again(bare, ga.ForceClosure(0.5, 0.02), never)
    asked = len(calls)
    closed = ga.ForceClosure(0.5, 0.02).met(grasps_of(result))
    assert result.nearest is not None
    chart = result.nearest.chart
    assert closed[chart]
    assert result.qualities[chart] == result.qualities[closed].max()
    (found,) = result.rejections(chart)
    assert (found.requirement, found.why, str(found)) == ("never", "", "never")
    assert np.isnan(found.shortfall)
    assert len(calls) == asked
    result.save(tmp_path / "result.npz")
    loaded = ga.load_result(tmp_path / "result.npz")
    assert loaded.summary()["nearest"] == result.summary()["nearest"]


def test_an_accepted_grasp_has_no_rejections(bare: ga.Result) -> None:
    result = read_again(bare, ga.ForceClosure(0.5, 0.02))
    assert result.nearest is None
    assert result.rejections(result.best.chart) == ()
    assert "nearest" not in result.summary()
    rejected = int(np.flatnonzero(~result.accepted)[0])
    assert [each.requirement for each in result.rejections(rejected)] == ["force_closure:0.5:0.02"]
    n = result.atlas.n_charts
    with pytest.raises(ga.GraspAtlasError, match=f"chart {n} does not exist; the atlas has charts 0 to {n - 1}"):
        result.rejections(n)


@pytest.mark.parametrize(
    ("requirement", "words"),
    [
        (ga.ForceClosure(0.5, 0.4), r"margin 0\.\d+, 0\.4 is required"),
        (ga.ForceClosure(0.02), r"no force closure, margin -0\.\d+, more than 0 is required"),
        (ga.HoldingForce(40.0), r"withstands \d\.\d+ N, 40 N is required"),
        (ga.JointMargin(0.7), r"\w+ is 0\.\d+ rad from its (lower|upper) limit, 0\.7 rad is required"),
    ],
    ids=str,
)
def test_what_is_lacking_in_words(bare: ga.Result, requirement: ga.Requirement, words: str) -> None:
    grasps = grasps_of(bare)
    chart = nearest([requirement], grasps, bare.qualities)
    (found,) = rejections([requirement], ga.Grasps(bare.problem, bare.atlas.centers[chart], bare.system))
    assert found.shortfall > 0.0
    assert re.fullmatch(words, found.why)


@pytest.mark.parametrize(
    ("distance", "required", "words"),
    [
        (-0.0013, 0.0, "tip is 1.3 mm inside can"),
        (-0.0013, -0.0005, "tip is 1.3 mm inside can, 0.5 mm is allowed"),
        (-0.0013, 0.002, "tip is 1.3 mm inside can, 2 mm apart is required"),
        (0.0013, 0.002, "tip is 1.3 mm from can, 2 mm is required"),
        (float("nan"), 0.0, "tip cuts through can"),
    ],
)
def test_a_clash_in_words(distance: float, required: float, words: str) -> None:
    shapes = (Shape("sphere"), Shape("sphere"))
    assert Clash(shapes, ("tip", "can"), ("hand", "object"), distance, required, np.zeros(3)).text == words


def test_the_command_line_names_it(cli: Callable[..., tuple[int, str, str]], bare: ga.Result, tmp_path: Path) -> None:
    require = ("--require", f"collision_free:5e-5:{APART}")
    status, out, _ = cli("optimize", "schunk_can", "--radius", RADIUS, *require, "--output", tmp_path)
    result = read_again(bare, ga.CollisionFree(5e-5, APART))
    assert result.nearest is not None
    (found,) = result.rejections(result.nearest.chart)
    assert status == 1
    assert f"no best grasp; nearest to one is chart {result.nearest.chart}, rejected by\n    {found}\n" in out
    summary = json.loads((tmp_path / "summary.json").read_text())
    rejected_by = [{"requirement": found.requirement, "shortfall": found.shortfall, "why": found.why}]
    assert summary["nearest"] == {"chart": result.nearest.chart, "rejected_by": rejected_by}
