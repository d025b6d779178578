"""How the object moves: poses and numbers of x, and what follows for contacts and wrenches."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import graspatlas as ga
from graspatlas.problem.object_joint import FREE_FLYER, PLANAR, ObjectJoint, object_joint

TURN = 0.7


@pytest.mark.parametrize("joint", [FREE_FLYER, PLANAR], ids=lambda joint: joint.name)
def test_poses_and_numbers_are_inverses(joint: ObjectJoint) -> None:
    """A pose in the plane, which both joints allow, by quaternion, by rotation and by matrix."""
    xyz, rotation = np.array([0.1, -0.2, 0.0]), Rotation.from_rotvec([0.0, 0.0, TURN])
    pose = np.array(joint.from_quaternion(xyz, rotation.as_quat()))
    assert pose.shape == (joint.size,)
    d = joint.translations
    for other in (joint.nearest(xyz, rotation), joint.from_motion(rotation.as_matrix()[:d, :d], xyz[:d])):
        np.testing.assert_allclose(other, pose, atol=1e-12)
    again, quaternion = joint.to_quaternion(pose)
    np.testing.assert_allclose(again, xyz)
    np.testing.assert_allclose(quaternion, rotation.as_quat(), atol=1e-12)
    place, turned = joint.to_rotation(pose)
    np.testing.assert_allclose(place, xyz)
    assert (turned * rotation.inv()).magnitude() < 1e-12


def test_the_neutral_pose_is_that_of_the_palm() -> None:
    for joint in (FREE_FLYER, PLANAR):
        assert joint.to_quaternion(np.array(joint.neutral)) == ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))


def test_in_the_plane_only_what_lies_in_it_counts() -> None:
    assert FREE_FLYER.allows((0.0, 0.0, 0.1), (0.0, 0.0, 0.0, 1.0))
    assert not PLANAR.allows((0.0, 0.0, 0.1), (0.0, 0.0, 0.0, 1.0))
    assert not PLANAR.allows((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))
    tilted = Rotation.from_rotvec([0.0, 0.0, TURN]) * Rotation.from_rotvec([1e-3, 0.0, 0.0])
    np.testing.assert_allclose(
        PLANAR.nearest(np.array([0.1, 0.2, 0.3]), tilted), [0.1, 0.2, np.cos(TURN), np.sin(TURN)], atol=1e-6
    )


@pytest.mark.parametrize("name", ["planar_hand", "schunk_can"])
def test_a_problem_agrees_with_its_joint(name: str) -> None:
    """Sizes of x, of velocities, of wrenches and of the equations are those that the joint states."""
    problem = ga.load_problem(name)
    joint, system = problem.object_joint_model, problem.full_system
    assert joint is object_joint(problem.object_joint)
    nq = problem.hand.model.hand_q_size
    assert system.configuration_size == nq + joint.size + len(problem.parameter_names)
    assert system.object_dof == joint.dof
    assert system.n_equations == joint.contact_equations * len(problem.contacts)
    assert ga.Grasps(problem, problem.x1_array).G.shape[1] == joint.dof
    assert joint.translations == (2 if joint.planar else 3)


def test_names_of_parameters_are_in_the_order_of_x() -> None:
    """A frozen parameter has no name; the free ones end x, those of the hand's side first."""
    problem = ga.load_problem("planar_hand")
    assert problem.parameter_names == ("contact0_object_u", "contact1_object_u", "contact2_object_u")
    hand, body = problem.contacts[0].sides
    assert (hand.name, hand.patch, hand.free) == ("hand", problem.contacts[0].hand, ())
    assert (body.name, body.patch, body.free) == ("object", problem.contacts[0].object, ("u",))
    u = float(problem.x1_array[-3])
    held = replace(problem.contacts[0], frozen={**problem.contacts[0].frozen, "u": u})
    assert held.sides[1].free == ()
    assert held.sides[1].locate(np.zeros(3))[0] == u
    fewer = replace(problem, contacts=(held, *problem.contacts[1:]), x1=None)
    assert fewer.parameter_names == ("contact1_object_u", "contact2_object_u")


def test_unknown_joints_are_named() -> None:
    with pytest.raises(ga.GraspAtlasError, match="planar"):
        object_joint("plane")
