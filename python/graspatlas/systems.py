"""Systems of equations R(x) = 0 whose solutions an atlas covers: toy manifolds, and the base of your own.

A system written in Python is a subclass of :class:`System`::

    class Ellipsoid(System):
        def __init__(self):
            super().__init__(n_variables=3, n_equations=1)

        def residual(self, x):
            return np.array([x[0] ** 2 + (x[1] / 2) ** 2 + (x[2] / 3) ** 2 - 1])

        def jacobian(self, x):
            return np.array([[2 * x[0], x[1] / 2, 2 * x[2] / 9]])
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graspatlas._core import Angles, AnySystem, PythonSystem, Rotations, Sphere, Torus
from graspatlas.errors import GraspAtlasError

__all__ = ["Angles", "AnySystem", "Rotations", "Sphere", "System", "Torus", "jacobian_error"]

Array = NDArray[np.float64]


class System(PythonSystem):
    r"""Equations :math:`R(x) = 0` in :math:`\mathbb{R}^n`, written in Python.

    The solutions form a manifold of dimension ``n_variables - n_equations`` wherever the Jacobian has full rank.

    Args:
        n_variables: Numbers in x.
        n_equations: Numbers in R(x); fewer than the variables.
        lower: Lower bounds of x [n_variables], or one number for all; infinite by default.
        upper: Upper bounds of x, likewise.

    Raises:
        GraspAtlasError: If the sizes or the bounds make no sense.
    """

    def __init__(
        self,
        n_variables: int,
        n_equations: int,
        lower: ArrayLike = -np.inf,
        upper: ArrayLike = np.inf,
    ) -> None:
        try:
            low = np.broadcast_to(np.asarray(lower, float), (n_variables,))
            high = np.broadcast_to(np.asarray(upper, float), (n_variables,))
        except ValueError as error:
            raise GraspAtlasError(f"bounds need one number, or {n_variables}: {error}") from None
        super().__init__(n_variables, n_equations, low, high)

    def residual(self, x: Array) -> ArrayLike:
        """R(x) [n_equations]."""
        raise NotImplementedError

    def jacobian(self, x: Array) -> ArrayLike:
        """Derivative of R at x [n_equations, n_variables]."""
        raise NotImplementedError


def jacobian_error(system: AnySystem, x: ArrayLike, step: float = 1e-6) -> float:
    """Largest difference between a system's Jacobian at x and central differences of its residual.

    Every system should pass this with about 1e-8 times the size of its second derivatives.

    Args:
        system: Any system.
        x: A point [configuration_size], on the manifold or not.
        step: Length of the differences in the tangent space.

    Returns:
        The largest absolute difference between the two matrices.
    """
    point = np.asarray(x, float)
    columns = []
    for direction in np.eye(system.tangent_size):
        ahead = system.evaluate_residual(system.integrate(point, step * direction))
        behind = system.evaluate_residual(system.integrate(point, -step * direction))
        columns.append((ahead - behind) / (2.0 * step))
    difference = np.array(columns).T - system.evaluate_jacobian(point)
    return float(np.abs(difference).max(initial=0.0))
