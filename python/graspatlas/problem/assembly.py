"""From hand, object, contacts and hand motions to the systems of equations that are solved: eqs (7) to (13)."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np

from graspatlas import _core
from graspatlas.hand.hand import Hand
from graspatlas.hand.motions import HandMotions
from graspatlas.problem.contacts import Contact
from graspatlas.problem.object_joint import ObjectJoint
from graspatlas.support.arrays import Array
from graspatlas.support.validation import read_only

__all__ = ["frozen_residual", "grasp_system", "jacobian_rank", "joint_units", "mimic_residual", "random_points"]

#: Singular values smaller than this share of the largest count as zero.
RANK_TOLERANCE = 1e-8
#: Random configurations at which the rank of the contact equations is looked at when there is no x1.
RANK_TRIES = 5


def joint_units(hand: Hand, length_scale: float) -> Array:
    """Joint velocity that counts as one (nv,): a radian, or length_scale [m] for prismatic joints."""
    units = np.ones(hand.model.hand_v_size)
    for joint in hand.model.hand_joints:
        if joint.prismatic:
            units[joint.v_index] = length_scale
    return read_only(units)


def grasp_system(
    hand: Hand, contacts: Sequence[Contact], joint: ObjectJoint, motions: Array, length_scale: float, room: float = 0.0
) -> _core.GraspSystem:
    """The contact equations of all grasps that some hand motions allow.

    Args:
        hand: The hand.
        contacts: The contacts.
        joint: How the object moves.
        motions: The hand motions that are kept, columns of joint velocities (nv, p).
        length_scale: Length that counts as much as one radian [m].
        room: Share of each range, of a joint or of a patch parameter, to keep off either of its ends.
    """
    model, mechanism, units = joint.model(hand.tree), hand.mechanism, joint_units(hand, length_scale)
    if mechanism.mimics or (units != 1.0).any():
        orthonormal, R = np.linalg.qr(motions / units[:, None])
        motions = units[:, None] * orthonormal * np.sign(np.diag(R))
    sides = []
    for contact in contacts:
        of_hand, of_object = contact.sides
        carrier, T = hand.frame(contact.frame)
        sides.append((of_hand.core(carrier, T, room), of_object.core(model.object_joint, np.eye(4), room)))
    lower, upper = hand.binding_limits
    kept_off = room * np.where(np.isfinite(upper - lower), upper - lower, 0.0)
    limits = list(lower + kept_off), list(upper - kept_off)
    return _core.GraspSystem(model, sides, motions, length_scale, *limits, mechanism.transmission)


def jacobian_rank(J: Array) -> int:
    """Rank of a Jacobian."""
    singular = np.linalg.svd(J, compute_uv=False)
    return int((singular > RANK_TOLERANCE * singular[0]).sum())


def random_points(system: _core.GraspSystem, q: Array, joint: ObjectJoint, count: int = RANK_TRIES) -> list[Array]:
    """Configurations near a posture q (nq,) that touch nothing; their bounds are not looked at."""
    rng = np.random.default_rng(0)
    x = np.r_[q, joint.neutral, np.zeros(system.n_parameters)]
    return [system.integrate(x, rng.normal(size=system.tangent_size)) for _ in range(count)]


def frozen_residual(hand: Hand, motions: HandMotions, reference: Array, s: int, X: Array) -> Array:
    """Eq (13), E_s' (q_hand - reference), at grasps X (n, size of x): (n, s), zero on R.

    Args:
        hand: The hand.
        motions: Its hand motions.
        reference: The reference posture (nq,).
        s: How many of them are frozen, joints that mimic others aside.
        X: The grasps.
    """
    E_s = hand.mechanism.constrained(motions).frozen(s + len(hand.mechanism.mimics))
    residuals = np.array([hand.joint_steps(reference, x[: len(reference)]) @ E_s for x in X])
    # A continuous joint may have gone round: of all its turns, the one that fits.
    turning = [joint.v_index for joint in hand.model.hand_joints if joint.q_size == 2 and joint.v_size == 1]
    turns = np.array(list(product((0, -1, 1), repeat=len(turning)))) * 2.0 * np.pi
    candidates = residuals[:, None, :] + turns @ E_s[turning]
    fitting = np.abs(candidates).max(axis=2).argmin(axis=1)
    return np.asarray(candidates[np.arange(len(X)), fitting])


def mimic_residual(hand: Hand, X: Array) -> Array:
    """q_joint - multiplier q_driver - offset of the joints that mimic others, at grasps X: (n, m), zero on F."""
    named = [hand.joint_positions(x[: hand.model.hand_q_size]) for x in X]
    positions = np.array([[q[name] for name in hand.joints] for q in named])
    return hand.mechanism.residual(positions.reshape(-1, len(hand.joints)))
