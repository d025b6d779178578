"""Points of a manifold near a point that may be far off it: Levenberg and Marquardt's method within bounds."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from graspatlas.errors import GraspAtlasError
from graspatlas.support.arrays import Array
from graspatlas.support.validation import number_array
from graspatlas.systems.system import AnySystem

__all__ = ["checked_point", "project"]


#: Steps after which a projection is given up; those that converge need a dozen.
MAX_STEPS = 60
#: Largest entry of |R(x)| that counts as zero.
ZERO = 1e-9
#: How far inside its bounds a projected point stays, so that rounding cannot break them [units of the tangent space].
MARGIN = 1e-6
#: Damping: of the first step, what a good and a bad step multiply it by, the largest, and the least that is kept.
DAMPING, EASED, TIGHTENED, LARGEST, LEAST = 1e-2, 0.2, 4.0, 1e6, 1e-12
#: After this many steps, each must bring the squared residual below this share, or the projection is given up.
PATIENCE, PROGRESS = 10, 0.999


def project(system: AnySystem, x0: ArrayLike) -> Array | None:
    """Move a point to the manifold R(x) = 0 and within its bounds.

    Unlike Newton's method it may start far off. A bound that is broken counts as an equation, so the point ends within
    the bounds, a millionth at least.

    Args:
        system: The equations.
        x0: Where to start [configuration_size].

    Returns:
        A point of the manifold [configuration_size], or None when the method ends elsewhere.

    Raises:
        GraspAtlasError: If x0 has another shape, or holds a number that is not finite.

    Source: J. J. Moré, "The Levenberg-Marquardt Algorithm: Implementation and Theory", 1978; the steps are tangent
        vectors.
    """
    x = checked_point(system, x0, "x0")
    r, damping = _residual(system, x), DAMPING
    for step in range(MAX_STEPS):
        if np.abs(r).max(initial=0.0) <= ZERO:
            return x
        before = r @ r
        J = _jacobian(system, x, r)
        H, g = J.T @ J, J.T @ r
        while True:
            moved = system.integrate(x, -np.linalg.solve(H + damping * np.eye(len(g)), g))
            r = _residual(system, moved)
            if r @ r < before:
                break
            damping *= TIGHTENED
            if damping > LARGEST:
                return None
        if step >= PATIENCE and r @ r > PROGRESS * before:
            return None
        x, damping = np.asarray(moved), max(EASED * damping, LEAST)
    return None


def _residual(system: AnySystem, x: Array) -> Array:
    """R(x), and by how much each bound is broken."""
    return np.concatenate([system.evaluate_residual(x), np.maximum(MARGIN - system.slack(x), 0.0)])


def _jacobian(system: AnySystem, x: Array, r: Array) -> Array:
    """Derivative of :func:`_residual`, where that is r."""
    broken = r[system.n_equations :, None] > 0.0
    return np.concatenate([system.evaluate_jacobian(x), np.where(broken, system.bound_normals, 0.0)])


def checked_point(system: AnySystem, x: ArrayLike, name: str) -> Array:
    """A point of a system's configuration space.

    Raises:
        GraspAtlasError: If it has another shape, or holds a number that is not finite.
    """
    point = number_array(x, name)
    if point.shape != (system.configuration_size,):
        raise GraspAtlasError(f"{name} must hold {system.configuration_size} numbers, got shape {point.shape}")
    if not np.isfinite(point).all():
        raise GraspAtlasError(f"{name} holds a number that is not finite")
    return point
