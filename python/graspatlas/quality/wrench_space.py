"""Indices of the wrenches that the contacts can exert on the object: how well, and how evenly, they hold it.

The wrenches themselves are in :mod:`graspatlas.quality.wrenches`.
"""

from __future__ import annotations

import numpy as np

from graspatlas.errors import GraspAtlasError
from graspatlas.grasps.grasps import Grasps
from graspatlas.problem.problem import Problem
from graspatlas.quality import wrenches
from graspatlas.quality.batched import batched
from graspatlas.support.arrays import Array
from graspatlas.support.validation import positive

__all__ = [
    "ferrari_canny_epsilon",
    "ferrari_canny_volume",
    "grasp_isotropy",
    "min_weight",
    "soft_finger_epsilon",
    "torque_divisor",
]

#: Arguments of the indices where none are given: friction, torsional friction of soft fingers [m], edges of pyramids.
FRICTION, TORSIONAL, EDGES = 0.5, 0.005, 8
#: A singular value of G this far below the largest is zero.
RANK_TOLERANCE = 1e-9


def _contacts(grasps: Grasps) -> tuple[Array, Array]:
    """Contact points and outward normals (n, m, 3) in the object's frame: torques are about its origin."""
    R, origin = grasps.T_palm_object[:, :3, :3], grasps.T_palm_object[:, None, :3, 3]
    return (grasps.contact_points - origin) @ R, grasps.contact_normals @ R


def torque_divisor(problem: Problem, length_unit: float | None = None) -> float:
    """The length that divides torques: that given, or the one of the problem, which is the same for all its grasps [m].

    Args:
        problem: The problem.
        length_unit: The length given [m].

    Raises:
        GraspAtlasError: If the length is not positive, or the problem has none.
    """
    if length_unit is not None:
        return positive(length_unit, "length_unit")
    length = problem.torque_arm
    if not length > 0.0:
        raise GraspAtlasError(
            f"all contacts of problem '{problem.name}' lie at the object's origin, which leaves no length to "
            "divide torques by; move that origin, state torque_length in the problem or give length_unit [m]"
        )
    return length


def _wrenches(grasps: Grasps, friction: float, edges: int, length_unit: float | None, torsional: float = 0.0) -> Array:
    length = torque_divisor(grasps.problem, length_unit)
    return wrenches.contact_wrenches(
        *_contacts(grasps), friction, edges, length, grasps.problem.object_joint_model.planar, torsional
    )


@batched
def ferrari_canny_epsilon(
    grasps: Grasps, friction: float = FRICTION, length_unit: float | None = None, edges: int | None = EDGES
) -> Array:
    r"""Largest push and twist, from any side, that contacts with unit total normal force resist; 0 without closure.

    .. math:: \epsilon = \min_{|w| = 1} \; \max_{v \in W} \; w^\top v, \qquad W = \mathrm{conv} \bigcup_i
        \{ (f, \; p_i \times f / \lambda) \;:\; n_i^\top f = 1, \; f \in \mathrm{cone}_i \}

    the radius of the largest ball around the origin in the hull of all contact wrenches (Ferrari and Canny's L1 space).
    Torques are about the object's origin. The value has no unit: normal forces add up to one, and torques are in units
    of lambda. Pyramids lie inside their cones, so epsilon grows with their edges, towards that of round cones.

    Args:
        grasps: The grasps.
        friction: Coefficient of friction mu.
        length_unit: Lambda, the length that divides torques [m]; by default ``problem.torque_arm``, the largest
            distance from the object's origin at which a contact may touch the object, so that the largest torque of a
            unit force is about one. It is the same for all grasps of a problem, and does not depend on x1.
        edges: Edges of the friction pyramids. None takes the cones round, to one part in ten thousand from
            below, which for very symmetric grasps takes up to a second each. In the plane both are the same.

    Returns:
        One value for each grasp (n,).

    Raises:
        GraspAtlasError: If an argument is out of its range.

    Source: C. Ferrari, J. Canny, "Planning Optimal Grasps", ICRA 1992, with the normal forces' sum as the bound.
    """
    if edges is None and not grasps.problem.object_joint_model.planar:
        axes = wrenches.contact_axes(*_contacts(grasps), torque_divisor(grasps.problem, length_unit))
        return wrenches.round_ball_radius(axes, friction)
    return wrenches.ball_radius(_wrenches(grasps, friction, EDGES if edges is None else edges, length_unit))


@batched
def soft_finger_epsilon(
    grasps: Grasps,
    friction: float = FRICTION,
    torsional: float = TORSIONAL,
    length_unit: float | None = None,
    edges: int = EDGES,
) -> Array:
    """The epsilon of :func:`ferrari_canny_epsilon` with soft fingers, the index for grippers with two flat pads.

    Two hard fingers never close a grasp in space: nothing resists a torque about the line through them. A pad that is
    pressed flat does, up to a torque about its normal of `torsional` times the normal force. The friction limit surface
    is linearised, so the value is a little below that of the ellipsoid.

    Args:
        grasps: The grasps.
        friction: Coefficient of friction mu.
        torsional: Torsional friction [m]: about mu times two thirds of the radius of the patch of contact.
        length_unit: The length that divides torques [m]; see :func:`ferrari_canny_epsilon`.
        edges: Edges of the friction pyramids.

    Returns:
        One value for each grasp (n,).

    Raises:
        GraspAtlasError: If an argument is out of its range.

    Source: R. D. Howe, M. R. Cutkosky, "Practical Force-Motion Models for Sliding Manipulation", IJRR 1996, for the
    friction limit surface; under even pressure a disc of radius a resists 2/3 mu a for each unit of normal force.
    """
    return wrenches.ball_radius(_wrenches(grasps, friction, edges, length_unit, torsional))


@batched
def ferrari_canny_volume(
    grasps: Grasps, friction: float = FRICTION, length_unit: float | None = None, edges: int = EDGES
) -> Array:
    """Volume of the hull of all contact wrenches, unit total normal force; 0 without force closure.

    The hull is that of :func:`ferrari_canny_epsilon`. The volume has no unit, forces being parts of the total normal
    force and torques parts of that times `length_unit`; unlike epsilon it orders grasps alike whatever that length is.

    Args:
        grasps: The grasps.
        friction: Coefficient of friction mu.
        length_unit: The length that divides torques [m]; see :func:`ferrari_canny_epsilon`.
        edges: Edges of the friction pyramids.

    Returns:
        One value for each grasp (n,).

    Raises:
        GraspAtlasError: If an argument is out of its range.

    Source: A. T. Miller, P. K. Allen, "Examples of 3D Grasp Quality Computations", ICRA 1999.
    """
    hulls = _wrenches(grasps, friction, edges, length_unit)
    closed = wrenches.ball_radius(hulls) > 0.0
    volumes = np.zeros(len(grasps))
    volumes[closed] = wrenches.hull_volume(hulls[closed])
    return volumes


@batched
def min_weight(grasps: Grasps, friction: float = FRICTION, edges: int = EDGES) -> Array:
    r"""Least share of any friction-cone edge in internal forces that use all edges, from 0, no closure, to 1.

    .. math:: w \max \{ l \;:\; \sum_j \alpha_j w_j = 0, \; \sum_j \alpha_j = 1, \; \alpha_j \ge l \}

    over the wrenches :math:`w_j` of the w edges of all friction pyramids: the metric :math:`l^*` of FRoGGeR, times the
    number of edges so that 1 is the most it can be. No length divides torques: it would change nothing. It has no unit.

    Args:
        grasps: The grasps.
        friction: Coefficient of friction mu.
        edges: Edges of the friction pyramids; FRoGGeR takes 4. In the plane cones have two.

    Returns:
        One value for each grasp (n,).

    Raises:
        GraspAtlasError: If an argument is out of its range.

    Source: A. H. Li, P. Culbertson, J. W. Burdick, A. D. Ames, "FRoGGeR: Fast Robust Grasp Generation via the
    Min-Weight Metric", IROS 2023.
    """
    return wrenches.min_weight(_wrenches(grasps, friction, edges, None))


@batched
def grasp_isotropy(grasps: Grasps, length_unit: float | None = None) -> Array:
    r"""Smallest over largest singular value of G: 1 is forces that act alike in all directions, 0 a singular G.

    .. math:: \sigma_\min(G) / \sigma_\max(G), \quad \text{torques divided by a length}

    Args:
        grasps: The grasps.
        length_unit: The length that divides torques [m]; see :func:`ferrari_canny_epsilon`.

    Returns:
        One value, without unit, for each grasp (n,).

    Raises:
        GraspAtlasError: If the length is not positive.

    Source: B.-H. Kim et al., "Optimal Grasping Based on Non-Dimensionalized Performance Indices", IROS 2001; M. A. Roa,
    R. Suárez, "Grasp Quality Measures: Review and Performance", Autonomous Robots 38 (2015), grasp isotropy index.
    """
    G = grasps.G.copy()
    forces = grasps.problem.object_joint_model.translations
    G[:, forces:] /= torque_divisor(grasps.problem, length_unit)
    sigma = np.linalg.svd(G, compute_uv=False)[:, : G.shape[1]]
    if sigma.shape[1] < G.shape[1]:
        return np.zeros(len(grasps))
    ratio = sigma[:, -1] / sigma[:, 0]
    return np.asarray(np.where(ratio > RANK_TOLERANCE, ratio, 0.0))
