"""Grasps handed over to other programs, read back by the formats' own readers, or as their descriptions say."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import mujoco
import numpy as np
import pytest
import yaml
from numpy.testing import assert_allclose

import graspatlas as ga
from graspatlas.formats.export import FORMATS
from graspatlas.simulation.protocols import PROTOCOLS
from graspatlas.simulation.scene import Scene

Cli = Callable[..., tuple[int, str, str]]


@pytest.fixture(scope="module")
def result() -> ga.Result:
    return ga.optimize(ga.load_problem("three_finger_cup"), max_charts=300)


def targets(result: ga.Result, chart: int) -> dict[str, float]:
    return result.grasp(chart).squeeze(5.0, friction=0.5)


def test_isaac_grasp(result: ga.Result, tmp_path: Path) -> None:
    assert ga.export_grasps(result, tmp_path / "a.yaml", "isaac_grasp", best=2) == 2
    table = yaml.safe_load((tmp_path / "a.yaml").read_text())
    assert (table["format"], table["format_version"]) == ("isaac_grasp", 1.0)
    name = f"chart_{result.best.chart}"
    assert next(iter(table["grasps"])) == name
    grasp = table["grasps"][name]
    assert grasp["confidence"] == 1.0
    assert_allclose(grasp["position"], result.best.palm_xyz)
    assert_allclose([*grasp["orientation"]["xyz"], grasp["orientation"]["w"]], result.best.palm_quat_xyzw)
    assert grasp["cspace_position"] == pytest.approx(dict(result.best.joint_positions))
    assert grasp["pregrasp_cspace_position"] == pytest.approx(
        dict(result.best.pregrasp(0.01).joint_positions), abs=1e-9
    )
    assert grasp["squeeze_cspace_position"] == pytest.approx(targets(result, result.best.chart))


def test_dexgraspbench(result: ga.Result, tmp_path: Path) -> None:
    ga.export_grasps(result, tmp_path / "folder", "dexgraspbench", charts=[result.best.chart])
    (file,) = (tmp_path / "folder").iterdir()
    table = np.load(file, allow_pickle=True).item()
    best, size = result.best, 7 + len(result.best.joints)
    assert [table[f"{kind}_qpos"].shape for kind in ("pregrasp", "grasp", "squeeze")] == [(size,)] * 3
    assert_allclose(table["obj_pose"], [0, 0, 0, 1, 0, 0, 0])
    assert_allclose(table["grasp_qpos"][:3], best.palm_xyz)
    assert_allclose(table["grasp_qpos"][3:7], best.palm_quat_xyzw[[3, 0, 1, 2]])
    assert_allclose(table["grasp_qpos"][7:], list(best.joint_positions.values()))
    assert_allclose(table["squeeze_qpos"][7:], list(targets(result, best.chart).values()))


def test_moveit(result: ga.Result, tmp_path: Path) -> None:
    ga.export_grasps(result, tmp_path / "m.yaml", "moveit")
    (message,) = yaml.safe_load((tmp_path / "m.yaml").read_text())
    fields = "id pre_grasp_posture grasp_posture grasp_pose grasp_quality pre_grasp_approach post_grasp_retreat "
    assert set(message) == set((fields + "post_place_retreat max_contact_force allowed_touch_objects").split())
    first, last = message["grasp_posture"]["points"]
    assert_allclose(first["positions"], list(result.best.joint_positions.values()))
    assert_allclose(last["positions"], list(targets(result, result.best.chart).values()))
    forces = result.best.contact_forces(friction=0.5)
    efforts = dict(zip(message["grasp_posture"]["joint_names"], last["effort"], strict=True))
    assert {name: efforts[name] for name in forces.joints} == pytest.approx(
        dict(zip(forces.joints, forces.joint_torques.tolist(), strict=True))
    )
    assert [point["time_from_start"]["nanosec"] for point in (first, last)] == [400_000_000, 800_000_000]


def test_mjcf_holds_in_mujoco(result: ga.Result, tmp_path: Path) -> None:
    ga.export_grasps(result, tmp_path / "scene.xml", "mjcf", best=2)
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "scene.xml"))
    data = mujoco.MjData(model)
    name = f"chart_{result.best.chart}"
    mujoco.mj_resetDataKeyframe(model, data, model.key(f"squeeze_{name}").id)
    mujoco.mj_forward(model, data)
    T = result.best.T_palm_object
    center = T[:3, 3] + T[:3, :3] @ result.problem.object.center_of_mass
    assert_allclose(data.body("object").xipos, center, atol=1e-9)
    for _ in range(500):
        mujoco.mj_step(model, data)
    assert np.linalg.norm(data.body("object").xipos - center) < 2e-3
    forces = [np.zeros(6) for _ in range(data.ncon)]
    for i, force in enumerate(forces):
        mujoco.mj_contactForce(model, data, i, force)
    assert_allclose(sum(force[0] for force in forces), 15.0, rtol=0.1)


def test_the_mjcf_is_the_scene_of_the_trials(result: ga.Result, tmp_path: Path) -> None:
    ga.export_grasps(result, tmp_path / "scene.xml", "mjcf")
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "scene.xml"))
    own = Scene(result.problem, PROTOCOLS["dexgraspbench"]).model
    assert model.ngeom == own.ngeom
    assert_allclose(model.geom_size, own.geom_size)
    assert_allclose(model.body_mass, own.body_mass)


def test_the_refined_best_comes_first(tmp_path: Path) -> None:
    result = ga.optimize(ga.load_problem("gripper_skittle"), max_charts=300, refine=True)
    ga.export_grasps(result, tmp_path / "a.yaml", "isaac_grasp", refined=True, torsional=0.003)
    assert next(iter(yaml.safe_load((tmp_path / "a.yaml").read_text())["grasps"])) == "refined"


def test_wrong_input_is_named(result: ga.Result, tmp_path: Path) -> None:
    with pytest.raises(ga.GraspAtlasError, match="isaac_grasp"):
        ga.export_grasps(result, tmp_path / "x", "isaac")
    with pytest.raises(ga.GraspAtlasError, match=r"1 of 1 grasps, such as .* no force closure with friction 0\.01"):
        ga.export_grasps(result, tmp_path / "x", "mjcf", friction=0.01)
    with pytest.raises(ga.GraspAtlasError, match="stiffness"):
        ga.export_grasps(result, tmp_path / "x", "mjcf", stiffness=0.0)
    assert not (tmp_path / "x").exists()


@pytest.mark.parametrize("name", FORMATS)
def test_the_command(name: str, result: ga.Result, tmp_path: Path, cli: Cli) -> None:
    result.save(tmp_path / "result.npz")
    words = ("export", tmp_path / "result.npz", "--format", name)
    status, out, err = cli(*words, "--to", tmp_path / "handed", "--pregrasp", 0.005, "--json")
    assert (status, err) == (0, "")
    assert json.loads(out)["n_handed_over"] == 1
    assert (tmp_path / "handed").exists()
    assert cli(*words)[0] == 2
