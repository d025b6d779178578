"""Obstacles: how they are stated, where they are, and what is said of wrong ones."""

from __future__ import annotations

import pickle
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import graspatlas as ga

TURNED = ga.Pose([0.1, -0.2, 0.3], [0.0, 0.0, 2.0, 2.0])
ARM = (
    '<robot name="lamp"><link name="foot"/><link name="head"/><joint name="neck" type="revolute"><parent link="foot"/>'
    '<child link="head"/><axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>'
)


def test_a_pose_is_its_matrix() -> None:
    np.testing.assert_allclose(
        TURNED.matrix[:3, :3], Rotation.from_euler("z", 90, degrees=True).as_matrix(), atol=1e-15
    )
    np.testing.assert_array_equal(TURNED.matrix[:3, 3], TURNED.xyz)
    assert ga.Pose.from_dict(TURNED.to_dict()) == TURNED
    assert ga.Pose.from_dict({}) == ga.Pose()


def test_the_frame_of_a_plane_has_its_normal_for_z() -> None:
    for normal in np.random.default_rng(0).normal(size=(20, 3)):
        wall = ga.Obstacle(name="wall", normal=normal, pose=TURNED)
        R = wall.T_frame_shape[:3, :3]
        np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-12)
        assert np.linalg.det(R) > 0.0
        np.testing.assert_allclose(R[:, 2], TURNED.matrix[:3, :3] @ normal / np.linalg.norm(normal), atol=1e-12)
        np.testing.assert_array_equal(wall.T_frame_shape[:3, 3], TURNED.xyz)


def test_obstacles_come_back_from_plain_data_and_pickles(can: ga.Problem, tmp_path: Any) -> None:
    mesh = tmp_path / "thing.obj"
    mesh.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n")
    stated = (
        ga.Obstacle.plane("table", [0, 0, -0.06], [0, 1, 1]),
        ga.Obstacle.box("wall", [0.1, 0.2, 0.3], TURNED),
        ga.Obstacle.sphere("ball", 0.02, frame="palm"),
        ga.Obstacle.cylinder("post", 0.02, 0.1),
        ga.Obstacle.mesh("thing", mesh, 0.01),
    )
    problem = replace(can, obstacles=stated)
    for again in (ga.Problem.from_dict(problem.to_dict()), pickle.loads(pickle.dumps(problem))):
        assert again.to_dict() == problem.to_dict()
        for a, b in zip(again.obstacles, stated, strict=True):
            assert (a.name, a.normal, a.frame, a.pose) == (b.name, b.normal, b.frame, b.pose)
            np.testing.assert_array_equal(a.T_frame_shape, b.T_frame_shape)
    assert "obstacles" not in can.to_dict()  # what was stored before there were any is the same problem


WRONG: list[tuple[Any, str]] = [
    (lambda: ga.Obstacle.plane("", [0, 0, 0]), "an obstacle needs a name, such as 'table'; got ''"),
    (lambda: ga.Obstacle("table"), r"'table' is either a body or a plane with a normal; make it by Obstacle.box"),
    (lambda: ga.Obstacle.plane("table", [0, 0]), r"xyz of a pose must be 3 finite numbers \[m\], got \[0, 0\]"),
    (lambda: ga.Obstacle.plane("table", [0, 0, 0], [0, 0, 0]), "normal of obstacle 'table' has the length 0; let it"),
    (lambda: ga.Obstacle.plane("table", [0, 0, 0], [0, float("nan"), 1]), "must be 3 finite numbers, such as"),
    (
        lambda: ga.Obstacle.plane("table", [0, 0, 0], frame="world"),  # type: ignore[arg-type]
        "frame of obstacle 'table' must be 'object' or 'palm', what it is fixed to; got 'world'",
    ),
    (lambda: ga.Obstacle.box("wall", [0.1, 0.2]), r"size of obstacle 'wall' must be 3 lengths \[m\], got \[0.1, 0.2\]"),
    (lambda: ga.Obstacle.box("wall", [0.1, 0.2, -1]), "size of obstacle 'wall' must be a positive number, got -1"),
    (lambda: ga.Obstacle.sphere("ball", 0.0), "radius of obstacle 'ball' must be a positive number, got 0"),
    (lambda: ga.Obstacle.cylinder("post", 0.1, -0.1), "length of obstacle 'post' must be a positive number, got -0.1"),
    (lambda: ga.Obstacle.mesh("rock", "rock.obj"), "rock.obj"),
    (
        lambda: ga.Obstacle("lamp", ga.Body("lamp", ARM)),
        "moving joint 'neck', but obstacles stand still: make it fixed",
    ),
    (lambda: ga.Pose([0, 0, 0], [0, 0, 0, 0]), "a pose has a quaternion of length zero"),
]


@pytest.mark.parametrize(("make", "message"), WRONG, ids=[message[:40] for _, message in WRONG])
def test_wrong_obstacles(make: Any, message: str) -> None:
    with pytest.raises(ga.GraspAtlasError, match=message):
        make()


def test_wrong_lists_of_obstacles(can: ga.Problem) -> None:
    table = ga.Obstacle.plane("table", [0, 0, 0])
    with pytest.raises(ga.GraspAtlasError, match="two obstacles are called 'table'; give each a name of its own"):
        replace(can, obstacles=(table, table))
    with pytest.raises(ga.GraspAtlasError, match=r"an obstacle must be a Obstacle, got 'table'; see Obstacle.box"):
        replace(can, obstacles=("table",))
