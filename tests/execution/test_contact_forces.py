"""Contact forces balance and keep to their cones, and joint torques do the work that the fingertips do."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import graspatlas as ga
from graspatlas import quality
from graspatlas.execution.contact_forces import NORMAL_FORCE

FRICTION = 0.6


def grasps_of(name: str, count: int = 24) -> ga.Grasps:
    problem = ga.load_problem(name)
    return ga.Grasps(problem, ga.find_grasps(problem, count=count, seed=2))


def wrenches_of(grasps: ga.Grasps, forces: ga.ContactForces) -> np.ndarray:
    """Wrench of the contacts on the object, at its origin in the palm's axes (n, dof)."""
    wrenches = np.einsum("nij,nj->ni", grasps.G, forces.forces.reshape(len(grasps), -1))
    if wrenches.shape[1] == 6:
        wrenches[:, 3:] -= np.einsum("nm,nmc->nc", forces.torques, grasps.contact_normals)
    return wrenches


@pytest.mark.parametrize(
    ("name", "torsional"), [("allegro_box_4", 0.0), ("three_finger_cup", 0.01), ("planar_hand", 0.0)]
)
def test_forces_balance_in_their_cones_with_the_margin_of_force_closure(name, torsional):
    grasps = grasps_of(name)
    forces = grasps.contact_forces(normal_force=7.0, friction=FRICTION, torsional=torsional)
    margins = quality.force_closure_margin(grasps, FRICTION, torsional)
    np.testing.assert_array_equal(forces.margin, margins)
    held = margins > 0.0
    assert held.sum() > 2
    assert np.isnan(forces.forces[~held]).all()
    assert np.isnan(forces.joint_torques[~held]).all()
    assert np.abs(wrenches_of(grasps, forces)[held]).max() < 1e-12
    f, n, turning = forces.forces[held], -grasps.contact_normals[held], forces.torques[held]
    along = np.einsum("nmc,nmc->nm", f, n)
    np.testing.assert_allclose(along, forces.normal_forces[held], rtol=1e-12)
    np.testing.assert_allclose(along.sum(axis=1), 7.0, rtol=1e-12)
    tangential = np.linalg.norm(f - along[..., None] * n, axis=2)
    side = np.hypot(tangential, FRICTION / torsional * turning) if torsional else tangential
    distances = (FRICTION * along - side) / np.sqrt(1.0 + FRICTION**2)
    np.testing.assert_allclose(distances.min(axis=1), 7.0 * margins[held], atol=1e-8)
    assert (np.abs(turning).max() > 0.0) == (torsional > 0.0)


@pytest.mark.parametrize(
    ("name", "torsional"), [("allegro_sphere_3", 0.0), ("three_finger_cup", 0.01), ("gripper_skittle", 0.005)]
)
def test_joint_torques_do_the_work_of_the_fingertips(name, torsional):
    """Virtual work by finite differences, along each actuated joint and those that mimic it."""
    grasps, step = grasps_of(name), 1e-6
    forces = grasps.contact_forces(friction=FRICTION, torsional=torsional)
    at = int(forces.margin.argmax())
    one, hand = forces[at], grasps.problem.hand
    for a, joint in enumerate(one.joints):
        column = hand.mechanism.transmission[:, a]
        moved = np.repeat(grasps.x[at][None], 2, axis=0)
        moved[:, : len(column)] += step * np.outer([1.0, -1.0], column)
        points = grasps.system.grasp_arrays(moved)["hand_points"]
        work = (one.forces * (points[0] - points[1])).sum()
        places = [hand.link_placements(x[: len(column)]) for x in moved]
        for i, frame in enumerate(grasps.contact_frames):
            turn = Rotation.from_matrix(places[0][frame][:3, :3] @ places[1][frame][:3, :3].T).as_rotvec()
            work -= one.torques[i] * turn @ grasps.contact_normals[at, i]
        assert one.joint_torques[a] == pytest.approx(work / (2.0 * step), abs=1e-8), joint


@pytest.mark.parametrize("name", ["allegro_box_4", "planar_hand"])
def test_forces_that_balance_a_load_at_the_centre_of_mass(name):
    problem = grasps_of(name, 1).problem
    inertial = '<inertial><origin xyz="0.01 -0.02 0"/><mass value="0.3"/></inertial></link>'
    heavy = replace(problem, object=replace(problem.object, urdf=problem.object.urdf.replace("</link>", inertial, 1)))
    np.testing.assert_array_equal(heavy.object.center_of_mass, [0.01, -0.02, 0.0])
    grasps = ga.Grasps(heavy, grasps_of(name).x)
    planar = heavy.object_joint_model.planar
    load = np.array([0.5, -0.7, 0.02]) if planar else np.array([0.5, -0.7, 0.3, 0.01, 0.02, -0.01])
    forces = grasps.contact_forces(normal_force=30.0, friction=FRICTION, load=load)
    held = forces.margin > 0.0
    assert held.sum() > 2
    in_object = (np.r_[load[:2], 0.0], np.r_[0.0, 0.0, load[2]]) if planar else (load[:3], load[3:])
    for T, wrench in zip(grasps.T_palm_object[held], wrenches_of(grasps, forces)[held], strict=True):
        force, torque = (T[:3, :3] @ v for v in in_object)
        torque = torque + np.cross(T[:3, :3] @ [0.01, -0.02, 0.0], force)
        expected = np.r_[force[:2], torque[2]] if planar else np.r_[force, torque]
        np.testing.assert_allclose(wrench, -expected, atol=1e-12)
    along = -np.einsum("nmc,nmc->nm", forces.forces, grasps.contact_normals)[held]
    np.testing.assert_allclose(along.sum(axis=1), 30.0, rtol=1e-12)
    each = grasps.contact_forces(normal_force=30.0, friction=FRICTION, load=np.tile(load, (len(grasps), 1)))
    np.testing.assert_array_equal(each.forces, forces.forces)


def test_a_force_alone_is_a_load_without_torque():
    grasps = grasps_of("allegro_box_4", 4)
    force, wrench = (grasps.contact_forces(load=load) for load in ([0.0, 0.0, 1.0], [0.0, 0.0, 1.0, 0.0, 0.0, 0.0]))
    np.testing.assert_array_equal(force.forces, wrench.forces)
    for wrong in ([1.0, 2.0], [[1.0, 2.0, 3.0]], [1.0, 2.0, np.nan], "up"):
        with pytest.raises(ga.GraspAtlasError, match="load"):
            grasps.contact_forces(load=wrong)


def test_efforts_limit_the_total():
    grasps = grasps_of("allegro_box_4", 4)
    strong = grasps.contact_forces(normal_force=5000.0)
    assert (strong.effort_share > 1.0).all()
    assert strong.effort_share == pytest.approx((np.abs(strong.joint_torques) / strong.efforts).max(axis=1))
    within = grasps.contact_forces(normal_force=5000.0, within_efforts=True)
    np.testing.assert_allclose(within.effort_share, 1.0, rtol=1e-12)
    np.testing.assert_allclose(within.normal_forces.sum(axis=1), within.total_normal_force, rtol=1e-12)
    np.testing.assert_allclose(within.total_normal_force, 5000.0 / strong.effort_share, rtol=1e-12)
    weak = grasps.contact_forces(normal_force=1.0, within_efforts=True)
    np.testing.assert_array_equal(weak.total_normal_force, 1.0)
    assert weak[0].effort_share == pytest.approx(weak.effort_share[0])
    with pytest.raises(ga.GraspAtlasError, match="load"):
        grasps.contact_forces(load=[0.0, 0.0, 1.0], within_efforts=True)


def test_a_hand_that_states_no_efforts():
    grasps = grasps_of("planar_hand", 2)
    forces = grasps.contact_forces()
    assert grasps.problem.hand.efforts_by_name == {}
    assert np.isnan(forces.effort_share).all()
    assert np.isnan(forces.efforts).all()
    with pytest.raises(ga.GraspAtlasError, match="effort"):
        grasps.contact_forces(within_efforts=True)


def test_one_grasp_and_its_place_in_a_batch():
    grasps = grasps_of("allegro_box_4", 3)
    batch, one = grasps.contact_forces(), grasps[1].contact_forces()
    np.testing.assert_array_equal(one.forces, batch.forces[1])
    assert one.total_normal_force == NORMAL_FORCE * 4
    assert one.effort_share == batch.effort_share[1]
    assert len(ga.Grasps(grasps.problem, grasps.x[:0]).contact_forces().margin) == 0


def test_a_grasp_that_cannot_hold_says_so():
    two_hard_fingers = grasps_of("gripper_skittle", 1)[0]
    with pytest.raises(ga.GraspAtlasError, match=r"no force closure.*margin.*torsional"):
        two_hard_fingers.contact_forces()
    closed = grasps_of("allegro_box_4", 1)[0]
    with pytest.raises(ga.GraspAtlasError, match=r"balance this load.*raise normal_force"):
        closed.contact_forces(load=[0.0, 0.0, 500.0])
    for name in ("normal_force", "friction"):
        with pytest.raises(ga.GraspAtlasError, match=name):
            closed.contact_forces(**{name: -1.0})
    with pytest.raises(TypeError, match="frictoin"):
        closed.contact_forces(frictoin=1.0)
