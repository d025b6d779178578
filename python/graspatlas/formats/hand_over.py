"""What others need to execute grasps: names, postures before, at and beyond the contacts, and poses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from graspatlas.errors import GraspAtlasError
from graspatlas.execution.pregrasp import DISTANCE
from graspatlas.grasps.grasps import Grasps
from graspatlas.result.exports import Selection
from graspatlas.support.arrays import Array
from graspatlas.support.validation import positive

__all__ = ["HandOver", "hand_over"]


@dataclass(frozen=True, eq=False)
class HandOver:
    """Grasps with all that it takes to execute them; n grasps, h joints.

    Attributes:
        selection: The grasps, and what the result knows of each.
        names: One for each: ``chart_1234``, ``refined``.
        pregrasp: Joint positions before closing (n, h) [rad or m].
        grasp: At the contacts (n, h).
        squeeze: Targets with which position actuators exert the contact forces (n, h).
        torques: Torques of the joints that exert these forces (n, h) [N m or N]; 0 of joints that mimic others.
        normal_force: Sum of the normal forces [N].
        stiffness: Of the position actuators [N m/rad].
    """

    selection: Selection
    names: tuple[str, ...]
    pregrasp: Array
    grasp: Array
    squeeze: Array
    torques: Array
    normal_force: float
    stiffness: float

    def __len__(self) -> int:
        return len(self.names)

    @property
    def grasps(self) -> Grasps:
        """The grasps (n)."""
        return self.selection.grasps

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the joints (h,)."""
        return self.grasps.joints


def hand_over(
    selection: Selection,
    *,
    distance: float = DISTANCE,
    normal_force: float | None = None,
    friction: float = 0.5,
    torsional: float = 0.0,
    stiffness: float = 5.0,
) -> HandOver:
    """Add pregrasp and squeeze to grasps.

    Args:
        selection: The grasps; see :func:`graspatlas.result.exports.select`.
        distance: From the object at which the fingertips begin [m]; see :meth:`Grasp.pregrasp`.
        normal_force: Sum of the normal forces of the squeeze [N]; by default 5 N a contact.
        friction: Coefficient of friction for the contact forces.
        torsional: Torsional friction [m] of soft fingers.
        stiffness: Of the position actuators [N m/rad].

    Raises:
        GraspAtlasError: If friction does not close one of the grasps, a hand has joints with more than one degree of
            freedom, or an argument is out of its range.
    """
    grasps = selection.grasps
    _check_joints(grasps)
    names = tuple(
        "refined" if refined else f"chart_{chart}"
        for chart, refined in zip(selection.charts, selection.refined, strict=True)
    )
    forces = grasps.contact_forces(normal_force=normal_force, friction=friction, torsional=torsional)
    loose = np.isnan(forces.joint_torques).any(axis=1)
    if loose.any():
        raise GraspAtlasError(
            f"{int(loose.sum())} of {len(grasps)} grasps, such as {names[loose.argmax()]}, have no force closure with "
            f"friction {friction:g}, so there are no internal forces to squeeze with; take grasps that meet "
            "force_closure, or state the friction there is"
        )
    targets = grasps.squeeze(
        positive(stiffness, "stiffness"), normal_force=normal_force, friction=friction, torsional=torsional
    )
    torques = np.zeros((len(grasps), len(grasps.joints)))
    torques[:, [grasps.joints.index(joint) for joint in forces.joints]] = forces.joint_torques
    before = grasps.pregrasps(distance)
    return HandOver(
        selection=selection,
        names=names,
        pregrasp=np.array([[posture.joint_positions[joint] for joint in grasps.joints] for posture in before]),
        grasp=np.column_stack([grasps.joint_positions[joint] for joint in grasps.joints]),
        squeeze=np.column_stack([targets[joint] for joint in grasps.joints]),
        torques=torques,
        normal_force=float(forces.total_normal_force[0]),
        stiffness=stiffness,
    )


def _check_joints(grasps: Grasps) -> None:
    for joint in grasps.problem.hand.model.hand_joints:
        if joint.v_size != 1:
            raise GraspAtlasError(
                f"joint '{joint.name}' has {joint.v_size} degrees of freedom; these formats state one number a joint"
            )
