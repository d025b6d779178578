"""Squeeze: targets at which position actuators of a stiffness exert the contact forces."""

from __future__ import annotations

import numpy as np
import pytest

import graspatlas as ga


@pytest.fixture(scope="module")
def cups() -> ga.Grasps:
    """Grasps of a hand with joints that mimic others."""
    problem = ga.load_problem("three_finger_cup")
    return ga.Grasps(problem, ga.find_grasps(problem, count=8, seed=2))


def test_actuators_at_the_targets_exert_the_torques(cups):
    hand = cups.problem.hand
    stiffness = {name: 2.0 + i for i, name in enumerate(hand.mechanism.actuated)}
    forces, targets = cups.contact_forces(torsional=0.01), cups.squeeze(stiffness, torsional=0.01)
    assert tuple(targets) == hand.joints
    held = forces.margin > 0.0
    assert held.any()
    assert not held.all()
    for a, name in enumerate(forces.joints):
        torques = stiffness[name] * (targets[name] - cups.joint_positions[name])
        np.testing.assert_allclose(torques, forces.joint_torques[:, a], rtol=1e-9, atol=1e-12)
    assert hand.mechanism.mimics
    positions = np.array([targets[name][held] for name in hand.joints]).T
    np.testing.assert_allclose(hand.mechanism.residual(positions), 0.0, atol=1e-12)
    at = int(held.argmax())
    one = cups[at].squeeze(stiffness, torsional=0.01)
    assert one == {name: pytest.approx(values[at]) for name, values in targets.items()}


def test_the_fingers_press_into_the_object(cups):
    """With the object out of the way the fingertips go against its outward normals."""
    forces = cups.contact_forces(torsional=0.01)
    at = int(forces.margin.argmax())
    grasp, actuated = cups[at], cups.problem.hand.mechanism.actuated
    targets = grasp.squeeze(1e3, torsional=0.01)
    steps = np.array([targets[name] - grasp.joint_positions[name] for name in actuated])
    moved = (grasp.J @ steps).reshape(-1, 3)
    assert (moved * forces.forces[at]).sum() > 0.0
    assert (moved * grasp.contact_normals).sum() < 0.0


def test_a_wrong_stiffness(cups):
    actuated = cups.problem.hand.mechanism.actuated
    follower = cups.problem.hand.mechanism.mimics[0].joint
    for stiffness, message in (
        (0.0, "stiffness"),
        ({**dict.fromkeys(actuated, 1.0), follower: 1.0}, follower),
        (dict.fromkeys(actuated[1:], 1.0), actuated[0]),
        (dict.fromkeys(actuated, -1.0), actuated[0]),
    ):
        with pytest.raises(ga.GraspAtlasError, match=message):
            cups.squeeze(stiffness)
