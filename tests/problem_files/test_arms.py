"""Arms in problem files: their way there and back, and what is said of broken ones."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest
from problem_texts import CAN, fault, read

import graspatlas as ga
from graspatlas.sweep.runs import Run, runs_of

ARM = """
arm:
  example_robot_data: ur5_robot
  flange: tool0
  limits: {elbow_joint: [-2, 2]}
  palm: {xyz: [0, 0, 0.02], quat_xyzw: [0, 0, 1, 1]}
  base: {xyz: [0.1, 0, 0]}
  object: {xyz: [0.5, 0.2, 0.3]}
requirements: [reachable]
"""


def test_an_arm_is_read_and_written(tmp_path: Path) -> None:
    (tmp_path / "can.yaml").write_text(CAN + ARM)
    problem = ga.load_problem(tmp_path / "can.yaml")
    by_hand = ga.Arm.named(
        "ur5_robot",
        "tool0",
        palm=ga.Pose([0, 0, 0.02], [0, 0, 1, 1]),
        base=ga.Pose([0.1, 0, 0]),
        object=ga.Pose([0.5, 0.2, 0.3]),
    )
    assert problem.arm is not None
    assert problem.arm.robot.limits_by_name["elbow_joint"] == (-2.0, 2.0)
    assert {**problem.arm.to_dict(), "limits": {}, "name": "", "urdf": ""} == {
        **by_hand.to_dict(),
        "name": "",
        "urdf": "",
    }
    assert problem.requirements == (ga.Reachable(),)
    (tmp_path / "again.json").write_text(json.dumps(problem.to_dict()))
    again = ga.load_problem(tmp_path / "again.json")
    assert again.to_dict() == problem.to_dict()
    assert ga.Problem.from_dict(problem.to_dict()).to_dict() == problem.to_dict()
    assert "arm" not in read(CAN).to_dict()


def test_a_stored_result_keeps_the_arm(tmp_path: Path) -> None:
    result = ga.optimize(read(CAN + ARM), radius=0.5)
    result.save(tmp_path / "can.npz")
    again = ga.load_result(tmp_path / "can.npz")
    assert again.problem.to_dict() == result.problem.to_dict()
    assert (again.accepted == result.accepted).all()
    assert (again.reachable == result.reachable).all()
    assert again.best.arm_positions() == result.best.arm_positions()


UR5 = "example_robot_data: ur5_robot"
#: What is stated of an arm, and what is said of it.
BROKEN = {
    "no flange": (f"{{{UR5}}}", "arm.flange: is missing"),
    "no robot": ("{flange: tool0}", "the arm needs exactly one of urdf, mjcf, example_robot_data, robot_descriptions"),
    "two robots": (f"{{{UR5}, urdf: a.urdf, flange: tool0}}", "got urdf and example_robot_data"),
    "unknown robot": (
        "{example_robot_data: ur5_robo, flange: tool0}",
        "arm.example_robot_data: robot 'ur5_robo' is not in example-robot-data; did you mean 'ur5_robot'?",
    ),
    "no file": ("{urdf: nowhere.urdf, flange: tool0}", "arm.urdf: file 'nowhere.urdf' does not exist"),
    "unknown flange": (f"{{{UR5}, flange: tool}}", "arm.flange: flange 'tool' is not a link of arm 'ur5_robot'"),
    "flange that stands still": (f"{{{UR5}, flange: base_link}}", "no joint moves the flange 'base_link'"),
    "unknown field": (f"{{{UR5}, flange: tool0, plam: {{}}}}", "field 'plam' is unknown; did you mean 'palm'?"),
    "short position": (f"{{{UR5}, flange: tool0, palm: {{xyz: [0, 0]}}}}", "arm.palm.xyz: "),
    "no rotation": (
        f"{{{UR5}, flange: tool0, base: {{quat_xyzw: [0, 0, 0, 0]}}}}",
        "arm.base: a pose has a quaternion of length zero",
    ),
    "pose as a list": (f"{{{UR5}, flange: tool0, object: [0, 0, 1]}}", "arm.object: must be a table"),
    "unknown joint": (
        f"{{{UR5}, flange: tool0, locked: {{elbow: 0}}}}",
        "joint 'elbow' is not one of hand 'ur5_robot'",
    ),
    "limits turned round": (
        f"{{{UR5}, flange: tool0, limits: {{elbow_joint: [1, -1]}}}}",
        "limits of joint 'elbow_joint'",
    ),
    "not a table": ("ur5_robot", "arm: must be a table"),
}


@pytest.mark.parametrize("case", BROKEN)
def test_broken_arms(case: str) -> None:
    text, message = BROKEN[case]
    said = fault(f"{CAN}arm: {text}\n")
    assert message in said
    assert said.startswith("can.yaml:")


def test_the_requirement_needs_an_arm() -> None:
    said = fault(f"{CAN}requirements: [reachable]\n")
    assert (
        "requirement reachable asks what an arm can bring about, but problem 'schunk_can' has no arm; state one" in said
    )


@pytest.mark.parametrize("clearance", [-0.01, "far"])
def test_a_wrong_clearance(clearance: object) -> None:
    said = fault(f"{CAN}{ARM.replace('[reachable]', f'[reachable: {{clearance: {clearance}}}]')}")
    assert "clearance" in said


def test_runs_with_another_arm_are_other_runs(tmp_path: Path) -> None:
    """Sweeps and searches know what they keep by a digest of the whole problem."""
    keys = []
    for number, text in enumerate((CAN, CAN + ARM, CAN + ARM.replace("[0.5, 0.2, 0.3]", "[0.5, 0.2, 0.31]"))):
        file = tmp_path / str(number) / "can.yaml"
        file.parent.mkdir()
        file.write_text(text.replace("requirements: [reachable]", ""))
        (run,) = runs_of(str(file), Run("", None), [(2, 0.5, 0.5, "manipulability_volume")])
        keys.append(replace(run, file="").key)
    assert len(set(keys)) == 3
