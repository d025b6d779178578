"""Hands with locked joints, joints that move, and limits that are enlarged."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from helpers import chain, robot
from problem_texts import CAN, read

import graspatlas as ga
from graspatlas import _core
from graspatlas.hand.robot_files import example_robot

FINGER = robot(
    chain("f", (0.02, 0.0, 0.1), ["0 0 1", "0 1 0", "0.3 1 0.2"], 0.05, ["revolute", "continuous", "prismatic"])
)


def test_locked_joints_are_where_they_would_be():
    """The locked hand against Pinocchio's own reduced model."""
    locked = {"f0": 0.7, "f2": -0.03}
    hand = ga.Hand("h", FINGER).with_joints(None, locked)
    assert hand.joints == ("f1",)
    full = pin.buildModelFromXML(FINGER)
    q = pin.neutral(full)
    q[0], q[3] = locked["f0"], locked["f2"]
    reduced = pin.buildReducedModel(full, [full.getJointId(name) for name in locked], q)
    turn = np.array([np.cos(0.4), np.sin(0.4)])
    data = reduced.createData()
    pin.framesForwardKinematics(reduced, data, turn)
    places = hand.link_placements(turn)
    for name in ("f_0", "f_1", "f_2", "f_tip"):
        np.testing.assert_allclose(places[name], data.oMf[reduced.getFrameId(name)].homogeneous, atol=1e-14)


@pytest.mark.parametrize("kinds", [["revolute", "continuous", "prismatic"], ["continuous", "floating", "revolute"]])
@pytest.mark.parametrize("thing", ["free_flyer", "planar", "none"])
def test_placements_are_pinocchio_s(kinds: list[str], thing: str) -> None:
    """Of joints that turn or slide, which the core places itself, and of others, which it leaves to Pinocchio."""
    text = robot(
        chain("f", (0.02, 0.0, 0.1), ["0 0 1", "0 1 0", "0.3 1 0.2"], 0.05, kinds),
        chain("g", (0.0, 0.03, 0.1), ["1 0 0", "0 -1 0"], 0.04, ["prismatic", "revolute"]),
    )
    ours, model = _core.Model(text, thing), pin.buildModelFromXML(text)
    data = model.createData()
    rng = np.random.default_rng(3)
    for _ in range(20):
        q = pin.integrate(model, pin.neutral(model), rng.uniform(-2.0, 2.0, model.nv))
        pin.framesForwardKinematics(model, data, q)
        places = ours.frame_placements(np.concatenate([q, ours.neutral[model.nq :]]))
        for name, place in places.items():
            np.testing.assert_allclose(place, data.oMf[model.getFrameId(name)].homogeneous, rtol=0, atol=1e-14)


def test_joints_that_move_and_the_rest_locked():
    hand = ga.Hand.from_urdf("schunk_sah/schunk_sah.urdf", limits={"thumb_pip": (0.0, 1.0), "index_pip": (0.0, 1.0)})
    less = hand.with_joints(["index_pip", "index_mcp"], {"thumb_pip": 0.5})
    assert set(less.joints) == {"index_pip", "index_mcp"}
    assert less.limits == {"index_pip": (0.0, 1.0)}
    assert hand.with_joints() is hand
    with pytest.raises(ga.GraspAtlasError, match="'index_pip' is among the joints that move and among the locked"):
        hand.with_joints(["index_pip"], {"index_pip": 0.0})
    with pytest.raises(ga.GraspAtlasError, match=r"'joint_12.0' is locked at 0, outside its limits \[0.263, 1.396\]"):
        ga.Hand.from_urdf(example_robot("allegro_right_hand")).with_joints(["joint_0.0"])


def test_enlarged_limits():
    text = CAN.replace("  srdf: schunk", "  limits: {index_pip: [0, 1]}\n  enlarge_limits: 0.1\n  srdf: schunk")
    hand, before = read(text).hand, ga.load_problem("schunk_can").hand
    at = hand.joints.index("index_pip")
    lower, upper = (new - old for new, old in zip(hand.joint_limits, before.joint_limits, strict=True))
    np.testing.assert_allclose(np.delete(lower, at), -0.1, atol=1e-12)
    np.testing.assert_allclose(np.delete(upper, at), 0.1, atol=1e-12)
    assert (hand.joint_limits[0][at], hand.joint_limits[1][at]) == (0.0, 1.0)
