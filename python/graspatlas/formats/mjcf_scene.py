"""Grasps as a scene of MuJoCo: hand, object, servos and a keyframe for each posture, in one MJCF file."""

from __future__ import annotations

from copy import deepcopy
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

from graspatlas.formats.hand_over import HandOver
from graspatlas.simulation.mjcf import child, text
from graspatlas.simulation.protocols import PROTOCOLS
from graspatlas.simulation.scene import Scene
from graspatlas.storage.files import replaced

__all__ = ["write_mjcf"]


def write_mjcf(grasps: HandOver, path: Path) -> None:
    """Write a scene that MuJoCo's viewer opens, under the conditions of ``dexgraspbench``; it needs no other file.

    The keyframes of a grasp are named after it: ``pregrasp_chart_12``, ``grasp_chart_12``, ``squeeze_chart_12``, the
    last with the hand at the contacts and the servos' targets beyond them. The object's frame has its origin at the
    centre of mass.
    """
    protocol = replace(PROTOCOLS["dexgraspbench"], stiffness=grasps.stiffness)
    scene = Scene(grasps.grasps.problem, protocol)
    root = deepcopy(scene.root)
    frames = child(root, "keyframe")
    T = grasps.grasps.T_palm_object
    at = [grasps.joints.index(servo) for servo in scene.servos]
    postures = {"pregrasp": grasps.pregrasp, "grasp": grasps.grasp, "squeeze": grasps.squeeze}
    for i, name in enumerate(grasps.names):
        for kind, targets in postures.items():
            positions = grasps.pregrasp if kind == "pregrasp" else grasps.grasp
            qpos = scene.configurations(positions[i : i + 1], T[i : i + 1])[0]
            ctrl = [*targets[i, at], *[0.0] * scene.directions]
            child(frames, "key", name=f"{kind}_{name}", qpos=text(qpos), ctrl=text(ctrl))
    ElementTree.indent(root)
    with replaced(path) as stream:
        stream.write(ElementTree.tostring(root, encoding="utf-8"))
