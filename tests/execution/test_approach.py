"""Trajectories into grasps: together, in time, within the speeds of the joints."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import graspatlas as ga
from graspatlas.hand.urdf import velocity_limits

NAMES = ("allegro_sphere_3", "schunk_can", "gripper_skittle", "three_finger_cup", "planar_hand")


def grasp_of(problem: ga.Problem) -> ga.Grasp:
    """The first grasp."""
    return ga.Grasps(problem, problem.x1_array)[0]


@pytest.mark.parametrize("name", NAMES)
def test_contacts_arrive_together(name: str) -> None:
    grasp = grasp_of(ga.load_problem(name))
    way = grasp.approach(0.01, 0.4)
    assert way.seconds == pytest.approx(0.4)
    assert (way.slowed_by, way.squeeze_seconds, way.arrival) == ((), 0.0, len(way.times) - 1)
    assert way.joints == grasp.joints
    assert (np.diff(way.times) > 0.0).all()
    np.testing.assert_array_equal(way.positions[-1], [grasp.joint_positions[name] for name in grasp.joints])
    np.testing.assert_array_equal(way.positions[0], [way.pregrasp.joint_positions[name] for name in grasp.joints])
    assert (np.diff(way.distances, axis=0) < 0.0).all()
    assert way.spread == np.ptp(way.distances, axis=1).max() < 2e-5
    # Least jerk: at half the time half the way is left, and at the ends the joints rest.
    share = 1.0 - way.distances.mean(axis=1) / way.distances[0].mean()
    t = way.times / way.times[-1]
    np.testing.assert_allclose(share, t**3 * (10.0 - 15.0 * t + 6.0 * t**2), atol=5e-3)
    # The object is not moved, and the joints keep their couplings.
    X = np.tile(grasp.x, (len(way.times), 1))
    for joint, column in zip(grasp.problem.hand.model.hand_joints, way.positions.T, strict=True):
        turns = joint.q_size == 2
        X[:, joint.q_index : joint.q_index + joint.q_size] = np.array(
            [np.cos(column), np.sin(column)] if turns else [column]
        ).T
    np.testing.assert_allclose(grasp.problem.mimic_residual(X), 0.0, atol=1e-12)
    points = grasp.problem.full_system.grasp_arrays(X)["hand_points"]
    off = np.einsum("nmi,mi->nm", points - points[-1], grasp.contact_normals)
    np.testing.assert_allclose(off, way.distances, atol=1e-9)


def test_joints_are_no_faster_than_their_urdf_allows() -> None:
    problem = ga.load_problem("allegro_sphere_3")
    slow = replace(problem.hand, urdf=re.sub('velocity="[^"]*"', 'velocity="0.1"', problem.hand.urdf))
    way = grasp_of(replace(problem, hand=slow)).approach(0.01, 0.4, time_step=0.002)
    assert way.seconds > 1.0
    assert way.slowed_by
    assert set(way.slowed_by) <= set(way.joints)
    assert "slowed by" in repr(way)
    speeds = np.abs(np.diff(way.positions, axis=0)) / np.diff(way.times)[:, None]
    assert 0.098 < speeds.max() <= 0.1 * (1.0 + 1e-6)
    quick = grasp_of(problem).approach(0.01, 0.001)
    limits = velocity_limits(problem.hand.urdf)
    speeds = np.abs(np.diff(quick.positions, axis=0)) / np.diff(quick.times)[:, None]
    assert (speeds.max(axis=0) <= [limits[name] for name in quick.joints]).all()
    assert quick.seconds > 0.001


def test_squeeze() -> None:
    grasp = grasp_of(ga.load_problem("three_finger_cup"))
    target = grasp.joint_positions["thumb_proximal"] + 0.1
    way = grasp.approach(squeeze={"thumb_proximal": target}, squeeze_seconds=0.2, time_step=0.01)
    assert way.squeeze_seconds == pytest.approx(0.2)
    assert way.times[-1] == pytest.approx(0.6)
    assert len(way.times) == way.arrival + 1 + 20
    at = dict(zip(way.joints, way.positions[way.arrival], strict=True))
    assert at == dict(grasp.joint_positions)
    end = dict(zip(way.joints, way.positions[-1], strict=True))
    assert end["thumb_proximal"] == target
    assert end["thumb_distal"] == pytest.approx(0.6 * target + 1.2)  # it mimics
    assert end["left_proximal"] == grasp.joint_positions["left_proximal"]
    same = grasp.approach(squeeze=way.positions[-1], squeeze_seconds=0.2)
    np.testing.assert_allclose(same.positions, way.positions, atol=1e-12)


def test_from_as_far_as_can_be() -> None:
    problem = ga.load_problem("allegro_sphere_3")
    at = grasp_of(problem).joint_positions
    for free in (0.03, 1e-12):
        limits = {name: (at[name] - free, at[name] + free) for name in at if name.startswith("joint_1")}
        grasp = grasp_of(replace(problem, hand=replace(problem.hand, limits=limits)))
        way = grasp.approach(0.03, squeeze={"joint_14.0": at["joint_14.0"] + 0.1})
        assert not way.pregrasp.reached
        np.testing.assert_allclose(way.positions[way.arrival], list(grasp.joint_positions.values()), atol=1e-11)
        assert (way.arrival == 0) == (free < 1e-6)
        assert way.times[-1] == pytest.approx(0.4 * (2 - (way.arrival == 0)))


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"seconds": 0.0}, "seconds must be a positive number"),
        ({"seconds": np.nan}, "seconds must be a positive number"),
        ({"time_step": -1.0}, "time_step must be a positive number"),
        ({"squeeze_seconds": "long"}, "squeeze_seconds must be a positive number"),
        ({"distance": -1.0}, "distance of a pregrasp"),
        ({"squeeze": {"left_slid": 0.0}}, "did you mean 'left_slide'"),
        ({"squeeze": {"left_slide": np.nan}}, "squeeze of joint 'left_slide' must be finite"),
        ({"squeeze": {"left_slide": "in"}}, "squeeze of joint 'left_slide' must be a number"),
        ({"squeeze": [0.01]}, "states 2 joint positions"),
        ({"squeeze": "hard"}, "squeeze must be an array of numbers"),
        ({"squeeze": [0.01, 0.02]}, "it mimics"),
        ({"seconds": 1e9}, "at most 1000000 points; give a longer time_step"),
    ],
)
def test_wrong_input(wrong: dict[str, Any], message: str) -> None:
    grasp = grasp_of(ga.load_problem("gripper_skittle"))
    with pytest.raises(ga.GraspAtlasError, match=message):
        grasp.approach(**wrong)
