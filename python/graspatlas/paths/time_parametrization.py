"""When a hand that follows a path passes each of its points, no joint faster than it may be."""

from __future__ import annotations

from collections.abc import Mapping
from numbers import Real

import numpy as np

from graspatlas.errors import GraspAtlasError
from graspatlas.hand.hand import Hand
from graspatlas.hand.urdf import velocity_limits
from graspatlas.support.arrays import Array
from graspatlas.support.validation import shown

__all__ = ["URDF", "passing_times", "speed_limits"]


#: Word for the velocity limits of the hand's URDF.
URDF = "urdf"
#: A step between two points takes at least this long, so that times grow where only the object moves [s].
SHORTEST_STEP = 1e-6


def passing_times(hand: Hand, positions: Mapping[str, Array], joint_speed: float | str = URDF) -> Array:
    """When each point of a path is passed: every step takes as long as its slowest joint needs.

    Speeds are limited, accelerations are not: the hand begins, turns and stops at once. A controller that cannot has to
    smooth the trajectory, or to follow it slowly.

    Args:
        hand: The hand.
        positions: Position of each of its joints along the path, [n] each, without jumps [rad or m].
        joint_speed: See :func:`speed_limits`.

    Returns:
        Times [n], seconds, from 0 and growing.

    Raises:
        GraspAtlasError: As of :func:`speed_limits`.
    """
    limits = speed_limits(hand, joint_speed)
    seconds = np.array([np.abs(np.diff(positions[joint])) / limit for joint, limit in limits.items()])
    return np.concatenate([[0.0], np.cumsum(np.maximum(seconds.max(axis=0), SHORTEST_STEP))])


def speed_limits(hand: Hand, joint_speed: float | str = URDF) -> dict[str, float]:
    """Largest speed of each joint by name [rad/s or m/s].

    Args:
        hand: The hand.
        joint_speed: Largest speed of every joint [rad/s or m/s], or ``"urdf"`` for the velocity limits of the hand's
            URDF, which also hold when a larger number is given.

    Raises:
        GraspAtlasError: If `joint_speed` is neither, or the URDF states no limit for a joint and is to be followed.
    """
    stated = velocity_limits(hand.urdf)
    if joint_speed == URDF:
        without = [name for name in hand.joints if name not in stated]
        if without:
            raise GraspAtlasError(
                f"the URDF of hand '{hand.name}' states no velocity limit for joint '{without[0]}'; give a joint speed "
                "[rad/s or m/s]"
            )
        return {name: stated[name] for name in hand.joints}
    if isinstance(joint_speed, bool) or not isinstance(joint_speed, Real) or not 0.0 < float(joint_speed) < np.inf:
        raise GraspAtlasError(
            f"joint_speed must be a positive number [rad/s or m/s] or '{URDF}', got {shown(joint_speed)}"
        )
    return {name: min(float(joint_speed), stated.get(name, np.inf)) for name in hand.joints}
