r"""Wrenches that the contacts of a grasp exert on the object, and what their convex hull measures.

A contact at the point p with inward normal n exerts forces within its friction cone. Those with a normal force of one
are the disc :math:`n + \mu\,(\cos a \; s + \sin a \; t)`, s and t the contact's tangents; a pyramid replaces the disc
by a polygon with its corners on it. A force f gives the wrench :math:`(f, \; p \times f / \lambda)`: torques are
divided by a length :math:`\lambda`, so that they can be weighed against forces. In the plane a disc is a segment, its
two ends are the pyramid, and a wrench has three components.

The hull of all these wrenches holds what the contacts can exert while their normal forces add up to one, the L1 grasp
wrench space of Ferrari and Canny. These functions know points and normals only, no hand, and take n grasps at once.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from graspatlas import _core
from graspatlas.errors import GraspAtlasError
from graspatlas.support.arrays import Array
from graspatlas.support.validation import number, number_array, positive, whole

__all__ = ["ball_radius", "contact_axes", "contact_wrenches", "hull_volume", "min_weight", "round_ball_radius"]

#: Fewest edges that make a pyramid.
MIN_EDGES = 3


def contact_axes(points: ArrayLike, normals: ArrayLike, length_unit: float, planar: bool = False) -> Array:
    """Wrenches of unit forces along the inward normal and the tangents of each contact.

    The first tangent is horizontal, seen from the z axis of the coordinates that points and normals are in, unless the
    normal is within 45 degrees of that axis; then from the x axis.

    Args:
        points: Contact points, seen from the point that torques are about (n, m, 3), metres.
        normals: Outward unit normals of the object there (n, m, 3).
        length_unit: The length that divides torques [m].
        planar: Whether forces stay in the x-y plane and the torque is about z.

    Returns:
        Wrenches (n, m, 3, 6), or (n, m, 2, 3) in the plane.

    Raises:
        GraspAtlasError: If the arrays have other shapes, or the length is not positive.
    """
    p, outward = number_array(points, "points"), number_array(normals, "normals")
    if p.ndim != 3 or p.shape[2] != 3 or p.shape != outward.shape:
        raise GraspAtlasError(
            f"points and normals must have the shape [grasps, contacts, 3]; got {p.shape} and {outward.shape}"
        )
    scale = positive(length_unit, "length_unit")
    n = -outward
    if planar:
        t = np.stack([-n[..., 1], n[..., 0], np.zeros_like(n[..., 0])], axis=-1)
        f = np.stack([n, t], axis=2)
        torque = p[:, :, None, 0] * f[..., 1] - p[:, :, None, 1] * f[..., 0]
        return np.concatenate([f[..., :2], torque[..., None] / scale], axis=-1)
    steep = 2.0 * n[..., 2:] ** 2 > 1.0
    s = np.cross(np.where(steep, [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]), n)
    s /= np.linalg.norm(s, axis=-1, keepdims=True)
    f = np.stack([n, s, np.cross(n, s)], axis=2)
    return np.concatenate([f, np.cross(p[:, :, None], f) / scale], axis=-1)


def contact_wrenches(
    points: ArrayLike,
    normals: ArrayLike,
    friction: float = 0.5,
    edges: int = 8,
    length_unit: float = 1.0,
    planar: bool = False,
    torsional: float = 0.0,
) -> Array:
    """Wrenches of the edges of the friction pyramids, normal forces being one.

    A soft finger also resists being turned about the normal. Its friction limit surface is linearised: the hull of the
    pyramid's edges and of the normal force with the largest torque either way.

    Args:
        points: Contact points, seen from the point that torques are about (n, m, 3), metres.
        normals: Outward unit normals of the object there (n, m, 3).
        friction: Coefficient of friction mu.
        edges: Edges of each pyramid, three or more; the first lies along the tangent that :func:`contact_axes` states.
            In the plane a cone has two edges, whatever this says.
        length_unit: The length that divides torques [m].
        planar: Whether forces stay in the x-y plane and the torque is about z.
        torsional: Torsional friction [m]: largest torque about the normal, of a normal force of one; 0 for hard
            fingers. It plays no part in the plane.

    Returns:
        Wrenches (n, m edges, 6), two more for each contact of soft fingers; or (n, 2 m, 3) in the plane.

    Raises:
        GraspAtlasError: If an argument is out of its range or of another shape.
    """
    mu = positive(friction, "friction")
    whole(edges, "edges", MIN_EDGES)
    axes = contact_axes(points, normals, length_unit, planar)
    if planar:
        corners = np.array([[1.0, mu], [1.0, -mu]])
    else:
        angles = 2.0 * np.pi * np.arange(edges) / edges
        corners = np.stack([np.ones(edges), mu * np.cos(angles), mu * np.sin(angles)], axis=1)
    wrenches = corners @ axes
    if not 0.0 <= number(torsional, "torsional") < np.inf:
        raise GraspAtlasError(f"torsional must be a number of at least 0, got {torsional!r}")
    if torsional > 0.0 and not planar:
        normal = axes[:, :, :1]
        turn = np.concatenate([np.zeros_like(normal[..., 3:]), torsional / length_unit * normal[..., :3]], axis=-1)
        wrenches = np.concatenate([wrenches, normal + turn, normal - turn], axis=2)
    return np.ascontiguousarray(
        wrenches.reshape(len(wrenches), wrenches.shape[1] * wrenches.shape[2], wrenches.shape[3])
    )


def ball_radius(wrenches: ArrayLike) -> Array:
    """Radius of the largest ball around the origin in the convex hull of the wrenches of each grasp (n,).

    It is 0 where the origin is not inside the hull. The hull is only refined where it is nearest to the origin.

    Args:
        wrenches: Wrenches (n, w, 3) or (n, w, 6).

    Raises:
        GraspAtlasError: If the array has another shape, or holds what is not a finite number.

    Source: Y. Zheng, "An Efficient Algorithm for a Grasp Quality Measure", IEEE T-RO 29 (2013).
    """
    return np.asarray(_core.ball_radii(number_array(wrenches, "wrenches")))


def round_ball_radius(axes: ArrayLike, friction: float) -> Array:
    """The same for round friction cones, from below and to one part in ten thousand (n,).

    Args:
        axes: Wrenches of the contacts' normals and tangents (n, m, 3, 6), from :func:`contact_axes`.
        friction: Coefficient of friction mu.

    Raises:
        GraspAtlasError: If an argument is out of its range or of another shape.
    """
    array = number_array(axes, "axes")
    if array.ndim != 4 or array.shape[2:] != (3, 6):
        raise GraspAtlasError(f"axes must have the shape [grasps, contacts, 3, 6], got {array.shape}")
    return np.asarray(
        _core.round_ball_radii(array.reshape(len(array), 3 * array.shape[1], 6), positive(friction, "friction"))
    )


def hull_volume(wrenches: ArrayLike) -> Array:
    """Volume of the convex hull of the wrenches of each grasp (n,); 0 where they lie in one plane.

    Args:
        wrenches: Wrenches (n, w, 3) or (n, w, 6).

    Raises:
        GraspAtlasError: If the array has another shape, or holds what is not a finite number.
    """
    return np.asarray(_core.hull_volumes(number_array(wrenches, "wrenches")))


def min_weight(wrenches: ArrayLike) -> Array:
    r"""Least weight with which all wrenches of a grasp can take part in cancelling each other, times their number (n,).

    It is 0 where the origin is not inside their hull, and 1 where they cancel with equal weights.

    .. math:: w \max \{ l \;:\; \sum_j \alpha_j w_j = 0, \; \sum_j \alpha_j = 1, \; \alpha_j \ge l \}

    Args:
        wrenches: Wrenches (n, w, 3) or (n, w, 6).

    Raises:
        GraspAtlasError: If the array has another shape, or holds what is not a finite number.

    Source: A. H. Li, P. Culbertson, J. W. Burdick, A. D. Ames, "FRoGGeR", IROS 2023.
    """
    return np.asarray(_core.min_weights(number_array(wrenches, "wrenches")))
