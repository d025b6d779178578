r"""Quality indices of grasps.

An index is a function of grasps: larger is better, and a grasp to which it does not apply has 0. The first three read
the manipulability ellipsoid of the object (Bicchi and Prattichizzo 2000): its semi-axes are the inverses of the
singular values of :math:`J^+ G^\top` over the coordinated motions, with lengths in millimetres. The others ask how well
contact forces hold the object (see :mod:`graspatlas.quality.wrenches`), how evenly they act on it, and how free the
joints are to move.

Your own index is any function of one :class:`~graspatlas.grasps.Grasp` that returns a finite number. One that takes a
whole :class:`~graspatlas.grasps.Grasps` batch and returns an array [n] is marked by :func:`batched`. It cannot write to
the arrays that it gets::

    @ga.batched
    def spread(grasps):
        points = grasps.contact_points                      # [n, m, 3]
        return np.linalg.norm(points - points.mean(axis=1, keepdims=True), axis=2).min(axis=1)
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from graspatlas import _core
from graspatlas.errors import GraspAtlasError, unknown_name
from graspatlas.grasps.callables import called_numbers
from graspatlas.grasps.grasps import Grasps
from graspatlas.quality import wrenches
from graspatlas.quality.wrenches import checked_positive
from graspatlas.support.validation import number

__all__ = [
    "INDICES",
    "Quality",
    "batched",
    "evaluate",
    "ferrari_canny_epsilon",
    "ferrari_canny_volume",
    "force_closure_margin",
    "force_closure_slack",
    "grasp_isotropy",
    "inverse_condition_number",
    "joint_centrality",
    "manipulability_volume",
    "min_weight",
    "quality_name",
    "smallest_semi_axis",
    "soft_finger_epsilon",
]

Array = NDArray[np.float64]
Quality = str | Callable[[Any], Any]
F = TypeVar("F", bound=Callable[[Grasps], Any])

#: A singular value of G this far below the largest is zero.
RANK_TOLERANCE = 1e-9


def batched(index: F) -> F:
    """Mark a quality index as one that takes a :class:`Grasps` batch and returns an array [n]."""
    index.batched = True  # type: ignore[attr-defined]
    return index


def _axes(grasps: Grasps, length_unit: float) -> Array:
    """Semi-axes over the motions that are usually coordinated [n, connectivity]; zero where a grasp has lost one.

    What is usual is the largest connectivity of x1, if there is one, and of the grasps at hand.
    """
    if not 0.0 < number(length_unit, "length_unit") < np.inf:
        raise GraspAtlasError(f"length_unit must be positive, got {length_unit}")
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
        One value for each grasp [n].

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
        One value for each grasp [n].

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
        One value for each grasp [n].

    Source: "Global Optimization of Robotic Grasps", Section V, third index.
    """
    axes = _axes(grasps, length_unit)
    return axes[:, 0].copy() if axes.shape[1] else np.zeros(len(grasps))


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
        One value for each grasp [n].

    Source: Force closure as in V.-D. Nguyen, "Constructing Force-Closure Grasps", IJRR 1988, the paper's reference 14.
    """
    mu = checked_positive(friction, "friction")
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
        One value for each grasp [n]; minus infinity where G has lost rank, or where no internal forces press on the
        object at all.
    """
    mu = checked_positive(friction, "friction")
    return np.asarray(_core.force_closure_slacks(grasps.system, grasps.x, mu, number(torsional, "torsional")))


def _contacts(grasps: Grasps) -> tuple[Array, Array]:
    """Contact points and outward normals [n, m, 3] in the object's frame: torques are about its origin."""
    R, origin = grasps.T_palm_object[:, :3, :3], grasps.T_palm_object[:, None, :3, 3]
    return (grasps.contact_points - origin) @ R, grasps.contact_normals @ R


def _planar(grasps: Grasps) -> bool:
    return bool(grasps.G.shape[1] == 3)


def _length(grasps: Grasps, length_unit: float | None) -> float:
    """The length that divides torques: that given, or the one of the problem, which is the same for all its grasps."""
    if length_unit is not None:
        return checked_positive(length_unit, "length_unit")
    length = grasps.problem.torque_arm
    if not length > 0.0:
        raise GraspAtlasError(
            f"all contacts of problem '{grasps.problem.name}' lie at the object's origin, which leaves no length to "
            "divide torques by; move that origin, state torque_length in the problem or give length_unit [m]"
        )
    return length


def _wrenches(grasps: Grasps, friction: float, edges: int, length_unit: float | None, torsional: float = 0.0) -> Array:
    length = _length(grasps, length_unit)
    return wrenches.contact_wrenches(*_contacts(grasps), friction, edges, length, _planar(grasps), torsional)


@batched
def ferrari_canny_epsilon(
    grasps: Grasps, friction: float = 0.5, length_unit: float | None = None, edges: int | None = 8
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
        One value for each grasp [n].

    Raises:
        GraspAtlasError: If an argument is out of its range.

    Source: C. Ferrari, J. Canny, "Planning Optimal Grasps", ICRA 1992, with the normal forces' sum as the bound.
    """
    if edges is None and not _planar(grasps):
        axes = wrenches.contact_axes(*_contacts(grasps), _length(grasps, length_unit))
        return wrenches.round_ball_radius(axes, friction)
    return wrenches.ball_radius(_wrenches(grasps, friction, 8 if edges is None else edges, length_unit))


@batched
def soft_finger_epsilon(
    grasps: Grasps,
    friction: float = 0.5,
    torsional: float = 0.005,
    length_unit: float | None = None,
    edges: int = 8,
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
        One value for each grasp [n].

    Raises:
        GraspAtlasError: If an argument is out of its range.

    Source: R. D. Howe, M. R. Cutkosky, "Practical Force-Motion Models for Sliding Manipulation", IJRR 1996, for the
    friction limit surface; under even pressure a disc of radius a resists 2/3 mu a for each unit of normal force.
    """
    return wrenches.ball_radius(_wrenches(grasps, friction, edges, length_unit, torsional))


@batched
def ferrari_canny_volume(
    grasps: Grasps, friction: float = 0.5, length_unit: float | None = None, edges: int = 8
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
        One value for each grasp [n].

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
def min_weight(grasps: Grasps, friction: float = 0.5, edges: int = 8) -> Array:
    r"""Least share of any friction-cone edge in internal forces that use all edges, from 0, no closure, to 1.

    .. math:: w \max \{ l \;:\; \sum_j \alpha_j w_j = 0, \; \sum_j \alpha_j = 1, \; \alpha_j \ge l \}

    over the wrenches :math:`w_j` of the w edges of all friction pyramids: the metric :math:`l^*` of FRoGGeR, times the
    number of edges so that 1 is the most it can be. No length divides torques: it would change nothing. It has no unit.

    Args:
        grasps: The grasps.
        friction: Coefficient of friction mu.
        edges: Edges of the friction pyramids; FRoGGeR takes 4. In the plane cones have two.

    Returns:
        One value for each grasp [n].

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
        One value, without unit, for each grasp [n].

    Raises:
        GraspAtlasError: If the length is not positive.

    Source: B.-H. Kim et al., "Optimal Grasping Based on Non-Dimensionalized Performance Indices", IROS 2001; M. A. Roa,
    R. Suárez, "Grasp Quality Measures: Review and Performance", Autonomous Robots 38 (2015), grasp isotropy index.
    """
    G = grasps.G.copy()
    forces = 2 if _planar(grasps) else 3
    G[:, forces:] /= _length(grasps, length_unit)
    sigma = np.linalg.svd(G, compute_uv=False)[:, : G.shape[1]]
    if sigma.shape[1] < G.shape[1]:
        return np.zeros(len(grasps))
    ratio = sigma[:, -1] / sigma[:, 0]
    return np.asarray(np.where(ratio > RANK_TOLERANCE, ratio, 0.0))


@batched
def joint_centrality(grasps: Grasps) -> Array:
    r"""How near the joints are to the middle of their ranges: 1 where all are there, 0 where all are at a limit.

    .. math:: 1 - \frac{1}{h} \sum_{j=1}^h \left( \frac{q_j - \bar q_j}{(q_j^{max} - q_j^{min}) / 2} \right)^2

    A joint without two limits counts as in the middle. The value has no unit.

    Args:
        grasps: The grasps.

    Returns:
        One value for each grasp [n].

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


#: Indices by name.
INDICES: dict[str, Callable[[Grasps], Array]] = {
    index.__name__: index
    for index in (
        inverse_condition_number,
        manipulability_volume,
        smallest_semi_axis,
        force_closure_margin,
        ferrari_canny_epsilon,
        soft_finger_epsilon,
        ferrari_canny_volume,
        min_weight,
        grasp_isotropy,
        joint_centrality,
    )
}
#: Indices of this package, whose values need no check.
_OWN = tuple(INDICES.values())


def find_index(quality: Quality) -> Callable[[Any], Any]:
    """The index of a name, or the callable itself.

    Raises:
        GraspAtlasError: If there is no index of that name.
    """
    if callable(quality):
        return quality
    if not isinstance(quality, str) or quality not in INDICES:
        raise unknown_name("quality index", quality, INDICES)
    return INDICES[quality]


def quality_name(quality: Quality) -> str:
    """The name of an index."""
    return quality if isinstance(quality, str) else getattr(quality, "__name__", type(quality).__name__)


def evaluate(quality: Quality, grasps: Grasps) -> Array:
    """Value of a quality index at each grasp [n].

    Args:
        quality: Name of an index, or a callable: see the top of this module.
        grasps: The grasps.

    Raises:
        GraspAtlasError: If there is no such index, or a callable raises, or returns anything but finite numbers; see
            :mod:`graspatlas.grasps.callables`.
    """
    index, name = find_index(quality), quality_name(quality)
    if index not in _OWN:
        return called_numbers(index, name, grasps)
    values = np.asarray(index(grasps), float)
    if np.isnan(values).any():
        raise GraspAtlasError(f"quality index '{name}' is NaN for grasp {int(np.isnan(values).argmax())}")
    return values
