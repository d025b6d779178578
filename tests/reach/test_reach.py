"""Postures of arms against Pinocchio's and coal's Python: where they bring the hand, and what they hit."""

from __future__ import annotations

import pickle
import signal
import time
from dataclasses import replace
from itertools import combinations
from typing import Any

import coal
import numpy as np
import pinocchio as pin
import pytest
from helpers import chain, robot
from oracles.collision_oracle import hull

import graspatlas as ga
from graspatlas.hand.hand import Hand
from graspatlas.hand.named_hands import named_hand
from graspatlas.hand.robot_files import find_file
from graspatlas.reach.reach import ArmReach, arm_reach
from graspatlas.support.arrays import Array

TURNING = ["revolute"] * 5
#: The hand on a flange, a little turned.
PALM = ga.Pose([0.01, 0.02, 0.03], [0.0, 0.0, 0.1, 1.0])
BEYOND_GRIPPER = ga.Pose([0.0, 0.0, 0.3])
BASE = ga.Pose([0.3, -0.2, 0.1], [0.1, 0.0, 0.2, 1.0])
PANDA_SRDF = "package://example-robot-data/robots/panda_description/srdf/panda.srdf"
BALL = '<collision><geometry><sphere radius="0.02"/></geometry></collision>'
#: Seven joints, of which the first slides and the second turns without limits.
MADE = robot(
    chain("a", (0, 0, 0.1), ["0 0 1", *(["0 0 1", "0 1 0", "1 0 0"] * 2)], 0.15, ["prismatic", "continuous", *TURNING])
).replace('<link name="a_2"/>', f'<link name="a_2">{BALL}</link>')


def arm_of(name: str, **more: Any) -> ga.Arm:
    """An arm of example-robot-data, with the pairs of its own that may touch."""
    found = named_hand(name).hand
    if name == "panda":
        found = replace(found, srdf=find_file(PANDA_SRDF, None).read_text())
        return ga.Arm(found, "panda_link8", BEYOND_GRIPPER, BASE, **more)
    return ga.Arm(found, "tool0", PALM, BASE, **more)


def flange_placements(arm: ga.Arm, Q: Array) -> Array:
    """T_base_flange (n, 4, 4) at configurations of the arm (n, nq), by Pinocchio's Python."""
    model = pin.buildModelFromXML(arm.robot.urdf)
    data, frame = model.createData(), model.getFrameId(arm.flange)
    out = np.empty((len(Q), 4, 4))
    for T, q in zip(out, Q, strict=True):
        pin.framesForwardKinematics(model, data, q)
        T[:] = data.oMf[frame].homogeneous
    return out


def random_postures(arm: ga.Arm, count: int, seed: int = 3) -> Array:
    """Configurations of an arm (n, nq), evenly within its limits, by Pinocchio's Python."""
    model = pin.buildModelFromXML(arm.robot.urdf)
    lower, upper = (limits.copy() for limits in (model.lowerPositionLimit, model.upperPositionLimit))
    rng = np.random.default_rng(seed)
    Q = rng.uniform(np.maximum(lower, -np.pi), np.minimum(upper, np.pi), (count, model.nq))
    for joint in range(1, model.njoints):
        if model.nqs[joint] == 2:
            at, angle = model.idx_qs[joint], rng.uniform(-np.pi, np.pi, count)
            Q[:, at], Q[:, at + 1] = np.cos(angle), np.sin(angle)
    return Q


def object_for(arm: ga.Arm, T_base_flange: Array) -> Array:
    """T_palm_object (n, 4, 4) that has the flange there."""
    pose = [pin.XYZQUATToSE3(np.r_[p.xyz, p.quat_xyzw]).homogeneous for p in (arm.palm, arm.base, arm.object)]
    return np.asarray(np.linalg.inv(T_base_flange @ pose[0]) @ np.linalg.inv(pose[1]) @ pose[2])


def off(T: Array, other: Array) -> tuple[float, float]:
    """Largest distance [m] and angle [rad] between placements (n, 4, 4)."""
    turned = [pin.log3(a[:3, :3].T @ b[:3, :3]) for a, b in zip(T, other, strict=True)]
    return float(np.linalg.norm((T - other)[:, :3, 3], axis=1).max()), float(np.linalg.norm(turned, axis=1).max())


@pytest.fixture(scope="module")
def can_on_ur5(can: ga.Problem) -> ga.Problem:
    """The can before a UR5, above a table."""
    table = ga.Obstacle.plane("table", [0, 0, -0.6])
    camera = ga.Obstacle.sphere("camera", 0.03, ga.Pose([0.12, 0, 0]), frame="palm")
    arm = replace(arm_of("ur5_robot"), base=ga.Pose(), object=ga.Pose([0.4, 0.2, 0.5]))
    return replace(can, arm=arm, obstacles=(table, camera))


ARMS = {
    "ur5": lambda: arm_of("ur5_robot"),
    "ur5 within half a turn": lambda: arm_of("ur5_joint_limited_robot"),
    "panda": lambda: arm_of("panda"),
    "made": lambda: ga.Arm(Hand("made", MADE), "a_tip", PALM, BASE),
}


@pytest.mark.parametrize("name", ARMS)
def test_where_random_postures_are_can_be_reached(can: ga.Problem, name: str) -> None:
    arm = ARMS[name]()
    Q = random_postures(arm, 600)
    T = flange_placements(arm, Q)
    reach = ArmReach(replace(can, arm=arm))
    found = reach.look(np.tile(can.x1_array[:13], (len(Q), 1)), object_for(arm, T))
    in_place = np.array([status is not ga.ReachStatus.NO_POSTURE for status in found.statuses])
    assert in_place.mean() >= 0.99
    assert found.found.sum() > 50
    moved = flange_placements(arm, found.q[found.found])
    distance, angle = off(moved, T[found.found])
    assert distance < 1e-6
    assert angle < 1e-6
    assert np.isnan(found.q[~found.found]).all()
    for joint, positions in found.positions.items():
        lower, upper = arm.robot.limits_by_name[joint]
        assert (positions[found.found] >= lower).all()
        assert (positions[found.found] <= upper).all()


class Scene:
    """Arm, hand, object and obstacles by Pinocchio's and coal's Python, each in a model of its own."""

    def __init__(self, problem: ga.Problem) -> None:
        assert problem.arm is not None
        self.arm, self.problem = problem.arm, problem
        self.models = [pin.buildModelFromXML(body.urdf) for body in (self.arm.robot, problem.hand)]
        self.links = [
            self.read(model, body) for model, body in zip(self.models, (self.arm.robot, problem.hand), strict=True)
        ]
        self.object = [
            (shape, at) for _, shape, _, at in self.read(pin.buildModelFromXML(problem.object.urdf), problem.object)
        ]
        joint = self.models[0].frames[self.models[0].getFrameId(self.arm.flange)].parentJoint
        #: Joints of the arm's shapes that may touch: neighbours; and the last, on which the hand is.
        self.last = joint

    @staticmethod
    def read(model: Any, body: Any) -> list[tuple[str, Any, int, Any]]:
        geometry = pin.buildGeomFromUrdfString(model, body.urdf, pin.COLLISION, None, list(body.package_dirs))
        out = []
        for item in geometry.geometryObjects.tolist():
            shape = item.geometry.clone()
            convex = body.name != "ur5_robot"  # whose meshes are hollowed; those of hand and can are convex
            shape = hull(shape) if convex and isinstance(shape, coal.BVHModelBase) else shape
            at = pin.SE3(item.placement.rotation.copy(), item.placement.translation.copy())
            out.append((item.name, shape, int(item.parentJoint), at))
        return out

    def distance(self, q_arm: Array, q_hand: Array, with_itself: bool = True) -> float:
        """Least distance that a pair has with the arm and the hand there [m]; at most 0 in collision.

        Without those of two links of the arm, where that is asked for.
        """
        arm, problem = self.arm, self.problem
        datas = [model.createData() for model in self.models]
        for model, data, q in zip(self.models, datas, (q_arm, q_hand), strict=True):
            pin.framesForwardKinematics(model, data, q)
        flange = datas[0].oMf[self.models[0].getFrameId(arm.flange)]
        palm = flange * pin.XYZQUATToSE3(np.r_[arm.palm.xyz, arm.palm.quat_xyzw])
        base, thing = (pin.XYZQUATToSE3(np.r_[p.xyz, p.quat_xyzw]) for p in (arm.base, arm.object))
        object_ = base.inverse() * thing
        links = [(shape, joint, datas[0].oMi[joint] * at) for _, shape, joint, at in self.links[0]]
        hand = [(shape, joint, palm * datas[1].oMi[joint] * at) for _, shape, joint, at in self.links[1]]
        pairs = [(a, A, b, B) for (a, i, A), (b, j, B) in combinations(links, 2) if with_itself and abs(i - j) > 1]
        pairs += [(a, A, b, B) for a, i, A in links for b, j, B in hand if i != self.last or j != 0]
        pairs += [(a, A, b, object_ * B) for a, _, A in links for b, B in self.object]
        for obstacle in problem.obstacles:
            at = pin.SE3(np.eye(3), np.array(obstacle.pose.xyz))
            for a, i, A in links:
                if obstacle.name == "table" and i != 0:
                    pairs.append((a, A, coal.Halfspace(np.array([0.0, 0.0, 1.0]), 0.0), object_ * at))
                elif obstacle.name == "camera" and i != self.last:
                    pairs.append((a, A, coal.Sphere(0.03), palm * at))
        return min(self.between(*pair) for pair in pairs)

    @staticmethod
    def between(a: Any, A: Any, b: Any, B: Any) -> float:
        places = [coal.Transform3s(T.rotation.copy(), T.translation.copy()) for T in (A, B)]
        return float(coal.distance(a, places[0], b, places[1], coal.DistanceRequest(), coal.DistanceResult()))


def test_collisions_are_those_of_coal(can_on_ur5: ga.Problem) -> None:
    reach, scene = ArmReach(can_on_ur5), Scene(can_on_ur5)
    rng = np.random.default_rng(0)
    arm, lower, upper = can_on_ur5.arm, *can_on_ur5.hand.joint_limits
    assert arm is not None
    Q, H = random_postures(arm, 60), rng.uniform(lower, upper, (60, len(lower)))
    whole = np.empty((len(Q), reach.both.model.q_size))
    whole[:, reach.both.arm_at], whole[:, reach.both.hand_at] = Q, H
    distances = np.array([scene.distance(*pair) for pair in zip(Q, H, strict=True)])
    free, clear = np.asarray(reach.collisions.free(whole)), (distances <= 0.0) | (distances > 1e-5)
    assert 10 < free.sum() < 50
    assert clear.mean() > 0.95
    np.testing.assert_array_equal(free[clear], distances[clear] > 0.0)
    # Where these postures that hit nothing are, one is found, and it hits nothing.
    T = flange_placements(arm, Q[free])
    found = reach.look(H[free], object_for(arm, T))
    assert found.found.mean() >= 0.99
    assert min(scene.distance(*pair) for pair in zip(found.q[found.found], H[free][found.found], strict=True)) > -1e-6


def test_a_clearance_is_kept(can_on_ur5: ga.Problem, can_result: ga.Result) -> None:
    scene, grasps = Scene(can_on_ur5), ga.Grasps(can_on_ur5, can_result.atlas.centers[::120])
    free = grasps.reach()
    distances = distances_of(scene, free, grasps)
    clearance = float(np.nanmedian(distances))
    kept = grasps.reach(clearance)
    assert not (kept.found & ~free.found).any()
    assert kept.found[distances > clearance + 1e-6].all()
    assert np.nanmin(distances_of(scene, kept, grasps)) > clearance - 1e-6


def distances_of(scene: Scene, reach: Any, grasps: ga.Grasps) -> Array:
    """Least distance of the arm from hand, object and obstacles in the postures found (n,), NaN where none was."""
    rows = zip(reach.found, reach.q, grasps.q, strict=True)
    return np.array([scene.distance(q, h, with_itself=False) if found else np.nan for found, q, h in rows])


def test_what_is_found_depends_on_the_grasp_alone(can_on_ur5: ga.Problem, can_result: ga.Result) -> None:
    X = can_result.atlas.centers[:200]
    grasps = ga.Grasps(can_on_ur5, X)
    together, backwards = grasps.reach(), ga.Grasps(can_on_ur5, X[::-1]).reach()
    np.testing.assert_array_equal(together.q, backwards.q[::-1])
    there = int(np.flatnonzero(together.found)[-1])
    one = pickle.loads(pickle.dumps(grasps))[there]
    assert one.arm_positions() == {name: q[there] for name, q in together.positions.items()}
    assert list(one.arm_positions()) == list(can_on_ur5.arm.joints)  # type: ignore[union-attr]


def test_what_is_far_away_is_refused(can_on_ur5: ga.Problem) -> None:
    assert can_on_ur5.arm is not None
    near = ga.Grasps(can_on_ur5, can_on_ur5.x1_array)
    assert near.reach().found.all()
    none = ga.Grasps(can_on_ur5, near.x[:0]).reach()
    assert (none.q.shape, none.found.shape, none.positions["elbow_joint"].shape) == ((0, 6), (0,), (0,))
    for distance in (1.2, 3.0, 1e6):  # a little too far, and far beyond
        away = replace(can_on_ur5, arm=replace(can_on_ur5.arm, object=ga.Pose([distance, 0, 0.5])))
        grasps = ga.Grasps(away, away.x1_array)
        assert grasps.reach().statuses == (ga.ReachStatus.NO_POSTURE,)
        assert np.isnan(list(grasps.arm_positions().values())).all()
        with pytest.raises(
            ga.GraspAtlasError, match=r"no posture was found within the joint limits, which is no proof"
        ):
            grasps[0].arm_positions()


def test_who_is_in_the_way_is_said(can_on_ur5: ga.Problem) -> None:
    wall = ga.Obstacle.sphere("balloon", 0.6)
    grasps = ga.Grasps(replace(can_on_ur5, obstacles=(wall,)), can_on_ur5.x1_array)
    assert grasps.reach().statuses == (ga.ReachStatus.HITS,)
    with pytest.raises(ga.GraspAtlasError, match=r"something is hit, in the first arm/\w+ and obstacle/balloon; take"):
        grasps[0].arm_positions()


def test_a_problem_without_an_arm(can: ga.Problem) -> None:
    with pytest.raises(ga.GraspAtlasError, match=r"problem 'schunk_can' has no arm; state one: see graspatlas.Arm"):
        ga.Grasps(can, can.x1_array).reach()


def test_ctrl_c_ends_it(can_on_ur5: ga.Problem, can_result: ga.Result) -> None:
    reach, grasps = arm_reach(can_on_ur5), ga.Grasps(can_on_ur5, can_result.atlas.centers[:200])
    many = np.repeat(reach.flange_targets(grasps.T_palm_object), 2000, axis=0), np.repeat(grasps.q, 2000, axis=0)
    before, start = signal.signal(signal.SIGALRM, signal.default_int_handler), time.perf_counter()
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.2)
        with pytest.raises(KeyboardInterrupt):
            reach._batch.solve(*many)  # all of them take a quarter of a minute
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
    assert time.perf_counter() - start < 5.0


@pytest.mark.parametrize(
    ("targets", "hand", "message"),
    [
        (np.eye(4), np.zeros((1, 13)), r"poses must have the shape \[n, 4, 4\]"),
        (np.full((1, 4, 4), np.nan), np.zeros((1, 13)), "poses must hold finite numbers; see pose 0"),
        (np.eye(4)[None], np.zeros((1, 12)), r"hand must have the shape \[targets, 13\]"),
        (np.eye(4)[None], np.full((1, 13), np.inf), "hand must hold finite numbers"),
    ],
)
def test_the_core_refuses_what_does_not_fit(can_on_ur5: ga.Problem, targets: Array, hand: Array, message: str) -> None:
    with pytest.raises(ga.GraspAtlasError, match=message):
        arm_reach(can_on_ur5)._batch.solve(targets, hand)
