"""The scene for MuJoCo has the hand where Pinocchio has it, the object where the grasp has it, and their shapes."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pinocchio as pin
import pytest
from numpy.testing import assert_allclose
from pinch import pinch

import graspatlas as ga
from graspatlas.collision.problem_shapes import collision_shapes
from graspatlas.simulation.protocols import PROTOCOLS
from graspatlas.simulation.scene import HAND, OBJECT, Scene

PROTOCOL = PROTOCOLS["dexgraspbench"]
NAMES = ("allegro_cylinder_3", "gripper_skittle", "planar_hand", "schunk_can", "three_finger_cup")


def placed(scene: Scene, problem: ga.Problem, positions: np.ndarray, T: np.ndarray) -> mujoco.MjData:
    data = mujoco.MjData(scene.model)
    data.qpos[:] = scene.configurations(positions[None], T[None])[0]
    mujoco.mj_kinematics(scene.model, data)
    return data


@pytest.mark.parametrize("name", NAMES)
def test_bodies_are_where_pinocchio_has_them(name: str) -> None:
    problem = ga.load_problem(name)
    scene, rng = Scene(problem, PROTOCOL), np.random.default_rng(1)
    model = pin.buildModelFromXML(problem.hand.tree)
    data = model.createData()
    limits = np.clip(list(problem.hand.limits_by_name.values()), -2.0, 2.0)
    for _ in range(3):
        positions = rng.uniform(*limits.T)
        q = pin.neutral(model)
        for joint, value in zip(problem.hand.joints, positions, strict=True):
            j = model.joints[model.getJointId(joint)]
            q[j.idx_q : j.idx_q + j.nq] = value if j.nq == 1 else (np.cos(value), np.sin(value))
        pin.forwardKinematics(model, data, q)
        seen = placed(scene, problem, positions, np.eye(4))
        for i in range(1, model.njoints):
            body = seen.body(HAND + model.names[i])
            assert_allclose(body.xpos, data.oMi[i].translation, atol=1e-10)
            assert_allclose(body.xmat.reshape(3, 3), data.oMi[i].rotation, atol=1e-9)


@pytest.mark.parametrize("name", NAMES)
def test_the_object_is_where_the_grasp_has_it(name: str) -> None:
    problem = ga.load_problem(name)
    scene, grasp = Scene(problem, PROTOCOL), ga.Grasps(problem, problem.x1_array)[0]
    data = placed(scene, problem, np.array(list(grasp.joint_positions.values())), grasp.T_palm_object)
    T = grasp.T_palm_object
    assert_allclose(data.body("object").xipos, T[:3, 3] + T[:3, :3] @ problem.object.center_of_mass, atol=1e-9)
    for shape in collision_shapes(problem).object:
        if shape.kind in ("sphere", "box", "cylinder", "capsule"):
            assert_allclose(data.geom(OBJECT + shape.name).xpos, (T @ shape.placement)[:3, 3], atol=1e-9)


@pytest.mark.parametrize("name", NAMES)
def test_corners_of_meshes_are_where_the_checker_has_them(name: str) -> None:
    problem = ga.load_problem(name)
    scene, grasp = Scene(problem, PROTOCOL), ga.Grasps(problem, problem.x1_array)[0]
    model = scene.model
    data = placed(scene, problem, np.array(list(grasp.joint_positions.values())), grasp.T_palm_object)
    for shape in collision_shapes(problem).object:
        if shape.kind != "convex":
            continue
        geom = model.geom(OBJECT + shape.name)
        first, count = model.mesh_vertadr[geom.dataid[0]], model.mesh_vertnum[geom.dataid[0]]
        seen = (
            model.mesh_vert[first : first + count] @ data.geom(geom.id).xmat.reshape(3, 3).T + data.geom(geom.id).xpos
        )
        T = grasp.T_palm_object @ shape.placement
        expected = shape.points @ T[:3, :3].T + T[:3, 3]
        gaps = np.linalg.norm(seen[:, None] - expected[None], axis=2)
        assert gaps.min(axis=1).max() < 1e-6
        assert gaps.min(axis=0).max() < 1e-6


def test_mass_and_friction_are_those_of_the_protocol() -> None:
    problem = ga.load_problem("schunk_can")
    model = Scene(problem, replace(PROTOCOL, mass=0.37, friction=0.21, torsional=0.004)).model
    assert_allclose(model.body("object").mass, 0.37)
    assert_allclose(model.geom_friction[:, :2], [[0.21, 0.004]] * model.ngeom)
    assert set(model.geom_condim) == {4}
    assert set(Scene(problem, replace(PROTOCOL, torsional=0.0)).model.geom_condim) == {3}


def test_joints_that_mimic_others_are_coupled_and_have_no_servo() -> None:
    problem = ga.load_problem("three_finger_cup")
    scene = Scene(problem, PROTOCOL)
    model, data = scene.model, mujoco.MjData(scene.model)
    assert model.neq == len(problem.hand.mechanism.mimics)
    assert model.nu == len(problem.hand.mechanism.actuated) + 3
    grasp = ga.Grasps(problem, problem.x1_array)[0]
    far = grasp.T_palm_object.copy()
    far[:3, 3] += 1.0
    data.qpos[:] = scene.configurations(np.array(list(grasp.joint_positions.values()))[None], far[None])[0]
    data.ctrl[: len(scene.servos)] = [grasp.joint_positions[name] + 0.1 for name in scene.servos]
    for _ in range(400):
        mujoco.mj_step(model, data)
    seen = {name: float(data.joint(name).qpos[0]) for name in problem.hand.joints}
    for mimic in problem.hand.mechanism.mimics:
        assert abs(seen[mimic.joint] - mimic.position(seen[mimic.driver])) < 2e-3
    assert_allclose(seen["left_proximal"], grasp.joint_positions["left_proximal"] + 0.1, atol=5e-3)


def test_pairs_that_may_touch_are_left_out_and_the_others_are_not() -> None:
    problem = ga.load_problem("allegro_box_3")
    model, shapes = Scene(problem, PROTOCOL).model, collision_shapes(problem)
    left_out = {tuple(sorted(divmod(int(s), 2**16))) for s in model.exclude_signature}
    named = {frozenset(pair) for pair in zip(model.pair_geom1.tolist(), model.pair_geom2.tolist(), strict=True)}
    number = {shape.name: model.geom(HAND + shape.name).id for shape in shapes.hand}
    for a, b in shapes.hand_pairs:
        first, second = number[shapes.hand[a].name], number[shapes.hand[b].name]
        bodies = tuple(sorted((int(model.geom_bodyid[first]), int(model.geom_bodyid[second]))))
        assert bodies not in left_out or frozenset((first, second)) in named
    assert left_out


def test_an_object_with_hollows_is_refused(tmp_path: Path) -> None:
    corners = [(0, 0), (3, 0), (3, 1), (1, 1), (1, 3), (0, 3)]  # an L
    vertices = [f"v {x / 100} {y / 100} {z}" for z in (0.0, 0.01) for x, y in corners]
    sides = [f"f {i + 1} {(i + 1) % 6 + 1} {(i + 1) % 6 + 7} {i + 7}" for i in range(6)]
    caps = ["f 4 3 2 1", "f 6 5 4 1", "f 7 8 9 10", "f 7 10 11 12"]
    (tmp_path / "l.obj").write_text("\n".join([*vertices, *sides, *caps]))
    shape = f'<collision><geometry><mesh filename="{tmp_path}/l.obj"/></geometry></collision>'
    hollow = ga.Body("l", f'<robot name="l"><link name="l">{shape}</link></robot>')
    with pytest.raises(ga.GraspAtlasError, match="'l_0' of the object is not convex"):
        _ = Scene(replace(pinch(), object=hollow), PROTOCOL).model


def test_without_mujoco_one_line_says_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(ga.GraspAtlasError, match=r"pip install 'graspatlas\[mujoco\]'"):
        _ = Scene(pinch(), PROTOCOL).model
