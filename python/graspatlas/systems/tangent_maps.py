"""Between a manifold and its tangent spaces: bases, points above tangent vectors, nearest points within bounds."""

from __future__ import annotations

import numpy as np

from graspatlas import _core
from graspatlas.support.arrays import Array
from graspatlas.systems.system import AnySystem

__all__ = ["BOUND_TOLERANCE", "nearest_point", "point_above", "tangent_bases"]

#: Largest entry of |R(x)| that counts as zero, as in the projection of the compiled core.
ZERO = 1e-11
#: Iterations after which Newton's method is given up.
MAX_ITERATIONS = 12
#: How far a point may be outside its bounds [units of the tangent space].
BOUND_TOLERANCE = 1e-9


def tangent_bases(system: AnySystem, X: Array) -> Array:
    """Orthonormal tangent bases [n, k, tangent_size], one tangent vector a row."""
    if system.n_equations == 0:
        return np.tile(np.eye(system.tangent_size), (len(X), 1, 1))
    J = np.array([system.evaluate_jacobian(x) for x in X])
    Q = np.linalg.qr(J.transpose(0, 2, 1), mode="complete")[0]
    return np.ascontiguousarray(Q[:, :, system.n_equations :].transpose(0, 2, 1))


def nearest_point(system: AnySystem, x: Array) -> Array | None:
    """The point of the manifold near x, inside its bounds: least-norm Newton steps, broken bounds held as equations.

    Returns:
        The point [configuration_size], or None when Newton's method does not converge.
    """
    B = system.bound_normals
    held = np.zeros(len(B), bool)
    for _ in range(MAX_ITERATIONS):
        R, slack = system.evaluate_residual(x), system.slack(x)
        held |= slack < 0.0
        if np.abs(R).max(initial=0.0) <= ZERO and slack.min(initial=0.0) >= -BOUND_TOLERANCE:
            return np.asarray(x)
        rows = np.vstack([system.evaluate_jacobian(x), -B[held]])
        x = system.integrate(x, -np.linalg.pinv(rows, rcond=1e-12) @ np.concatenate([R, slack[held]]))
    return None


def point_above(system: AnySystem, x: Array, Phi: Array, u: Array) -> Array | None:
    """The point of the manifold above u in the tangent space at x, moved inside its bounds."""
    y = _core.project(system, x, Phi, u)
    if y is None:
        return None
    return np.asarray(y) if system.slack(y).min(initial=0.0) >= 0.0 else nearest_point(system, np.asarray(y))
