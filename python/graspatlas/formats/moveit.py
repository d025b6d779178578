"""Grasps as messages ``moveit_msgs/Grasp`` of ROS: a YAML list."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import yaml

from graspatlas.formats.hand_over import HandOver
from graspatlas.hand.urdf import root_link
from graspatlas.storage.files import replaced
from graspatlas.support.arrays import Array
from graspatlas.support.validation import PlainTable

__all__ = ["write_moveit"]

#: Time to close from the pregrasp to the grasp, and to squeeze [s].
CLOSING, SQUEEZING = 0.4, 0.8


def write_moveit(grasps: HandOver, path: Path) -> None:
    """Write grasps; poses are those of the palm in the object's frame.

    ``pre_grasp_posture`` is the open hand; ``grasp_posture`` passes through the grasp to the squeeze, with the torques
    that exert the contact forces. Neither approach nor retreat moves the wrist: the fingers close around the object.

    Source: the definition of ``moveit_msgs/Grasp``.
    """
    messages = [_message(grasps, i) for i in range(len(grasps))]
    with replaced(path) as stream:
        stream.write(yaml.safe_dump(messages, sort_keys=False, default_flow_style=None, width=120).encode())


def _message(grasps: HandOver, i: int) -> PlainTable:
    problem, poses = grasps.grasps.problem, grasps.grasps
    position = dict(zip("xyz", poses.palm_xyz[i].tolist(), strict=True))
    orientation = dict(zip("xyzw", poses.palm_quat_xyzw[i].tolist(), strict=True))
    palm, thing = root_link(problem.hand.urdf), root_link(problem.object.urdf)
    quality = next(iter(grasps.selection.indices.values()))[i]
    return {
        "id": grasps.names[i],
        "pre_grasp_posture": _trajectory(grasps, palm, [(grasps.pregrasp[i], None, 0.0)]),
        "grasp_posture": _trajectory(
            grasps,
            palm,
            [
                (grasps.grasp[i], np.zeros_like(grasps.torques[i]), CLOSING),
                (grasps.squeeze[i], grasps.torques[i], SQUEEZING),
            ],
        ),
        "grasp_pose": {"header": {"frame_id": thing}, "pose": {"position": position, "orientation": orientation}},
        "grasp_quality": float(quality) if np.isfinite(quality) else 0.0,
        "pre_grasp_approach": _still(palm),
        "post_grasp_retreat": _still(palm),
        "post_place_retreat": _still(palm),
        "max_contact_force": 0.0,
        "allowed_touch_objects": [problem.object.name],
    }


def _trajectory(grasps: HandOver, palm: str, points: list[tuple[Array, Array | None, float]]) -> PlainTable:
    return {
        "header": {"frame_id": palm},
        "joint_names": list(grasps.joints),
        "points": [
            {
                "positions": positions.tolist(),
                "velocities": [],
                "accelerations": [],
                "effort": [] if efforts is None else efforts.tolist(),
                "time_from_start": {"sec": int(time), "nanosec": round(1e9 * (time % 1.0))},
            }
            for positions, efforts, time in points
        ],
    }


def _still(frame: str) -> PlainTable:
    """A translation of the gripper that is none."""
    direction: PlainTable = {"header": {"frame_id": frame}, "vector": {"x": 0.0, "y": 0.0, "z": 0.0}}
    return {"direction": direction, "desired_distance": 0.0, "min_distance": 0.0}
