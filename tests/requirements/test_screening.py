"""Requirements: force closure against known answers and linear programming, collisions against coal, refusals."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import pinocchio as pin
import pytest
from helpers import symmetric_planar_problem
from numpy.typing import NDArray
from oracles.wrench_lp import margin_by_linear_programming

import graspatlas as ga
from graspatlas.collision.checker import CollisionChecker
from graspatlas.problem import requirement
from graspatlas.requirements import parse_requirement, requirement_name
from graspatlas.requirements.base import asked

Array = NDArray[np.float64]

FRICTION = 0.5


@pytest.fixture(scope="module")
def can() -> ga.Result:
    """The can with an executable best grasp."""
    require = [ga.ForceClosure(FRICTION, 0.02), ga.CollisionFree()]
    return ga.optimize(ga.load_problem("schunk_can"), radius=0.25, require=require)


@pytest.mark.parametrize("turn", [0.3, 0.45, 0.6, 0.9])
@pytest.mark.parametrize("friction", [0.2, 0.8, 2.0])
def test_margin_of_symmetric_three_finger_grasp(turn: float, friction: float) -> None:
    """By symmetry the forces meet in the centre; the angle to the normals then gives the margin."""
    problem = symmetric_planar_problem(turn)
    grasps = ga.Grasps(problem, problem.x1_array)
    point, normal = grasps.contact_points[0, 0], grasps.contact_normals[0, 0]
    cosine = point @ normal / np.linalg.norm(point)
    tangent = np.sqrt(1.0 - cosine**2) / cosine
    expected = max((friction - tangent) / 3.0 / np.sqrt(1.0 + friction**2), 0.0) if cosine > 0.0 else 0.0
    assert ga.quality.force_closure_margin(grasps, friction)[0] == pytest.approx(expected, abs=1e-8)


def test_margin_agrees_with_linear_programming() -> None:
    result = ga.optimize(ga.load_problem("schunk_can"), radius=0.25, quality="force_closure_margin", require=[])
    closed = np.flatnonzero(result.qualities > 0.0)
    assert 0.08 < len(closed) / len(result.qualities) < 0.18
    rng = np.random.default_rng(3)
    for chart in rng.choice(closed, 12, replace=False):
        bound = margin_by_linear_programming(result.grasp(int(chart)), FRICTION)
        assert result.qualities[chart] <= bound + 1e-8
        assert result.qualities[chart] == pytest.approx(bound, abs=3e-4)
    for chart in rng.choice(np.flatnonzero(result.qualities == 0.0), 12, replace=False):
        assert margin_by_linear_programming(result.grasp(int(chart)), FRICTION) < 1e-3


def test_best_grasp_of_the_can_could_be_executed(can: ga.Result) -> None:
    assert margin_by_linear_programming(can.best, FRICTION) >= 0.02
    p = can.best.contact_points
    assert min(np.linalg.norm(p[i] - p[j]) for i, j in [(0, 1), (0, 2), (1, 2)]) > 0.01
    assert can.best.quality == can.qualities[can.accepted].max()
    assert can.worst.quality == can.qualities[can.accepted].min()
    assert can.best.quality < can.qualities.max()
    assert can.is_global


def test_collisions_agree_with_distances_from_coal(can: ga.Result) -> None:
    problem = can.problem
    checker = CollisionChecker(problem, touch_depth=0.002)
    model = pin.buildModelFromXML(problem.hand.urdf)
    folders = list(problem.hand.package_dirs)
    shapes = pin.buildGeomFromUrdfString(model, problem.hand.urdf, pin.COLLISION, package_dirs=folders)
    shapes.addAllCollisionPairs()
    pin.removeCollisionPairsFromXML(model, shapes, problem.hand.srdf)
    data, shape_data = model.createData(), pin.GeometryData(shapes)
    rng = np.random.default_rng(5)
    clear = hits = 0
    for chart in rng.choice(can.atlas.n_charts, 60, replace=False):
        x = can.atlas.centers[chart]
        pin.computeDistances(model, data, shapes, shape_data, x[: model.nq])
        nearest = min(result.min_distance for result in shape_data.distanceResults)
        named = checker.first_collision(x)
        assert (named is None) == checker.free(x[None])[0]
        if nearest < -1e-6:
            assert named is not None
            hits += 1
        elif named is not None:
            assert any(name.startswith("object/") for name in named)
        else:
            clear += 1
    assert clear > 5
    assert hits > 5


def test_refusals_are_counted_cheapest_first() -> None:
    problem = ga.load_problem("schunk_can")
    require = [ga.CollisionFree(), ga.ForceClosure(FRICTION), ga.JointMargin(0.05)]
    result = ga.optimize(problem, radius=0.4, require=require)
    assert [name.split(":")[0] for name in result.rejected] == ["joint_margin", "force_closure", "collision_free"]
    assert sum(result.rejected.values()) + result.accepted.sum() == result.atlas.n_charts
    lower, upper = problem.hand.joint_limits
    q = result.best.q
    assert min((q - lower).min(), (upper - q).min()) >= 0.05


@pytest.mark.parametrize("side", [0, 1], ids=["lower", "upper"])
def test_the_joint_margin_is_kept_from_both_limits(can: ga.Result, side: int) -> None:
    """Each joint alone a little nearer to one limit than it may be, then as far as it must be; by names and angles."""
    hand = can.problem.hand
    middle = {name: 0.5 * sum(limits) for name, limits in hand.limits_by_name.items()}
    for name, limits in hand.limits_by_name.items():
        for distance, meets in ((0.049, False), (0.051, True)):
            x = can.problem.x1_array.copy()
            joints = middle | {name: limits[side] + distance * (1 - 2 * side)}
            x[: len(hand.joints)] = [joints[joint] for joint in hand.joints]
            met = ga.JointMargin(0.05).met(ga.Grasps(can.problem, x))
            assert met.tolist() == [meets], name


def test_continuous_joints_have_no_limits_to_keep_from() -> None:
    result = ga.optimize(ga.load_problem("planar_hand"), require=[ga.JointMargin(0.5)])
    assert result.accepted.all()


def test_no_grasp_meets_the_requirements(capsys: pytest.CaptureFixture[str]) -> None:
    result = ga.optimize(ga.load_problem("schunk_can"), radius=0.4, require=[ga.ForceClosure(FRICTION, 0.3)])
    assert not result.accepted.any()
    with pytest.raises(ga.GraspAtlasError, match=r"force_closure:0.5:0.3 rejected \d+"):
        _ = result.best
    assert result.check()
    from graspatlas.cli import main

    assert main(["optimize", "schunk_can", "--radius", "0.4", "--require", "force_closure:0.5:0.3"]) == 1
    assert "no best grasp" in capsys.readouterr().out


def test_predicates_one_by_one_and_in_batch() -> None:
    problem = ga.load_problem("planar_hand")

    def left(grasp: ga.Grasp) -> bool:
        return bool(grasp.object_xyz[0] < 0.0)

    @ga.batched
    def left_of_all(grasps: ga.Grasps) -> Array:
        return grasps.T_palm_object[:, 0, 3] < 0.0

    one, batch = (ga.optimize(problem, require=[predicate]) for predicate in (left, left_of_all))
    assert (one.accepted == batch.accepted).all()
    assert one.best.object_xyz[0] < 0.0
    assert one.rejected == {"left": int((~one.accepted).sum())}


@pytest.mark.parametrize(
    ("predicate", "message"),
    [
        (lambda grasp: 1 / 0, "ZeroDivisionError"),
        (ga.batched(lambda grasps: np.ones((len(grasps), 2), bool)), "booleans"),
        (ga.batched(lambda grasps: np.ones(len(grasps))), "booleans"),
    ],
)
def test_broken_predicates(predicate: Any, message: str) -> None:
    with pytest.raises(ga.GraspAtlasError, match=message):
        ga.optimize(ga.load_problem("planar_hand"), require=[predicate])


@pytest.mark.parametrize(
    "text", ["force_closure:0.5:0.02", "collision_free:0.002:0", "joint_margin:0.05", "holding_force:1"]
)
def test_text_of_requirements(text: str) -> None:
    assert requirement_name(parse_requirement(text)) == text
    assert parse_requirement(text.split(":")[0]) == type(parse_requirement(text))()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("holding_force:0", "at_least .* must be positive"),
        ("holding_force:1:0.5:-2", "normal_force .* must not be negative"),
        ("force_closer", "did you mean 'force_closure'"),
        ("force_closure:slippery", "not a number"),
        ("force_closure:-1", "friction .* must be positive"),
        ("force_closure:nan", "friction .* must be positive"),
        ("force_closure:0.5:inf", "margin .* must be finite"),
        ("joint_margin:0", "distance .* must be positive"),
        ("joint_margin:0.1:0.2", "has the values distance"),
    ],
)
def test_wrong_requirements(text: str, message: str) -> None:
    with pytest.raises(ga.GraspAtlasError, match=message):
        parse_requirement(text)


def test_body_without_collision_shapes() -> None:
    problem = symmetric_planar_problem(0.3)
    with pytest.raises(ga.GraspAtlasError, match="'three' has no collision shape"):
        CollisionChecker(problem)


def test_requirements_are_stored_and_verified_again(can: ga.Result, tmp_path: Any) -> None:
    can.save(tmp_path / "can.npz")
    loaded = ga.load_result(tmp_path / "can.npz")
    assert loaded.requirements == can.requirements
    assert (loaded.accepted == can.accepted).all()
    assert loaded.best.chart == can.best.chart
    claims = [check.claim for check in loaded.check().checks]
    assert "the best grasp fails requirement force_closure:0.5:0.02" in claims
    assert loaded.check()
    object.__setattr__(loaded, "accepted", ~can.accepted)
    del loaded.__dict__["best"]
    assert not loaded.check()


def test_a_class_enters_itself_under_its_name():
    """A requirement of one's own is read like those of the package, from text and from plain data."""
    known = dict(requirement.REQUIREMENTS)
    try:

        @dataclass(frozen=True)
        class Upright(ga.requirements.Requirement):
            tilt: float = 0.1
            name: ClassVar[str] = "upright"
            cost: ClassVar[int] = 1

        dearest = ["collision_free", "holding_force", "reachable"]
        assert list(ga.requirements.REQUIREMENTS) == ["joint_margin", "force_closure", "upright", *dearest]
        made = parse_requirement("upright:0.25")
        assert made == Upright(0.25)
        assert ga.requirements.requirement_from_dict(made.to_dict()) == made
    finally:
        requirement.REQUIREMENTS.clear()
        requirement.REQUIREMENTS.update(known)


def test_named_requirements_are_known_wherever_a_problem_is_read():
    """A problem reads requirements that it does not import: with the class of problems come all of them."""
    code = "import graspatlas as ga; ga.Problem; print(*ga.problem.requirement.REQUIREMENTS)"
    printed = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert printed.split() == ["joint_margin", "force_closure", "collision_free", "holding_force", "reachable"]


def test_what_is_only_stated_cannot_be_checked(can):
    with pytest.raises(ga.GraspAtlasError, match="derive it from Requirement"):
        asked(requirement.StatedRequirement(), ga.Grasps(can.problem, can.best.x))
