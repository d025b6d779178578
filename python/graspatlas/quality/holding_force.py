r"""How strong a disturbance a grasp withstands, in newtons: by friction, a budget of normal force, and joint efforts.

The contact forces :math:`f_i` balance a disturbance w at the object's centre of mass while

.. math:: G f + w = 0, \qquad \| f_i - n_i n_i^\top f_i \| \le \mu \, n_i^\top f_i, \qquad
    \sum_i n_i^\top f_i \le N, \qquad |J^\top f| \le \tau^{max}

with the inward normals :math:`n_i`, the budget N, and the joints' efforts where they are asked for. Soft fingers have
the limit surface of :func:`graspatlas.quality.force_closure_margin`. The hand controls its forces: joints exert what
the disturbance asks for, and nothing is said of those that friction and stiffness alone would cause.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from graspatlas import _core
from graspatlas.errors import GraspAtlasError, unknown_name
from graspatlas.execution.contact_forces import NORMAL_FORCE, actuated_efforts
from graspatlas.grasps.grasps import Grasps
from graspatlas.hand.hand import Hand
from graspatlas.problem.problem import Problem
from graspatlas.quality.batched import batched
from graspatlas.support.arrays import Array
from graspatlas.support.validation import number, number_array, positive

__all__ = ["GAP", "Efforts", "holding_force", "holding_limits", "resisted_load"]

#: Whether the efforts of the URDF limit the joints; or a limit for all, or by the name of an actuated joint [N m or N].
Efforts = bool | float | Mapping[str, float]
#: Relative difference from the largest force up to which the index is found.
GAP = 1e-5


@batched
def holding_force(
    grasps: Grasps,
    friction: float = 0.5,
    normal_force: float | None = None,
    torsional: float = 0.0,
    torque_length: float = 0.0,
    efforts: Efforts = False,
    gap: float = GAP,
) -> Array:
    r"""Largest force at the object's centre of mass, from any side, that a grasp withstands [N]; 0 without closure.

    .. math:: \max r \;:\; \forall \, \|w\| \le r \;\; \exists \, f_i \in \mathrm{cone}_i : \; G f + w = 0, \;\;
        \sum_i n_i^\top f_i \le N, \;\; |J^\top f| \le \tau^{max}

    the radius of the largest ball in the convex body of all disturbances that are withstood. They are forces without a
    torque about the centre of mass, ``object.center_of_mass``; or forces and torques, these divided by `torque_length`.
    Cones are round. The value is never above the true one, and at most by the relative `gap` below it; further below
    only where the refinement ends after 20,000 facets, as with torques it may for very symmetric grasps. It counts on a
    hand that adapts its forces to the disturbance. The weight of the object is a disturbance like any other: one of m
    kilogrammes is held in every attitude if the value is above 9.81 m.

    Args:
        grasps: The grasps.
        friction: Coefficient of friction mu.
        normal_force: N, the most that the normal forces may add up to [N]; 5 N a contact by default. Infinite where the
            efforts alone shall decide; then 10,000 times the normal force of a squeeze that brings the first joint to
            its effort stands for any.
        torsional: Torsional friction [m] of soft fingers; 0 for hard ones.
        torque_length: Length that divides torques of disturbances [m]; 0 for forces alone. With torques the body has
            six dimensions, and a value takes milliseconds: take a `gap` of 0.01.
        efforts: Limits of the actuated joints: False for none, True for those of the hand's URDF, where joints that
            state none have none; a number for all joints, or numbers by joint [N m, of joints that slide N].
        gap: Relative difference from the largest force, at most.

    Returns:
        One value for each grasp (n,), in newtons.

    Raises:
        GraspAtlasError: If an argument is out of its range, or efforts are asked for that the hand does not state.

    Source: C. Ferrari, J. Canny, "Planning Optimal Grasps", ICRA 1992, for the ball and the bound on the sum of normal
    forces; R. Krug, Y. Bekiroglu, M. A. Roa, "Grasp Quality Evaluation Done Right: How Assumed Contact Force Bounds
    Affect Wrench-Based Quality Metrics", ICRA 2017, for why the bounds of forces must be those of the hand.
    """
    limits = holding_limits(grasps.problem, friction, normal_force, torsional, torque_length, efforts, gap)
    return np.asarray(_core.holding_forces(grasps.system, grasps.x, limits))


def resisted_load(
    grasps: Grasps,
    direction: ArrayLike,
    friction: float = 0.5,
    normal_force: float | None = None,
    torsional: float = 0.0,
    efforts: Efforts = False,
) -> Array:
    """Largest force along a direction, at the object's centre of mass, that a grasp withstands [N]; 0 without closure.

    Args:
        grasps: The grasps.
        direction: Where the force on the object points, in the object's frame (3,), in the plane (2,); or a row for
            each grasp. Its length does not matter.
        friction: Coefficient of friction mu.
        normal_force: The most that the normal forces may add up to [N]; see :func:`holding_force`.
        torsional: Torsional friction [m] of soft fingers; 0 for hard ones.
        efforts: Limits of the actuated joints; see :func:`holding_force`.

    Returns:
        One value for each grasp (n,), in newtons, to one part in a million from below.

    Raises:
        GraspAtlasError: If an argument is out of its range, efforts are asked for that the hand does not state, or
            rounding leaves a value less certain.
    """
    axes, n = grasps.problem.object_joint_model.translations, len(grasps)
    given = number_array(direction, "direction")
    if given.shape not in ((axes,), (n, axes)) or not np.isfinite(given).all():
        raise GraspAtlasError(
            f"direction must hold {axes} finite numbers, or a row of them for each of {n} grasps; got the shape "
            f"{given.shape}"
        )
    lengths = np.linalg.norm(given, axis=-1, keepdims=True)
    if not (lengths > 0.0).all():
        raise GraspAtlasError("direction has the length 0; say where the force points")
    limits = holding_limits(grasps.problem, friction, normal_force, torsional, 0.0, efforts, GAP)
    directions = np.ascontiguousarray(np.broadcast_to(given / lengths, (n, axes)))
    loads = np.asarray(_core.resisted_loads(grasps.system, grasps.x, directions, limits))
    if np.isnan(loads).any():
        raise GraspAtlasError(
            f"the load that grasp {int(np.isnan(loads).argmax())} resists cannot be computed to one part in a million, "
            "because the grasp nearly loses force closure: require a margin of force closure"
        )
    return loads


def holding_limits(
    problem: Problem,
    friction: float = 0.5,
    normal_force: float | None = None,
    torsional: float = 0.0,
    torque_length: float = 0.0,
    efforts: Efforts = False,
    gap: float = GAP,
) -> _core.HoldingLimits:
    """What the compiled core is told of what holds the object; arguments, defaults and errors of :func:`holding_force`.

    Args:
        problem: The problem.
        friction: Coefficient of friction mu.
        normal_force: The most that the normal forces may add up to [N].
        torsional: Torsional friction [m].
        torque_length: Length that divides torques of disturbances [m].
        efforts: Limits of the actuated joints.
        gap: Relative difference from the largest force, at most.
    """
    hand, limited = problem.hand, efforts is not False
    if normal_force is None:
        budget = NORMAL_FORCE * len(problem.contacts)
    elif limited and number(normal_force, "normal_force") == np.inf:
        budget = np.inf
    else:
        budget = positive(normal_force, "normal_force")
    return _core.HoldingLimits(
        friction=positive(friction, "friction"),
        torsional=number(torsional, "torsional"),
        normal_force=budget,
        efforts=_efforts(hand, efforts) if limited else np.zeros(0),
        center_of_mass=problem.object.center_of_mass,
        torque_length=number(torque_length, "torque_length"),
        gap=_gap(gap),
    )


def _efforts(hand: Hand, efforts: Efforts) -> Array:
    """Effort of each actuated joint [N m or N], infinite where there is no limit."""
    actuated = hand.mechanism.actuated
    if efforts is True:
        stated = actuated_efforts(hand)
        if np.isnan(stated).all():
            raise GraspAtlasError(
                f"the URDF of hand '{hand.name}' has no effort limit of an actuated joint: add <limit effort=...> "
                "[N m or N], or give efforts=3.0 or by joint"
            )
        return np.where(np.isnan(stated), np.inf, stated)
    if not isinstance(efforts, Mapping):
        return np.full(len(actuated), positive(efforts, "efforts"))
    for name in efforts:
        if name not in actuated:
            raise unknown_name("joint", name, actuated, f"an actuated one of hand '{hand.name}'")
    if not efforts:
        raise GraspAtlasError("efforts names no joint; leave it out, or state some")
    return np.array([positive(efforts[n], f"effort of joint '{n}'") if n in efforts else np.inf for n in actuated])


def _gap(value: float) -> float:
    """The relative difference that is asked for; below :data:`GAP` rounding makes values too small.

    Raises:
        GraspAtlasError: If it is out of its range.
    """
    if not positive(value, "gap", 0.5) >= GAP:
        raise GraspAtlasError(f"gap must be at least {GAP:g}, got {value:g}: leave it out for the finest that there is")
    return float(value)
