r"""Indices of how the hand can move: the object, by its manipulability ellipsoid, and the joints, by their limits.

The ellipsoid's semi-axes are the inverses of the singular values of :math:`J^+ G^\top` over the coordinated motions,
with lengths in millimetres.

Source: Bicchi and Prattichizzo, "Manipulability of cooperating robots with unactuated joints and closed-chain
mechanisms", 2000.
"""

from __future__ import annotations

import numpy as np

from graspatlas import _core
from graspatlas.grasps.grasps import Grasps
from graspatlas.quality.batched import batched
from graspatlas.support.arrays import Array
from graspatlas.support.validation import positive

__all__ = ["inverse_condition_number", "joint_centrality", "manipulability_volume", "smallest_semi_axis"]


def _axes(grasps: Grasps, length_unit: float) -> Array:
    """Semi-axes over the motions that are usually coordinated (n, connectivity); zero where a grasp has lost one.

    What is usual is the largest connectivity of x1, if there is one, and of the grasps at hand.
    """
    positive(length_unit, "length_unit")
    x1 = [] if grasps.problem.x1 is None else [grasps.problem.x1_array]
    axes = np.asarray(_core.semi_axes(grasps.system, np.vstack([*x1, grasps.x]), length_unit))
    connectivity = int((axes > 0.0).sum(axis=1).max())
    return axes[len(x1) :, axes.shape[1] - connectivity :]


@batched
def inverse_condition_number(grasps: Grasps, length_unit: float = Grasps.LENGTH_UNIT) -> Array:
    """Smallest over largest semi-axis of the manipulability ellipsoid, lengths in mm; 0 is a singular grasp.

    Args:
        grasps: The grasps.
        length_unit: Unit of lengths in the object's velocity [m]; millimetres by default.

    Returns:
        One value for each grasp (n,).

    Source: "Global Optimization of Robotic Grasps", Section V, first index.
    """
    axes = _axes(grasps, length_unit)
    if axes.shape[1] == 0:
        return np.zeros(len(grasps))
    largest = axes[:, -1]
    return np.divide(axes[:, 0], largest, out=np.zeros(len(grasps)), where=largest > 0.0)


@batched
def manipulability_volume(grasps: Grasps, length_unit: float = Grasps.LENGTH_UNIT) -> Array:
    """Product of the ellipsoid's semi-axes, translations [mm] and rotations; unbounded near indeterminacy.

    Near a grasp that leaves the object loose, one semi-axis grows without bound: ask for force closure first.

    Args:
        grasps: The grasps.
        length_unit: Unit of lengths in the object's velocity [m]; millimetres by default.

    Returns:
        One value for each grasp (n,).

    Source: "Global Optimization of Robotic Grasps", Section V, second index.
    """
    axes = _axes(grasps, length_unit)
    return np.asarray(axes.prod(axis=1)) if axes.shape[1] else np.zeros(len(grasps))


@batched
def smallest_semi_axis(grasps: Grasps, length_unit: float = Grasps.LENGTH_UNIT) -> Array:
    """Smallest semi-axis of the manipulability ellipsoid, lengths in mm.

    Args:
        grasps: The grasps.
        length_unit: Unit of lengths in the object's velocity [m]; millimetres by default.

    Returns:
        One value for each grasp (n,).

    Source: "Global Optimization of Robotic Grasps", Section V, third index.
    """
    axes = _axes(grasps, length_unit)
    return axes[:, 0].copy() if axes.shape[1] else np.zeros(len(grasps))


@batched
def joint_centrality(grasps: Grasps) -> Array:
    r"""How near the joints are to the middle of their ranges: 1 where all are there, 0 where all are at a limit.

    .. math:: 1 - \frac{1}{h} \sum_{j=1}^h \left( \frac{q_j - \bar q_j}{(q_j^{max} - q_j^{min}) / 2} \right)^2

    A joint without two limits counts as in the middle. The value has no unit.

    Args:
        grasps: The grasps.

    Returns:
        One value for each grasp (n,).

    Source: M. A. Roa, R. Suárez, "Grasp Quality Measures: Review and Performance", Autonomous Robots 38 (2015), the
    measure of the fingers' posture, after A. Liégeois, IEEE T-SMC 7 (1977); here turned so that larger is better.
    """
    hand = grasps.problem.hand
    single = [joint.q_index for joint in hand.model.hand_joints if joint.q_size == 1]
    lower, upper = (limits[single] for limits in hand.joint_limits)
    half = (upper - lower) / 2.0
    limited = np.isfinite(half) & (half > 0.0)
    deviation = (grasps.q[:, single] - (lower + upper) / 2.0)[:, limited] / half[limited]
    return np.asarray(1.0 - (deviation**2).sum(axis=1) / max(len(hand.model.hand_joints), 1))
