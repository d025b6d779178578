"""Postures before grasps, against Pinocchio's kinematics and what a single joint can do."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from helpers import symmetric_planar_problem

import graspatlas as ga
from graspatlas.collision.checker import CollisionChecker
from graspatlas.support.arrays import Array

NAMES = ("allegro_sphere_3", "allegro_box_4", "schunk_can", "gripper_skittle", "three_finger_cup", "planar_hand")
THUMB = ("joint_12.0", "joint_13.0", "joint_14.0", "joint_15.0")


def grasp_of(problem: ga.Problem) -> ga.Grasp:
    """The first grasp."""
    return ga.Grasps(problem, problem.x1_array)[0]


def with_limits(problem: ga.Problem, limits: dict[str, tuple[float, float]]) -> ga.Problem:
    """The problem with other joint limits."""
    return replace(problem, hand=replace(problem.hand, limits=limits))


def distances_by_pinocchio(grasp: ga.Grasp, q: Array) -> Array:
    """How far the contact points of the links are off the object along its normals, with the hand at q (m,), metres."""
    model = pin.buildModelFromXML(grasp.problem.hand.tree)
    data = model.createData()

    def placements(at: Array) -> list[pin.SE3]:
        pin.framesForwardKinematics(model, data, np.array(at))
        return [data.oMf[model.getFrameId(frame)].copy() for frame in grasp.contact_frames]

    moved = [
        after.act(before.actInv(point))
        for before, after, point in zip(placements(grasp.q), placements(q), grasp.contact_points, strict=True)
    ]
    return np.einsum("mi,mi->m", np.array(moved) - grasp.contact_points, grasp.contact_normals)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("distance", [0.002, 0.01])
def test_all_contacts_are_as_far_off_as_asked(name: str, distance: float) -> None:
    grasp = grasp_of(ga.load_problem(name))
    hand = grasp.problem.hand
    before = grasp.pregrasp(distance)
    assert before.reached
    assert before.reason == ""
    np.testing.assert_allclose(before.distances, distance, atol=1e-4)
    for x, stated in zip(before.path, before.path_distances, strict=True):
        np.testing.assert_allclose(distances_by_pinocchio(grasp, x[: len(grasp.q)]), stated, atol=1e-6)
    assert (np.diff(before.path_distances, axis=0) > 0.0).all()
    assert np.ptp(before.path_distances, axis=1).max() < 1e-4
    lower, upper = hand.joint_limits
    assert ((before.path[:, : len(grasp.q)] >= lower) & (before.path[:, : len(grasp.q)] <= upper)).all()
    np.testing.assert_allclose(grasp.problem.mimic_residual(before.path), 0.0, atol=1e-12)
    np.testing.assert_array_equal(before.path[0], grasp.x)
    np.testing.assert_array_equal(
        before.path[:, len(grasp.q) :], np.tile(grasp.x[len(grasp.q) :], (len(before.path), 1))
    )
    np.testing.assert_array_equal(before.path[-1], before.x)
    np.testing.assert_array_equal(before.q, before.x[: len(grasp.q)])
    assert before.joint_positions == hand.joint_positions(before.q)
    assert CollisionChecker(grasp.problem, touch_depth=0.0).free(before.x[None]).all()
    assert CollisionChecker(grasp.problem).free(before.path).all()


def test_joints_that_carry_no_contact_stay() -> None:
    """Three fingers touch; the fourth, whose joints move too, is left where it is."""
    four = ga.load_problem("allegro_sphere_4")
    assert four.x1 is not None
    x1 = replace(four.x1, joints={**four.x1.joints, "joint_5.0": 0.1, "joint_6.0": 0.2})  # opened
    contacts = tuple(contact for contact in four.contacts if contact.frame != "link_7.0_tip")
    grasp = grasp_of(replace(four, x1=x1, contacts=contacts, motions=None, defaults={}))
    before = grasp.pregrasp()
    moved = {name for name in grasp.joints if before.joint_positions[name] != grasp.joint_positions[name]}
    assert before.reached
    assert moved
    assert not moved & {"joint_4.0", "joint_5.0", "joint_6.0", "joint_7.0"}


def test_a_batch_is_the_same_as_one_by_one(small_result: ga.Result) -> None:
    grasps = ga.Grasps(small_result.problem, small_result.atlas.centers[:70])
    together = grasps.pregrasps(0.005)
    assert len(together) == len(grasps)
    for i in (0, 33, len(grasps) - 1):
        alone = grasps[i].pregrasp(0.005)
        np.testing.assert_allclose(together[i].x, alone.x, atol=1e-9)
        assert (together[i].reached, together[i].reason) == (alone.reached, alone.reason)


@pytest.mark.parametrize("free", [0.01, 0.03])
def test_a_finger_that_reaches_its_limits(free: float) -> None:
    """The thumb's joints move by little: the others wait for it, and the limit is named."""
    problem = ga.load_problem("allegro_sphere_3")
    at = grasp_of(problem).joint_positions
    grasp = grasp_of(with_limits(problem, {name: (at[name] - free, at[name] + free) for name in THUMB}))
    before = grasp.pregrasp()
    assert not before.reached
    assert "joint 'joint_1" in before.reason
    assert "limit" in before.reason
    assert "contact 0 ('link_15.0_tip')" in before.reason
    # No more than all of the thumb's joints together can do, nearly as much, and no contact ahead of the others.
    columns = grasp.J[:3, [grasp.joints.index(name) for name in THUMB]]
    most = free * np.abs(grasp.contact_normals[0] @ columns).sum()
    assert 0.9 * most < before.distances.min() < 1.05 * most
    assert np.ptp(before.distances) < 1e-4
    assert f"{before.distances.min() * 1e3:.1f} mm" in before.reason


@pytest.mark.parametrize(("name", "joint"), [("allegro_cylinder_3", "joint_14.0"), ("schunk_can", "thumb_mcp")])
def test_a_joint_at_its_limit_drives_no_finger_into_the_object(name: str, joint: str) -> None:
    """The least-norm step, cut off at the limits, takes a contact point into the object; bounded least squares not."""
    problem = ga.load_problem(name)
    grasp = grasp_of(problem)
    m = len(problem.contacts)
    normals = np.zeros((m, 3 * m))
    for i, normal in enumerate(grasp.contact_normals):
        normals[i, 3 * i : 3 * i + 3] = normal
    step = np.linalg.pinv(grasp.J) @ normals.T @ np.full(m, 0.01)
    k, at = grasp.joints.index(joint), grasp.joint_positions[joint]
    assert step[k] < 0.0  # the limit is in its way
    step[k] = 0.0
    assert (normals @ grasp.J @ step).min() < -0.01
    before = grasp_of(with_limits(problem, {joint: (at, at + 0.5)})).pregrasp()
    assert (before.path_distances[1:] > 0.0).all()
    assert before.joint_positions[joint] >= at
    assert before.distances.min() > 0.005
    assert before.reached or before.reason


def test_a_hand_that_cannot_open() -> None:
    problem = ga.load_problem("allegro_sphere_3")
    at = grasp_of(problem).joint_positions
    grasp = grasp_of(with_limits(problem, {name: (at[name] - 1e-12, at[name] + 1e-12) for name in THUMB}))
    for distance in (1e-5, 0.01):
        before = grasp.pregrasp(distance)
        assert not before.reached
        assert "gets 0.0 mm away" in before.reason
        np.testing.assert_allclose(before.x, grasp.x, atol=1e-11)


def test_fingers_that_would_collide() -> None:
    """Fingers that have to spread on the bottle hit each other first; nothing collides where they stop."""
    grasp = grasp_of(ga.load_problem("schunk_oil_bottle"))
    before = grasp.pregrasp(0.02)
    assert not before.reached
    assert "'middle_medial_0' and 'ring_medial_0' collide" in before.reason
    checker = CollisionChecker(grasp.problem, touch_depth=0.0)
    assert checker.free(before.x[None]).all()
    pair = checker.pairs.index(("middle_medial_0", "ring_medial_0"))
    assert checker.clearances(before.x[None])[0, pair] < 1e-3
    assert before.distances.min() > 0.005


def test_a_grasp_in_collision() -> None:
    grasp = grasp_of(ga.load_problem("allegro_sphere_3"))
    before = grasp.pregrasp(clearance=0.05)
    assert not before.reached
    assert "come nearer than 0.05 m at the grasp already" in before.reason
    np.testing.assert_array_equal(before.x, grasp.x)


def test_fingertips_that_sink_in_at_the_grasp() -> None:
    """Collision shapes of fingertips reach 1.5 mm into the object: a millimetre does not part them, three do."""
    problem = ga.load_problem("allegro_sphere_3")
    thick = replace(
        problem.hand, urdf=problem.hand.urdf.replace('<sphere radius="0.012" />', '<sphere radius="0.0135" />')
    )
    grasp = grasp_of(replace(problem, hand=thick))
    near, far = grasp.pregrasp(0.001), grasp.pregrasp(0.003)
    assert (near.reached, far.reached) == (False, True)
    assert "'object/sphere_0' collide at the grasp already" in near.reason
    np.testing.assert_array_equal(near.x, grasp.x)
    assert CollisionChecker(grasp.problem, touch_depth=0.0).free(far.x[None]).all()


def test_contacts_that_one_motor_moves_unequally() -> None:
    """One jaw goes at 0.7 of the other's speed: both are at least as far off as asked."""
    problem = ga.load_problem("gripper_skittle")
    left = grasp_of(problem).joint_positions["left_slide"]
    coupling = f'<mimic joint="left_slide" multiplier="0.7" offset="{0.3 * left}"/>'
    hand = replace(problem.hand, urdf=problem.hand.urdf.replace('<mimic joint="left_slide"/>', coupling))
    grasp = grasp_of(replace(problem, hand=hand, motions=None, defaults={}))
    before = grasp.pregrasp(0.005)
    assert before.reached
    assert before.distances.min() == pytest.approx(0.005, abs=1e-4)
    assert before.distances.max() == pytest.approx(0.005 / 0.7, abs=2e-4)
    np.testing.assert_allclose(distances_by_pinocchio(grasp, before.q), before.distances, atol=1e-9)


def test_continuous_joints() -> None:
    problem = symmetric_planar_problem(0.3)
    with pytest.raises(ga.GraspAtlasError, match="no collision shape"):
        grasp_of(problem).pregrasp()
    allegro = ga.load_problem("allegro_sphere_3")
    hand = replace(
        allegro.hand,
        urdf=allegro.hand.urdf.replace('name="joint_0.0" type="revolute"', 'name="joint_0.0" type="continuous"'),
    )
    assert hand.urdf != allegro.hand.urdf
    grasp = grasp_of(replace(allegro, hand=hand))
    before = grasp.pregrasp()
    assert len(before.q) == 13
    assert before.reached
    np.testing.assert_allclose(distances_by_pinocchio(grasp, before.q), 0.01, atol=1e-4)


@pytest.mark.parametrize("distance", [0.0, -0.01, np.nan, np.inf, 0.2, "far", None, True])
def test_distances_that_make_no_sense(distance: object) -> None:
    grasp = grasp_of(ga.load_problem("gripper_skittle"))
    with pytest.raises(ga.GraspAtlasError, match=r"distance of a pregrasp must be above 0 and at most 0\.1"):
        grasp.pregrasp(distance)  # type: ignore[arg-type]


def test_depths_that_make_no_sense() -> None:
    grasp = grasp_of(ga.load_problem("gripper_skittle"))
    with pytest.raises(ga.GraspAtlasError, match="touch_depth"):
        grasp.pregrasp(touch_depth=-0.001)
    with pytest.raises(ga.GraspAtlasError, match="clearance"):
        grasp.pregrasp(clearance=np.nan)


def test_a_pregrasp_says_what_it_is() -> None:
    grasp = grasp_of(ga.load_problem("gripper_skittle"))
    assert str(grasp.pregrasp()) == "<Pregrasp of 'gripper_skittle': 10 mm>"
    assert "limit" in str(grasp.pregrasp(0.05))


def test_it_takes_milliseconds() -> None:
    grasps = ga.Grasps(
        ga.load_problem("allegro_sphere_3"), np.repeat(grasp_of(ga.load_problem("allegro_sphere_3")).x[None], 64, 0)
    )
    grasps[0].pregrasp()
    began = time.process_time()
    grasps.pregrasps()
    assert time.process_time() - began < 64 * 0.02
