"""Grasps in the format ``isaac_grasp`` 1.0 of NVIDIA's Isaac Sim and Isaac ROS: one YAML file for all."""

from __future__ import annotations

from pathlib import Path

import yaml

from graspatlas.formats.hand_over import HandOver
from graspatlas.hand.urdf import root_link
from graspatlas.storage.files import replaced
from graspatlas.support.arrays import Array
from graspatlas.support.validation import PlainTable

__all__ = ["write_isaac_grasp"]


def write_isaac_grasp(grasps: HandOver, path: Path) -> None:
    """Write grasps; the gripper's frame is the palm, its pose that in the object's frame.

    The confidence of a grasp that meets the requirements is 1, of another 0. ``cspace_position`` is the hand at the
    contacts, ``pregrasp_cspace_position`` the open hand. The format has no place for the squeeze: it stands under
    ``squeeze_cspace_position``, which other programs do not look for.

    Source: the format's description in the documentation of Isaac Sim's Grasp Editor.
    """
    problem, poses = grasps.grasps.problem, grasps.grasps
    table: PlainTable = {
        "format": "isaac_grasp",
        "format_version": 1.0,
        "object_frame_link": root_link(problem.object.urdf),
        "gripper_frame_link": root_link(problem.hand.urdf),
        "grasps": {
            name: {
                "confidence": float(grasps.selection.accepted[i]),
                "position": poses.palm_xyz[i].tolist(),
                "orientation": {"w": float(poses.palm_quat_xyzw[i, 3]), "xyz": poses.palm_quat_xyzw[i, :3].tolist()},
                "cspace_position": _by_joint(grasps, grasps.grasp[i]),
                "pregrasp_cspace_position": _by_joint(grasps, grasps.pregrasp[i]),
                "squeeze_cspace_position": _by_joint(grasps, grasps.squeeze[i]),
            }
            for i, name in enumerate(grasps.names)
        },
    }
    with replaced(path) as stream:
        stream.write(yaml.safe_dump(table, sort_keys=False, default_flow_style=None, width=120).encode())


def _by_joint(grasps: HandOver, positions: Array) -> dict[str, float]:
    return dict(zip(grasps.joints, positions.tolist(), strict=True))
