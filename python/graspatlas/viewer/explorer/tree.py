"""The hand as a tree of joints that each turn about, or slide along, one axis: what the page computes postures with."""

from __future__ import annotations

from dataclasses import dataclass
from xml.etree import ElementTree

import numpy as np

from graspatlas.grasps.poses import inverse
from graspatlas.hand.hand import Hand
from graspatlas.support.arrays import Array

__all__ = ["Joint", "joint_placements", "joint_tree", "world_placements"]


@dataclass(frozen=True, eq=False)
class Joint:
    """One joint.

    Attributes:
        name: Its name.
        parent: Number of the joint that carries it, counted from 1; 0 is the palm.
        T_parent_joint: Where it is in its parent when its position is 0 (4, 4).
        axis: Unit vector in its own frame (3,).
        prismatic: Whether it slides along its axis instead of turning about it.
    """

    name: str
    parent: int
    T_parent_joint: Array
    axis: Array
    prismatic: bool


def joint_tree(hand: Hand) -> list[Joint]:
    """The joints of a hand, in the order of q, each after its parent.

    Joints that mimic others are joints like any other here: their positions are known.
    """
    parents = {str(e.get("name")): e for e in ElementTree.fromstring(hand.tree).findall("joint")}
    names = hand.joints
    zero = _placements(hand, dict.fromkeys(names, 0.0))
    joints = []
    for i, info in enumerate(hand.model.hand_joints, 1):
        link = parents[info.name].find("parent")
        assert link is not None  # a URDF that Pinocchio has read
        parent = hand.frame(str(link.get("link")))[0]
        moved = _placements(hand, {name: float(name == info.name) for name in names})
        step = inverse(zero[i]) @ moved[i]
        joints.append(
            Joint(info.name, parent, inverse(zero[parent]) @ zero[i], _axis(step, info.prismatic), info.prismatic)
        )
    return joints


def _placements(hand: Hand, positions: dict[str, float]) -> Array:
    """Placements of palm and joints in the palm's frame (1 + h, 4, 4)."""
    links = hand.link_placements(hand.configuration(positions))
    T = np.tile(np.eye(4), (1 + len(positions), 1, 1))
    for name, place in links.items():
        joint, T_joint_link = hand.frame(name)
        if joint > 0:
            T[joint] = place @ inverse(T_joint_link)
    return T


def _axis(step: Array, prismatic: bool) -> Array:
    """The axis of a joint that has moved by 1 rad or 1 m, in its own frame."""
    R = step[:3, :3]
    axis = step[:3, 3] if prismatic else np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    return np.asarray(axis / np.linalg.norm(axis))


def joint_placements(joint: Joint, positions: Array) -> Array:
    """Placements of a joint in its parent (n, 4, 4) at positions (n,)."""
    T = np.tile(np.eye(4), (len(positions), 1, 1))
    if joint.prismatic:
        T[:, :3, 3] = positions[:, None] * joint.axis
    else:
        K = _cross_matrix(joint.axis)
        sine, cosine = np.sin(positions)[:, None, None], np.cos(positions)[:, None, None]
        T[:, :3, :3] = np.eye(3) + sine * K + (1.0 - cosine) * (K @ K)
    return np.asarray(joint.T_parent_joint @ T)


def world_placements(joints: list[Joint], positions: Array) -> Array:
    """Placements of palm and joints in the palm's frame (1 + h, n, 4, 4) at joint positions (n, h)."""
    T = np.tile(np.eye(4), (1 + len(joints), len(positions), 1, 1))
    for i, joint in enumerate(joints, 1):
        T[i] = T[joint.parent] @ joint_placements(joint, positions[:, i - 1])
    return T


def _cross_matrix(v: Array) -> Array:
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])
