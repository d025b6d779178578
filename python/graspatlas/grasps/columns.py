"""Grasps as columns of a table: joints, poses, contacts and patch parameters."""

from __future__ import annotations

import numpy as np

from graspatlas.grasps.grasps import Grasps
from graspatlas.storage.columns import joined, pose_columns
from graspatlas.support.arrays import AnyArray, Array

__all__ = ["contact_columns", "grasp_columns", "parameter_columns"]


def grasp_columns(grasps: Grasps) -> dict[str, Array]:
    """Columns of joints by name [rad or m], and of the poses of palm and object in one another's frames.

    Raises:
        GraspAtlasError: If a joint has the name of another column.
    """
    return joined(
        grasps.joint_positions,
        pose_columns("palm", grasps.palm_xyz, grasps.palm_quat_xyzw),
        pose_columns("object", grasps.object_xyz, grasps.object_quat_xyzw),
    )


def contact_columns(grasps: Grasps) -> dict[str, AnyArray]:
    """Columns of each contact: its frame, its point and the object's outward normal, in the object's frame."""
    points, normals = grasps.contact_points_in_object, grasps.contact_normals_in_object
    columns: dict[str, AnyArray] = {}
    for i, frame in enumerate(grasps.contact_frames):
        columns[f"contact{i}_frame"] = np.full(len(grasps), frame)
        columns |= {f"contact{i}_{axis}": points[:, i, a] for a, axis in enumerate("xyz")}
        columns |= {f"contact{i}_n{axis}": normals[:, i, a] for a, axis in enumerate("xyz")}
    return columns


def parameter_columns(grasps: Grasps) -> dict[str, Array]:
    """The free patch parameters, which are the last numbers of x: ``contact0_hand_u`` and so on."""
    names = grasps.problem.parameter_names
    return {name: grasps.x[:, at - len(names)] for at, name in enumerate(names)}
