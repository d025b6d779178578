"""Grasps in the format of DexGraspBench: a folder with one NumPy file a grasp."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np

from graspatlas.formats.hand_over import HandOver
from graspatlas.storage.files import replaced, writable_folder
from graspatlas.support.arrays import Array

__all__ = ["write_dexgraspbench"]


def write_dexgraspbench(grasps: HandOver, folder: Path) -> None:
    """Write grasps, each a table in a file of its own: ``np.load(file, allow_pickle=True).item()``.

    ``obj_pose`` is the identity, and each ``qpos`` the palm's pose in the object's frame [x y z, quaternion w x y z],
    then the joints in the order of the hand's URDF, which is that of the exported MJCF. ``obj_path`` is the object's
    name: say where its meshes are before you run the benchmark.

    Source: "Main Usage" in the description of DexGraspBench.
    """
    place, poses = writable_folder(folder), grasps.grasps
    base = np.hstack([poses.palm_xyz, poses.palm_quat_xyzw[:, [3, 0, 1, 2]]])
    for i, name in enumerate(grasps.names):
        table: dict[str, object] = {
            "obj_path": poses.problem.object.name,
            "obj_scale": 1.0,
            "obj_pose": np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]),
            "pregrasp_qpos": _qpos(base[i], grasps.pregrasp[i]),
            "grasp_qpos": _qpos(base[i], grasps.grasp[i]),
            "squeeze_qpos": _qpos(base[i], grasps.squeeze[i]),
            "joint_names": list(grasps.joints),
        }
        with replaced(place / f"{name}.npy") as stream:
            stream.write(_pickled(table))


def _qpos(base: Array, joints: Array) -> Array:
    return np.concatenate([base, joints])


def _pickled(table: dict[str, object]) -> bytes:
    buffer = io.BytesIO()
    np.save(buffer, np.array(table, dtype=object), allow_pickle=True)
    return buffer.getvalue()
