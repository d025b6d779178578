r"""Joint targets with which position actuators exert contact forces.

An actuator of stiffness k that the object holds at q exerts the torque :math:`k (q_{target} - q)`; so the targets are

.. math:: q_{target} = q + K^{-1} J^\top f

Source: the squeeze pose of Dexonomy (J. Chen et al., RSS 2025), which moves joint targets along :math:`J^\top f`.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from graspatlas.errors import GraspAtlasError, unknown_name
from graspatlas.execution.contact_forces import ContactForces
from graspatlas.hand.hand import Hand
from graspatlas.support.arrays import Array
from graspatlas.support.validation import positive

__all__ = ["Stiffness", "squeeze"]

#: Stiffness of position actuators: one for all, or by the name of the actuated joint [N m/rad or N/m].
Stiffness = float | Mapping[str, float]


def squeeze(
    hand: Hand, positions: Mapping[str, Array], forces: ContactForces, stiffness: Stiffness
) -> dict[str, Array]:
    """Targets of all joints [rad or m], those that mimic others as their drivers have them; joint limits play no part.

    Args:
        hand: The hand.
        positions: Joint positions in the grasps by name, one number or (n,) each [rad or m].
        forces: The contact forces of the same grasps.
        stiffness: Of the position actuators [N m/rad], of joints that slide [N/m]; one for all, or by joint.

    Returns:
        Positions by name, NaN where a grasp cannot hold.

    Raises:
        GraspAtlasError: If a stiffness is not positive, or that of an actuated joint is missing.
    """
    gains = _gains(hand, stiffness)
    targets = {
        name: np.asarray(positions[name] + torque / gains[name])
        for name, torque in zip(forces.joints, np.moveaxis(forces.joint_torques, -1, 0), strict=True)
    }
    for mimic in hand.mechanism.mimics:
        targets[mimic.joint] = mimic.multiplier * targets[mimic.driver] + mimic.offset
    return {name: targets[name] for name in hand.joints}


def _gains(hand: Hand, stiffness: Stiffness) -> dict[str, float]:
    """Stiffness of each actuated joint, by name."""
    actuated = hand.mechanism.actuated
    if not isinstance(stiffness, Mapping):
        return dict.fromkeys(actuated, positive(stiffness, "stiffness"))
    for name in stiffness:
        if name not in actuated:
            raise unknown_name("joint", name, actuated, f"an actuated one of hand '{hand.name}'")
    for name in actuated:
        if name not in stiffness:
            raise GraspAtlasError(f"stiffness of joint '{name}' is missing; state all of {', '.join(actuated)}, or one")
    return {name: positive(stiffness[name], f"stiffness of joint '{name}'") for name in actuated}
