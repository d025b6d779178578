"""Checks of what a problem is made of, before anything is solved."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from graspatlas import _core
from graspatlas.errors import GraspAtlasError
from graspatlas.hand.body import Body
from graspatlas.hand.hand import Hand
from graspatlas.hand.motions import HandMotions
from graspatlas.problem.contacts import Contact
from graspatlas.problem.first_grasp import FirstGrasp, posture_array
from graspatlas.problem.object_joint import ObjectJoint
from graspatlas.problem.pose_guess import PoseGuess
from graspatlas.problem.requirement import StatedRequirement
from graspatlas.support.arrays import Array
from graspatlas.support.validation import checked_instance, checked_table, number
from graspatlas.world.arm import Arm
from graspatlas.world.obstacle import Obstacle

__all__ = [
    "DEFAULTS",
    "check_arm",
    "check_bounds",
    "check_freedom",
    "check_joints",
    "check_lengths",
    "check_obstacles",
    "check_poses",
    "check_reference",
    "check_touch",
    "check_types",
    "checked_posture",
]

#: How far a first grasp may miss a contact, since it is projected onto the contacts anyway [m], [rad].
CONTACT_TOLERANCE = 1e-3
NORMAL_TOLERANCE = 0.05
#: Smallest and largest length that may count as much as one radian [m].
LENGTH_SCALES = (1e-6, 1e6)
#: Options of `optimize` that a problem may give.
DEFAULTS = ("dimension", "radius", "epsilon", "quality")
#: How far a first grasp may break a joint limit or leave a patch [rad or m].
LIMIT_TOLERANCE = 1e-9
#: What the parts of a problem are, and what makes one.
_TYPES: tuple[tuple[str, type | tuple[type, ...], str], ...] = (
    ("hand", Hand, "Hand.from_urdf"),
    ("object", Body, "Body.from_urdf"),
    ("contacts", (list, tuple), ""),
    ("x1", (FirstGrasp, type(None)), ""),
    ("pose_guess", (PoseGuess, type(None)), ""),
    ("motions", (HandMotions, type(None)), "HandMotions.from_samples"),
)


def check_types(parts: Mapping[str, object], contacts: Sequence[Contact]) -> None:
    """Raise GraspAtlasError unless the parts of a problem, by the name of the attribute, are what they must be."""
    for name, kinds, hint in _TYPES:
        checked_instance(parts[name], kinds, name, hint)
    for contact in contacts:
        checked_instance(contact, Contact, "a contact")
    checked_table(parts["defaults"], "defaults", (), DEFAULTS)


def check_lengths(length_scale: float, torque_length: float | None) -> None:
    """Raise GraspAtlasError unless these are lengths [m] that can be."""
    low, high = LENGTH_SCALES
    if not low <= length_scale <= high:
        raise GraspAtlasError(f"length_scale must lie between {low:g} and {high:g} m, got {length_scale}")
    if torque_length is not None and not 0.0 < torque_length < np.inf:
        raise GraspAtlasError(f"torque_length must be positive, got {torque_length}")


def check_obstacles(obstacles: Sequence[Obstacle]) -> None:
    """Raise GraspAtlasError unless these are obstacles, each with a name of its own."""
    checked_instance(obstacles, (list, tuple), "obstacles")
    names: set[str] = set()
    for obstacle in obstacles:
        checked_instance(obstacle, Obstacle, "an obstacle", "Obstacle.box or Obstacle.plane")
        if obstacle.name in names:
            raise GraspAtlasError(f"two obstacles are called '{obstacle.name}'; give each a name of its own")
        names.add(obstacle.name)


def check_arm(name: str, arm: Arm | None, requirements: Sequence[StatedRequirement]) -> None:
    """Raise GraspAtlasError unless a problem's arm is one, and there where a requirement asks for it."""
    checked_instance(arm, (Arm, type(None)), "arm", "Arm.named")
    for requirement in requirements:
        if requirement.needs_arm and arm is None:
            raise GraspAtlasError(
                f"requirement {requirement.name} asks what an arm can bring about, but problem '{name}' has no arm; "
                "state one, such as arm: {example_robot_data: ur5_robot, flange: tool0, ...}"
            )


def check_poses(joint: ObjectJoint, x1: FirstGrasp | None, guess: PoseGuess | None) -> None:
    """Raise GraspAtlasError unless the object can get to where a first grasp and a guess have it."""
    if guess is not None and joint.planar:
        guess.check_in_plane()
    if x1 is not None and not joint.allows(x1.object_xyz, x1.object_quat_xyzw):
        raise GraspAtlasError("in a planar problem x1's object lies in the x-y plane: z = 0, and turned about z only")


def checked_posture(posture: Mapping[str, float]) -> dict[str, float]:
    """The joint positions of a reference posture by name [rad or m].

    Raises:
        GraspAtlasError: If they are not numbers.
    """
    stated = checked_table(posture, "the reference posture", (), None)
    return {joint: number(value, f"joint '{joint}' of the reference") for joint, value in stated.items()}


def check_joints(hand: Hand, motions: HandMotions | None) -> None:
    """Raise GraspAtlasError unless the joints have one degree of freedom each, and the hand motions are theirs."""
    for joint in hand.model.hand_joints:
        if joint.v_size != 1:
            raise GraspAtlasError(
                f"joint '{joint.name}' of hand '{hand.name}' has {joint.v_size} degrees of freedom; "
                "a hand's joints must have one each"
            )
    if motions is None:
        return
    if set(motions.joints) != set(hand.joints):
        odd = sorted(set(motions.joints) ^ set(hand.joints))[0]
        raise GraspAtlasError(f"the hand motions and hand '{hand.name}' do not have the same joints: see '{odd}'")
    hand.mechanism.constrained(motions)


def check_reference(name: str, hand: Hand, posture: Mapping[str, float]) -> None:
    """Raise GraspAtlasError unless a problem's reference posture is of finite numbers and within the joint limits."""
    if not np.isfinite(list(posture.values())).all():
        raise GraspAtlasError("the reference posture holds a number that is not finite")
    q, (lower, upper) = posture_array(hand, posture, "the reference posture"), hand.joint_limits
    for joint in hand.model.hand_joints:
        at = joint.q_index
        if joint.q_size == 1 and not lower[at] - LIMIT_TOLERANCE <= q[at] <= upper[at] + LIMIT_TOLERANCE:
            raise GraspAtlasError(
                f"the reference posture of problem '{name}' has joint '{joint.name}' at {q[at]:.4g}, outside "
                f"its limits [{lower[at]:.4g}, {upper[at]:.4g}]"
            )


def check_freedom(name: str, hand: Hand, contacts: Sequence[Contact], joint: ObjectJoint) -> None:
    """Raise GraspAtlasError unless a problem has more unknowns than contact equations."""
    unknowns = len(hand.mechanism.actuated) + joint.dof + sum(len(contact.free()) for contact in contacts)
    equations = len(contacts) * joint.contact_equations
    if equations >= unknowns:
        raise GraspAtlasError(
            f"problem '{name}' has {unknowns} unknowns and {equations} contact equations, which leave "
            "no freedom: free some patch parameters or drop a contact"
        )


def check_bounds(name: str, system: _core.GraspSystem, x1: Array) -> None:
    """Raise GraspAtlasError unless a problem's first grasp (size of x,) keeps all limits."""
    slack = system.slack(x1)
    if slack.size and slack.min() < -LIMIT_TOLERANCE:
        broken = [
            f"{bound} by {-s:.3g}" for bound, s in zip(system.bound_names, slack, strict=True) if s < -LIMIT_TOLERANCE
        ]
        raise GraspAtlasError(f"x1 of problem '{name}' breaks the {', the '.join(broken)} [rad or length_scale]")


def check_touch(name: str, system: _core.GraspSystem, contacts: Sequence[Contact], x1: Array) -> None:
    """Raise GraspAtlasError unless a problem's first grasp (size of x,) touches at all contacts, or nearly so."""
    arrays = system.grasp_arrays(x1[None])
    with np.errstate(over="ignore"):
        gaps = np.linalg.norm(arrays["hand_points"] - arrays["object_points"], axis=2)[0]
    cosines = np.sum(arrays["hand_normals"] * arrays["object_normals"], axis=2)[0]
    angles = np.arccos(np.clip(-cosines, -1.0, 1.0))
    if not ((gaps <= CONTACT_TOLERANCE).all() and (angles <= NORMAL_TOLERANCE).all()):
        rows = ", ".join(
            f"{contact.frame}: {1000.0 * gap:.3g} mm, {np.degrees(angle):.3g} degrees"
            for contact, gap, angle in zip(contacts, gaps, angles, strict=True)
        )
        raise GraspAtlasError(
            f"x1 of problem '{name}' misses its contacts ({rows}); at most {1000 * CONTACT_TOLERANCE:g} mm "
            f"and {np.degrees(NORMAL_TOLERANCE):.2g} degrees are allowed: correct the object's pose or the joints"
        )
