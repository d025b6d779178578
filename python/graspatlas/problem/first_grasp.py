"""A first grasp by joint names and a pose, and as the vector x (Section II of the paper)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from graspatlas.errors import GraspAtlasError, unknown_name
from graspatlas.hand.hand import Hand
from graspatlas.problem.contact_parameters import touching_parameters
from graspatlas.problem.contacts import Contact
from graspatlas.problem.object_joint import ObjectJoint
from graspatlas.support.arrays import Array
from graspatlas.support.validation import PlainTable, StatedTable, checked_table, number, number_array, numbers
from graspatlas.world.pose import LARGEST, unit_quaternion

__all__ = ["FirstGrasp", "first_grasp_from_array", "first_grasp_to_array", "posture_array"]


@dataclass(frozen=True)
class FirstGrasp:
    """A feasible grasp x1 from which the atlas grows.

    Attributes:
        joints: Joint positions by name [rad or m]; all of the hand's.
        object_xyz: Position of the object in the palm's frame [m].
        object_quat_xyzw: Its rotation; normalised.
        parameters: Free patch parameters in the order of x; found from the contact points when not given.
    """

    joints: Mapping[str, float]
    object_xyz: Sequence[float] = (0.0, 0.0, 0.0)
    object_quat_xyzw: Sequence[float] = (0.0, 0.0, 0.0, 1.0)
    parameters: Sequence[float] | None = None

    def __post_init__(self) -> None:
        checked_table(self.joints, "x1's joints", (), None)
        joints = [number(value, f"joint '{name}' of x1") for name, value in self.joints.items()]
        xyz = number_array(self.object_xyz, "object_xyz")
        quaternion = number_array(self.object_quat_xyzw, "object_quat_xyzw")
        parameters = number_array(() if self.parameters is None else self.parameters, "the parameters of x1")
        if xyz.shape != (3,) or quaternion.shape != (4,) or parameters.ndim != 1:
            raise GraspAtlasError("x1 needs object_xyz of 3 numbers, object_quat_xyzw of 4 and a row of parameters")
        values = np.concatenate([joints, xyz, quaternion, parameters])
        if not (np.abs(values) < LARGEST).all():
            raise GraspAtlasError(f"x1 holds a number that is not finite, or not below {LARGEST:g}")
        object.__setattr__(self, "object_quat_xyzw", unit_quaternion(self.object_quat_xyzw, "x1"))

    def to_dict(self) -> PlainTable:
        """The first grasp as plain data."""
        return {
            "joints": dict(self.joints),
            "object_xyz": list(self.object_xyz),
            "object_quat_xyzw": list(self.object_quat_xyzw),
            "parameters": None if self.parameters is None else list(self.parameters),
        }

    @classmethod
    def from_dict(cls, data: StatedTable) -> FirstGrasp:
        """The first grasp that :meth:`to_dict` described.

        Raises:
            GraspAtlasError: If something is missing or wrong.
        """
        table = checked_table(data, "x1", ("joints", "object_xyz", "object_quat_xyzw"), ("parameters",))
        joints = checked_table(table["joints"], "x1's joints", (), None)
        parameters = table.get("parameters")
        return cls(
            joints={name: number(value, f"joint '{name}' of x1") for name, value in joints.items()},
            object_xyz=numbers(table["object_xyz"], "object_xyz"),
            object_quat_xyzw=numbers(table["object_quat_xyzw"], "object_quat_xyzw"),
            parameters=None if parameters is None else numbers(parameters, "parameters"),
        )


def posture_array(hand: Hand, joints: Mapping[str, float], what: str) -> Array:
    """Joint configuration (nq,) of joint positions by name [rad or m].

    Args:
        hand: The hand.
        joints: Position of each of its joints.
        what: What gives them, for messages.

    Raises:
        GraspAtlasError: If a joint is missing, or the hand has no such joint.
    """
    for name in joints:
        if name not in hand.joints:
            raise unknown_name("joint", name, hand.joints, f"in hand '{hand.name}'")
    missing = [name for name in hand.joints if name not in joints]
    if missing:
        raise GraspAtlasError(f"{what} gives no position for joint '{missing[0]}' of hand '{hand.name}'")
    q = np.array(hand.model.neutral, float)
    for joint in hand.model.hand_joints:
        value = joints[joint.name]
        if joint.q_size == 2:
            q[joint.q_index : joint.q_index + 2] = np.cos(value), np.sin(value)
        else:
            q[joint.q_index] = value
    return q


def first_grasp_to_array(
    x1: FirstGrasp, hand: Hand, contacts: Sequence[Contact], joint: ObjectJoint, length_scale: float
) -> Array:
    """x1 as the vector [q_hand, q_object, free patch parameters], in Pinocchio's conventions.

    Parameters that x1 does not give are those of the patch points nearest to each other.

    Raises:
        GraspAtlasError: If joints or patch parameters are missing or too many.
    """
    q = posture_array(hand, x1.joints, "x1")
    pose = joint.from_quaternion(x1.object_xyz, x1.object_quat_xyzw)
    free = sum(len(contact.free()) for contact in contacts)
    if x1.parameters is not None and len(x1.parameters) != free:
        how = "more" if len(x1.parameters) > free else "fewer"
        raise GraspAtlasError(f"x1 gives {len(x1.parameters)} patch parameters, {how} than the {free} that are free")
    parameters = (
        x1.parameters if x1.parameters is not None else [*_nearest_parameters(x1, hand, q, contacts, length_scale)]
    )
    return np.array([*q, *pose, *parameters])


def _nearest_parameters(
    x1: FirstGrasp, hand: Hand, q: Array, contacts: Sequence[Contact], length_scale: float
) -> Iterator[float]:
    """Free patch parameters at which hand and object touch, or nearly so."""
    places, T_object = hand.link_placements(q), _pose(x1)
    for contact in contacts:
        T_frame, (of_hand, of_object) = places[contact.frame], contact.sides
        if of_hand.free:
            on_hand, on_object = touching_parameters(contact, _inverse(T_frame) @ T_object, length_scale)
        else:
            on_hand = of_hand.locate(np.zeros(3))
            touch = _apply(T_frame, contact.hand.point(*on_hand))
            on_object = of_object.locate(_apply(_inverse(T_object), touch))
        yield from of_hand.values_of_free(on_hand)
        yield from of_object.values_of_free(on_object)


def _pose(x1: FirstGrasp) -> Array:
    """T_palm_object (4, 4)."""
    T = np.eye(4)
    x, y, z, w = x1.object_quat_xyzw
    v = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    T[:3, :3] = np.eye(3) + 2.0 * w * v + 2.0 * v @ v
    T[:3, 3] = x1.object_xyz
    return T


def _apply(T: Array, point: ArrayLike) -> Array:
    return np.asarray(T[:3, :3] @ np.asarray(point) + T[:3, 3])


def _inverse(T: Array) -> Array:
    inverse = np.eye(4)
    inverse[:3, :3] = T[:3, :3].T
    inverse[:3, 3] = -T[:3, :3].T @ T[:3, 3]
    return inverse


def first_grasp_from_array(x: Array, hand: Hand, joint: ObjectJoint) -> FirstGrasp:
    """The inverse of :func:`first_grasp_to_array`."""
    nq = hand.model.hand_q_size
    pose, rest = x[nq : nq + joint.size], x[nq + joint.size :]
    xyz, quaternion = joint.to_quaternion(pose)
    return FirstGrasp(hand.joint_positions(x[:nq]), xyz, quaternion, tuple(map(float, rest)))
