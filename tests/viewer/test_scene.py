"""The scene: bodies, contacts and where the grasps stand."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from screens import pixels, share, volume

import graspatlas as ga
from graspatlas.viewer import save_picture
from graspatlas.viewer.scene import bodies, meshes
from graspatlas.viewer.scene import stick_figure as sketch
from graspatlas.viewer.scene import velocity_ellipsoid as ellipsoid
from graspatlas.viewer.scene.scene import CONTACT_RADIUS, Scene, grasp_parts, upright_parts
from graspatlas.viewer.web.page import commands

Array = NDArray[np.float64]


URDF = """<robot name="r"><link name="base">{visual}</link></robot>"""
VISUAL = '<visual><geometry><{shape}/></geometry><material name="m"><color rgba="1 0 0 1"/></material></visual>'


@pytest.mark.parametrize(
    ("shape", "expected"),
    [
        ('box size="0.1 0.2 0.3"', 0.006),
        ('sphere radius="0.1"', 4.0 / 3.0 * np.pi * 0.001),
        ('cylinder radius="0.1" length="0.3"', np.pi * 0.003),
        ('mesh filename="tetrahedron.stl" scale="2 2 2"', 8.0 / 6.0),
    ],
)
def test_any_urdf_geometry_is_shown(can_result: ga.Result, tmp_path: Path, shape: str, expected: float) -> None:
    corners = np.vstack([np.zeros(3), np.eye(3)])
    facets = [
        "facet normal 0 0 0 outer loop "
        + " ".join(f"vertex {x} {y} {z}" for x, y, z in corners[list(face)])
        + " endloop endfacet"
        for face in ((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3))
    ]
    (tmp_path / "tetrahedron.stl").write_text("solid t\n" + "\n".join(facets) + "\nendsolid t\n")
    urdf = URDF.format(visual=VISUAL.format(shape=shape)).replace("tetra", f"{tmp_path}/tetra")
    problem = replace(can_result.problem, object=ga.Body("thing", urdf))
    ((mesh, T, colour),) = bodies.BodyShapes(problem).object()
    assert volume(mesh) == pytest.approx(expected, rel=0.02)
    assert_allclose(T, np.eye(4))
    assert colour == (1.0, 0.0, 0.0, 1.0)


def test_a_body_without_visuals_shows_its_collision_shapes(can_result: ga.Result) -> None:
    collision = '<collision><geometry><box size="1 1 1"/></geometry></collision>'
    problem = replace(can_result.problem, object=ga.Body("thing", URDF.format(visual=collision)))
    assert len(list(bodies.BodyShapes(problem).object())) == 1


@pytest.mark.parametrize("name", ["missing.obj", "notes.txt"])
def test_a_mesh_that_cannot_be_read_is_named(can_result: ga.Result, tmp_path: Path, name: str) -> None:
    (tmp_path / "notes.txt").write_text("this is no mesh")
    urdf = URDF.format(visual=VISUAL.format(shape=f'mesh filename="{tmp_path}/{name}"'))
    problem = replace(can_result.problem, object=ga.Body("thing", urdf))
    with pytest.raises(ga.GraspAtlasError, match=f"'thing'.*{name}"):
        Scene(replace(can_result, problem=problem))


# Bodies without shapes


def without_shapes(urdf: str) -> str:
    return re.sub(r"<(visual|collision)\b.*?</\1>", "", urdf, flags=re.DOTALL)


def test_a_body_without_shapes_is_sketched(planar_result: ga.Result, tmp_path: Path) -> None:
    hand, body = (
        replace(b, urdf=without_shapes(b.urdf)) for b in (planar_result.problem.hand, planar_result.problem.object)
    )
    planar = replace(planar_result, problem=replace(planar_result.problem, hand=hand, object=body))
    for exhibit in Scene(planar).exhibits:
        contacts = np.array([part.T[:3, 3] for part in exhibit.parts if part.group == "contact"])
        for group in ("hand", "object"):
            points = np.concatenate([dense(p.mesh.moved(p.T)) for p in exhibit.parts if p.group == group])
            assert cKDTree(points).query(contacts)[0].max() < 0.01
    save_picture(planar, tmp_path / "planar.png", width=480, height=270)
    assert share(pixels(tmp_path / "planar.png"), "red") > 0.0001


def test_a_planar_ellipsoid_is_flat(planar_result: ga.Result) -> None:
    axes, semi_axes = ellipsoid.velocity_ellipsoid(planar_result.best)
    assert_allclose(np.abs(axes[:, 2]), [0.0, 0.0, 1.0], atol=1e-12)
    assert semi_axes[1] > 0.0
    assert semi_axes[2] == 0.0


def test_sheets_and_curves_are_sketched(planar_result: ga.Result) -> None:
    """The patches of a spatial contact: free both ways, along a curve, not at all."""
    contact = planar_result.problem.contacts[0]
    radius = contact.object.radius  # type: ignore[attr-defined]
    sheet = replace(contact.object, v_interval=(0.0, 0.1))  # type: ignore[call-arg]
    for frozen, expected in (({}, 1), ({"v": 0.0}, 1), ({"u": 1.6, "v": 0.0}, 0)):
        contacts = (replace(contact, object=sheet, frozen=frozen),)
        shapes = list(sketch.outlines(replace_contacts(planar_result.problem, contacts)))
        assert len(shapes) == expected
        for mesh, _, _ in shapes:
            across = np.linalg.norm(mesh.vertices[:, :2] - contact.object.origin[:2], axis=1)  # type: ignore[attr-defined]
            assert_allclose(across, radius, atol=0.01)


def replace_contacts(problem: ga.Problem, contacts: tuple[ga.Contact, ...]) -> SimpleNamespace:
    """What the sketch reads of a problem, with other contacts; such a problem need not have a grasp."""
    return SimpleNamespace(hand=problem.hand, x1=problem.x1, x1_array=problem.x1_array, contacts=contacts)


# Scene


@pytest.fixture(scope="module")
def scene(result: ga.Result) -> Scene:
    return Scene(result)


def test_scene_shows_every_mesh_of_hand_and_object(result: ga.Result, scene: Scene) -> None:
    assert [exhibit.name for exhibit in scene.exhibits] == ["best", "worst"]
    for exhibit in scene.exhibits:
        count = {group: sum(part.group == group for part in exhibit.parts) for group in ("hand", "object")}
        assert count["hand"] == result.problem.hand.urdf.count("<visual")
        assert count["object"] == result.problem.object.urdf.count("<visual")
        assert sum(part.group == "contact" for part in exhibit.parts) == len(result.problem.contacts)
        assert sum(part.group == "normal" for part in exhibit.parts) == len(result.problem.contacts)
        assert sum(part.group == "ellipsoid" for part in exhibit.parts) == 1


def test_contacts_lie_on_hand_and_object(scene: Scene) -> None:
    for exhibit in scene.exhibits:
        surface = {
            group: np.concatenate([dense(p.mesh.moved(p.T)) for p in exhibit.parts if p.group == group])
            for group in ("hand", "object")
        }
        contacts = np.array([part.T[:3, 3] for part in exhibit.parts if part.group == "contact"])
        assert cKDTree(surface["object"]).query(contacts)[0].max() < 0.002
        assert cKDTree(surface["hand"]).query(contacts)[0].max() < CONTACT_RADIUS


def dense(mesh: meshes.Mesh) -> Array:
    """Points all over a surface, about one a square millimetre [n, 3]."""
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    areas = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2.0
    faces = np.repeat(np.arange(len(areas)), np.ceil(areas / 1e-6).astype(int))
    u, v = np.random.default_rng(0).random((2, len(faces), 1))
    u, v = np.where(u + v > 1.0, 1.0 - u, u), np.where(u + v > 1.0, 1.0 - v, v)
    return np.asarray(a[faces] + u * (b - a)[faces] + v * (c - a)[faces])


def test_grasps_stand_apart_and_inside_the_window(result: ga.Result) -> None:
    scene = Scene(result)
    window = (-0.8, 0.7, -0.5, 0.9)
    camera = scene.camera(1.5, window)
    best, worst = (camera.project(exhibit.points, 1.5) for exhibit in scene.exhibits)
    assert best[:, 0].max() < worst[:, 0].min()
    seen = np.concatenate([best, worst])[:, :2]
    assert (seen >= [window[0] - 1e-6, window[2] - 1e-6]).all()
    assert (seen <= [window[1] + 1e-6, window[3] + 1e-6]).all()
    assert_allclose(camera.axes @ camera.axes.T, np.eye(3), atol=1e-12)


def test_obstacles_are_drawn_where_they_are_and_see_through(small_result: ga.Result) -> None:
    box = ga.Obstacle.box("wall", [0.1, 0.2, 0.3], ga.Pose([0.0, 0.3, 0.0], [0.0, 0.0, 1.0, 1.0]))
    table = ga.Obstacle.plane("table", [0.0, 0.0, -0.1])
    camera = ga.Obstacle.sphere("camera", 0.05, ga.Pose([0.0, 0.0, 0.2]), frame="palm")
    result = replace(small_result, problem=replace(small_result.problem, obstacles=(box, table, camera)))
    grasp = result.best
    parts = [part for part in grasp_parts(bodies.BodyShapes(result.problem), grasp)[0] if part.group == "obstacle"]
    assert len(parts) == 3
    assert all(0.0 < part.colour[3] < 0.6 for part in parts)
    wall, plate, ball = (part.mesh.moved(part.T).vertices for part in parts)
    assert_allclose(wall.mean(axis=0), (grasp.T_palm_object @ [0.0, 0.3, 0.0, 1.0])[:3], atol=1e-9)
    up = grasp.T_palm_object[:3, 2]
    assert (plate @ up).max() == pytest.approx(grasp.object_xyz @ up - 0.1)
    assert_allclose((ball.min(axis=0) + ball.max(axis=0)) / 2.0, [0.0, 0.0, 0.2], atol=1e-3)
    alone = replace(small_result, problem=replace(small_result.problem, obstacles=(table,)))
    bare, shown = Scene(alone), Scene(result)
    assert_allclose(shown.camera(1.5, (-0.9, 0.9, -0.5, 0.8)).target, bare.camera(1.5, (-0.9, 0.9, -0.5, 0.8)).target)


@pytest.mark.parametrize("normal", [(0.0, 0.0, 1.0), (0.6, 0.0, 0.8), (0.0, 0.0, -1.0), (0.0, 1.0, 0.0)])
def test_the_table_is_level_with_the_grasp_on_it(small_result: ga.Result, normal: tuple[float, float, float]) -> None:
    table = ga.Obstacle.plane("table", (0.0, 0.0, -0.1), normal)
    grasp = replace(small_result, problem=replace(small_result.problem, obstacles=(table,))).best
    shapes = bodies.BodyShapes(grasp.problem)
    there, level = grasp_parts(shapes, grasp)[0], upright_parts(shapes, grasp)[0]
    turn = level[0].T @ np.linalg.inv(there[0].T)
    assert_allclose(turn[:3, :3] @ turn[:3, :3].T, np.eye(3), atol=1e-12)
    assert np.linalg.det(turn) == pytest.approx(1.0)
    for before, after in zip(there, level, strict=True):
        assert_allclose(after.T, turn @ before.T, atol=1e-12)
    (plate,) = (part.mesh.moved(part.T).vertices for part in level if part.group == "obstacle")
    lower, upper = np.unique(plate[:, 2].round(9))
    assert upper - lower > 0.001
    height = (turn @ grasp.T_palm_object)[2, 3] - upper
    assert height == pytest.approx(0.1 * normal[2], abs=1e-8), (
        "the object's origin is as far above it as in its own frame"
    )


def test_the_arm_is_drawn_behind_the_best_grasp_and_see_through(small_result: ga.Result) -> None:
    arm = ga.Arm.named("ur5_robot", "tool0", palm=ga.Pose([0, 0, 0.02]), object=ga.Pose([0.4, 0.2, 0.4]))
    result = replace(small_result, problem=replace(small_result.problem, arm=arm))
    positions, grasp = result.best.arm_positions(), result.best
    parts = [part for part in Scene(result, worst=False).exhibits[0].parts if part.group == "arm"]
    assert len(parts) == 8
    assert all(0.0 < part.colour[3] < 0.6 for part in parts)
    # The last link's mesh is where the arm's kinematics have it, seen from the palm.
    T_base_link = arm.robot.link_placements(arm.robot.configuration(positions))["wrist_3_link"]
    T_palm_base = grasp.T_palm_object @ np.linalg.inv(arm.T_base_object)
    drawn = list(bodies.BodyShapes(result.problem).arm(grasp))
    assert_allclose(drawn[-2][1], T_palm_base @ T_base_link, atol=1e-12)
    assert_allclose(drawn[-2][1][:3, 3], np.linalg.inv(arm.T_flange_palm)[:3, 3] - [0.0, 0.0, 0.0823], atol=1e-9)
    bare, shown = Scene(small_result, worst=False), Scene(result, worst=False)
    assert_allclose(shown.camera(1.5, (-0.9, 0.9, -0.5, 0.8)).target, bare.camera(1.5, (-0.9, 0.9, -0.5, 0.8)).target)
    for scene, count in ((Scene(result), 0), (Scene(result, arm=True), 8)):
        best, worst = ([part for part in exhibit.parts if part.group == "arm"] for exhibit in scene.exhibits)
        assert (len(best), len(worst)) == (count, 0)
    paths = [command.get("path") for command in commands(Scene(result, arm=True))]
    assert "/graspatlas/best/arm" in paths
    away = replace(result.problem, arm=replace(arm, object=ga.Pose([3.0, 0.0, 0.0])))
    assert not list(bodies.BodyShapes(away).arm(replace(grasp, problem=away)))
