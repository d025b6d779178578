"""Arms: where things are, plain data, and what is said of wrong ones."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

import graspatlas as ga
from graspatlas.hand.named_hands import named_hand

UR5 = "example_robot_data:ur5_robot"


def joint(name: str, parent: str, child: str, kind: str, more: str = "") -> str:
    """A joint along z, 10 cm above the last."""
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/><origin xyz="0 0 0.1"/>'
        f'<axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="1" velocity="1"/>{more}</joint>'
    )


def made(*joints: str, links: str = "abcd") -> ga.Hand:
    """A robot of these joints."""
    return ga.Hand(
        "made", "<robot name='m'>" + "".join(f"<link name='{c}'/>" for c in links) + "".join(joints) + "</robot>"
    )


TWO = made(joint("ab", "a", "b", "revolute"), joint("bc", "b", "c", "prismatic"), links="abc")


def test_poses_are_those_of_pinocchio() -> None:
    poses = {
        "palm": ga.Pose([0.1, 0.2, 0.3], [0.1, 0.2, 0.3, 0.9]),
        "base": ga.Pose([-0.4, 0.1, 0.2], [0.5, -0.2, 0.1, 0.7]),
        "object": ga.Pose([0.3, 0.3, 0.1], [0.0, 0.4, -0.1, 0.2]),
    }
    arm = ga.Arm(TWO, "c", **poses)
    se3 = {name: pin.XYZQUATToSE3(np.r_[pose.xyz, pose.quat_xyzw]) for name, pose in poses.items()}
    np.testing.assert_allclose(arm.T_flange_palm, se3["palm"].homogeneous, atol=1e-15)
    np.testing.assert_allclose(arm.T_base_object, se3["base"].actInv(se3["object"]).homogeneous, atol=1e-15)


def test_joints_that_move_no_flange_are_locked() -> None:
    """A fork: the flange is on the one branch."""
    fork = made(joint("ab", "a", "b", "revolute"), joint("bc", "b", "c", "revolute"), joint("bd", "b", "d", "revolute"))
    arm = ga.Arm(fork, "c")
    assert arm.joints == arm.robot.joints == ("ab", "bc")
    elsewhere = ga.Arm(fork.with_joints(locked={"bd": 0.5}), "c")
    d = pin.buildModelFromXML(elsewhere.robot.urdf).frames[-1]
    assert d.name == "d"
    assert np.linalg.norm(pin.log3(d.placement.rotation)) == pytest.approx(0.5)
    bent = fork.urdf.replace('lower="-1"', 'lower="0.2"')
    assert ga.Arm(ga.Hand("made", bent), "c").robot.joints == ("ab", "bc")
    assert repr(arm) == "<Arm 'made': 2 joints, flange 'c'>"


def test_a_name_is_enough() -> None:
    arm = ga.Arm.named("ur5_robot", "tool0", base=ga.Pose([0, 0, 1]))
    assert arm.name == "ur5_robot"
    assert len(arm.joints) == 6
    assert ga.Arm.from_dict(arm.to_dict()) == arm
    assert ga.Arm.from_dict({**arm.to_dict(), "object": {"xyz": [1, 0, 0]}}) == replace(arm, object=ga.Pose([1, 0, 0]))


MIMIC = '<mimic joint="ab" multiplier="2"/>'
WRONG: list[tuple[Any, str]] = [
    (lambda: ga.Arm.named(UR5, "tool"), "flange 'tool' is not a link of arm 'ur5_robot'; did you mean 'tool0'?"),
    (lambda: ga.Arm.named(UR5, 3), "flange '3' is not a link of arm 'ur5_robot'"),  # type: ignore[arg-type]
    (lambda: ga.Arm.named(UR5, "base"), "no joint moves the flange 'base' of arm 'ur5_robot'; name the link that"),
    (
        lambda: ga.Arm.named("ur5_robo", "tool0"),
        "'ur5_robo' is not a file, nor among the hands .* did you mean 'ur5_robot'",
    ),
    (lambda: ga.Arm.named("nowhere/ur5.urdf", "tool0"), "file 'nowhere/ur5.urdf' does not exist; give a URDF"),
    (lambda: ga.Arm.named(5, "tool0"), "an arm is named by a path or a name such as 'ur5_robot', got 5"),  # type: ignore[arg-type]
    (lambda: ga.Arm("ur5", "tool0"), "robot of an arm must be a Hand, got 'ur5'; see Arm.named"),  # type: ignore[arg-type]
    (lambda: ga.Arm(TWO, "c", palm=[0, 0, 1]), r"palm of arm 'made' must be a Pose, got \[0, 0, 1\]"),  # type: ignore[arg-type]
    (lambda: ga.Arm(TWO, "c", base=ga.Pose([0, 0])), r"xyz of a pose must be 3 finite numbers \[m\], got \[0, 0\]"),
    (
        lambda: ga.Arm(
            made(joint("ab", "a", "b", "revolute"), joint("bc", "b", "c", "revolute", MIMIC), links="abc"), "c"
        ),
        "joint 'bc' of arm 'made' moves the flange and mimics another; that is not supported: lock both",
    ),
    (
        lambda: ga.Arm(
            made(joint("ab", "a", "b", "revolute"), joint("ac", "a", "c", "revolute", MIMIC), links="abc"), "b"
        ),
        "joint 'ac' of arm 'made' mimics 'ab', which moves the flange; that is not supported: make it fixed",
    ),
    (lambda: ga.Arm.from_dict({"urdf": "ur5.urdf"}), "an arm has no 'flange'"),
    (
        lambda: ga.Arm.from_dict({**ga.Arm(TWO, "c").to_dict(), "palm": {"xzy": [0]}}),
        "key 'xzy' is not one of palm of the arm's",
    ),
    (
        lambda: ga.Arm.from_dict({**ga.Arm(TWO, "c").to_dict(), "limits": {"ac": [0, 1]}}),
        "joint 'ac' is not in hand 'made'",
    ),
]


@pytest.mark.parametrize(("make", "message"), WRONG, ids=[message[:40] for _, message in WRONG])
def test_wrong_arms(make: Any, message: str) -> None:
    with pytest.raises(ga.GraspAtlasError, match=message):
        make()


def test_a_problem_takes_nothing_else(can: ga.Problem) -> None:
    with pytest.raises(ga.GraspAtlasError, match=r"arm must be a Arm or NoneType, got 'ur5_robot'; see Arm.named"):
        replace(can, arm="ur5_robot")
    with pytest.raises(
        ga.GraspAtlasError, match="asks what an arm can bring about, but problem 'schunk_can' has no arm"
    ):
        replace(can, requirements=(ga.Reachable(),))


def test_arms_may_be_given_as_hands_are() -> None:
    hand = named_hand(UR5).hand
    assert ga.Arm(hand, "tool0") == ga.Arm.named(UR5, "tool0")
