"""Obstacles in problem files: every kind, their way there and back, and what is said of broken ones."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from problem_texts import CAN, fault, read

import graspatlas as ga

MESH = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"
ALL = """
obstacles:
  - {name: table, plane: {normal: [0, 2, 0]}, xyz: [0, -0.05, 0]}
  - {name: wall, box: {size: [0.1, 0.2, 0.3]}, xyz: [0, 0, 1], quat_xyzw: [0, 0, 1, 1]}
  - {name: ball, sphere: {radius: 0.02}, frame: palm, xyz: [0, 0, -1]}
  - {name: post, cylinder: {radius: 0.02, length: 0.1}, xyz: [1, 0, 0]}
  - {name: thing, mesh: thing.obj, scale: 0.01, xyz: [0, 1, 0]}
"""


def test_every_kind_is_read_and_written(tmp_path: Path) -> None:
    (tmp_path / "thing.obj").write_text(MESH)
    (tmp_path / "can.yaml").write_text(CAN + ALL)
    problem = ga.load_problem(tmp_path / "can.yaml")
    turned = ga.Pose([0, 0, 1], [0, 0, 1, 1])
    by_hand = (
        ga.Obstacle.plane("table", [0, -0.05, 0], [0, 1, 0]),
        ga.Obstacle.box("wall", [0.1, 0.2, 0.3], turned),
        ga.Obstacle.sphere("ball", 0.02, ga.Pose([0, 0, -1]), frame="palm"),
        ga.Obstacle.cylinder("post", 0.02, 0.1, ga.Pose([1, 0, 0])),
        ga.Obstacle.mesh("thing", tmp_path / "thing.obj", 0.01, ga.Pose([0, 1, 0])),
    )
    assert [each.to_dict() for each in problem.obstacles] == [each.to_dict() for each in by_hand]
    (tmp_path / "again.json").write_text(json.dumps(problem.to_dict()))
    assert ga.load_problem(tmp_path / "again.json").to_dict() == problem.to_dict()


def test_stored_results_keep_the_obstacles(tmp_path: Path) -> None:
    problem = read(CAN + "obstacles: [{name: table, plane: {normal: [0, 1, 0]}, xyz: [0, -0.06, 0]}]\n")
    result = ga.optimize(problem, radius=0.5, require=[ga.CollisionFree(5e-5)])
    result.save(tmp_path / "can.npz")
    again = ga.load_result(tmp_path / "can.npz")
    assert again.problem.to_dict() == problem.to_dict()
    np.testing.assert_array_equal(again.accepted, result.accepted)


#: What is stated of an obstacle, and what is said of it.
BROKEN = {
    "no name": ("{sphere: {radius: 0.02}}", "obstacles[0].name: is missing"),
    "no shape": (
        "{name: table}",
        "an obstacle needs exactly one of plane, urdf, mesh, sphere, box, cylinder, got none",
    ),
    "two shapes": ("{name: a, sphere: {radius: 1}, box: {size: [1, 1, 1]}}", "got sphere and box"),
    "unknown frame": ("{name: a, sphere: {radius: 1}, frame: world}", "obstacles[0].frame: must be 'object' or 'palm'"),
    "unknown field": ("{name: a, spere: {radius: 1}}", "field 'spere' is unknown; did you mean 'sphere'?"),
    "negative radius": ("{name: a, sphere: {radius: -1}}", "obstacles[0].sphere.radius: must be positive"),
    "short position": ("{name: a, sphere: {radius: 1}, xyz: [0, 0]}", "obstacles[0].xyz: "),
    "no rotation": ("{name: a, sphere: {radius: 1}, quat_xyzw: [0, 0, 0, 0]}", "a quaternion of length zero"),
    "no normal": ("{name: a, plane: {normal: [0, 0, 0]}}", "normal of obstacle 'a' has the length 0"),
    "no mesh": ("{name: a, mesh: nowhere.obj}", "nowhere.obj"),
    "scale of a ball": ("{name: a, sphere: {radius: 1}, scale: 0.001}", "scale is for a mesh; state other sizes in"),
    "the same name": ("{name: a, plane: {}}, {name: a, plane: {}}", "two obstacles are called 'a'"),
}


@pytest.mark.parametrize("case", BROKEN)
def test_broken_obstacles(case: str) -> None:
    text, message = BROKEN[case]
    said = fault(f"{CAN}obstacles: [{text}]\n")
    assert message in said
    assert said.startswith("can.yaml:")
