"""How far contact forces can stay inside their friction cones while they hold the object."""

from __future__ import annotations

import numpy as np

from graspatlas import _core
from graspatlas.grasps.grasps import Grasps
from graspatlas.quality.batched import batched
from graspatlas.support.arrays import Array
from graspatlas.support.validation import number, positive

__all__ = ["force_closure_margin", "force_closure_slack"]


@batched
def force_closure_margin(grasps: Grasps, friction: float = 0.5, torsional: float = 0.0) -> Array:
    r"""Distance of the contact forces from their friction cones that internal forces allow; 0 without force closure.

    .. math:: \max_{G f = 0,\; \sum_i n_i^\top f_i = 1} \; \min_i \;
        \frac{\mu \, n_i^\top f_i - \| f_i - n_i n_i^\top f_i \|}{\sqrt{1 + \mu^2}}

    The margin has no unit: normal forces add up to one. It is exact for round cones (a second-order cone programme).
    Soft fingers also resist a torque :math:`\tau_i` about the normal, up to an ellipsoidal friction limit surface: with
    torsional friction :math:`\gamma` the norm is that of the tangential force and :math:`\mu \tau_i / \gamma` together.

    Args:
        grasps: The grasps.
        friction: Coefficient of friction mu.
        torsional: Torsional friction gamma [m], the largest torque about the normal that a normal force of one allows;
            0 for hard fingers, of which it takes three to close a grasp in space.

    Returns:
        One value for each grasp (n,).

    Source: Force closure as in V.-D. Nguyen, "Constructing Force-Closure Grasps", IJRR 1988, the paper's reference 14.
    """
    mu = positive(friction, "friction")
    return np.asarray(_core.force_closure_margins(grasps.system, grasps.x, mu, number(torsional, "torsional")))


def force_closure_slack(grasps: Grasps, friction: float = 0.5, torsional: float = 0.0) -> Array:
    """The force-closure margin with its sign: negative where internal forces exist but leave their cones.

    It has the formula of :func:`force_closure_margin` and equals it where that is positive, so that it serves as a
    constraint, continuous from one side of force closure to the other. It costs several times as much.

    Args:
        grasps: The grasps.
        friction: Coefficient of friction mu.
        torsional: Torsional friction [m]; 0 for hard fingers.

    Returns:
        One value for each grasp (n,); minus infinity where G has lost rank, or where no internal forces press on the
        object at all.
    """
    mu = positive(friction, "friction")
    return np.asarray(_core.force_closure_slacks(grasps.system, grasps.x, mu, number(torsional, "torsional")))
