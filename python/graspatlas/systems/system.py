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
from numpy.typing import ArrayLike

from graspatlas._core import Angles, AnySystem, PythonSystem, Rotations, Sphere, Torus
from graspatlas.errors import GraspAtlasError
from graspatlas.support.arrays import Array
from graspatlas.support.validation import number_array, whole

__all__ = [
    "Angles",
    "AnySystem",
    "Rotations",
    "Sphere",
    "System",
    "Torus",
    "check_finite",
    "check_jacobian",
    "jacobian_error",
]


#: Variables that a system may have: its Jacobians are dense.
MOST_VARIABLES = 10_000
#: Steps of the differences that a Jacobian is compared with, and how far it may be off, relative to its largest entry.
DIFFERENCE_STEPS = (1e-6, 1e-5, 1e-4, 1e-7)
JACOBIAN_TOLERANCE = 1e-3


class System(PythonSystem):
    r"""Equations :math:`R(x) = 0` in :math:`\mathbb{R}^n`, written in Python.

    The solutions form a manifold of dimension ``n_variables - n_equations`` wherever the Jacobian has full rank.

    Args:
        n_variables: Numbers in x.
        n_equations: Numbers in R(x); fewer than the variables.
        lower: Lower bounds of x (n_variables,), or one number for all; infinite by default.
        upper: Upper bounds of x, likewise.

    Raises:
        GraspAtlasError: If a size is out of its range, or the bounds are not one number or n_variables.
    """

    def __init__(
        self,
        n_variables: int,
        n_equations: int,
        lower: ArrayLike = -np.inf,
        upper: ArrayLike = np.inf,
    ) -> None:
        for name, count in (("n_variables", n_variables), ("n_equations", n_equations)):
            whole(count, name, 0, MOST_VARIABLES)
        try:
            low = np.broadcast_to(number_array(lower, "lower"), (n_variables,))
            high = np.broadcast_to(number_array(upper, "upper"), (n_variables,))
        except ValueError as error:
            raise GraspAtlasError(f"bounds need one number, or {n_variables}: {error}") from None
        super().__init__(n_variables, n_equations, low, high)

    def residual(self, x: Array) -> ArrayLike:
        """R(x) (n_equations,)."""
        raise NotImplementedError

    def jacobian(self, x: Array) -> ArrayLike:
        """Derivative of R at x (n_equations, n_variables)."""
        raise NotImplementedError


def jacobian_error(system: AnySystem, x: ArrayLike, step: float = 1e-6) -> float:
    """Largest difference between a system's Jacobian at x and central differences of its residual.

    Every system should pass this with about 1e-8 times the size of its second derivatives.

    Args:
        system: Any system.
        x: A point (configuration_size,), on the manifold or not.
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


def check_finite(system: AnySystem, x: Array) -> None:
    """Make sure that what a system written in Python returns at a first point is finite.

    Elsewhere it need not be: the manifold ends where Newton's method meets no numbers, and the atlas counts that.

    Args:
        system: Any system; compiled ones are not asked.
        x: A point; one of another size is not asked about either.

    Raises:
        GraspAtlasError: If it is not.
    """
    if not isinstance(system, System) or x.shape != (system.configuration_size,) or not np.isfinite(x).all():
        return
    for method, values in (("residual", system.evaluate_residual(x)), ("jacobian", system.evaluate_jacobian(x))):
        if not np.isfinite(values).all():
            raise GraspAtlasError(
                f"x0 could not be projected onto the manifold: {method}(x) of {type(system).__name__} returned "
                f"{'NaN' if np.isnan(values).any() else 'infinity'} there; give an x0 where the equations are defined"
            )


def check_jacobian(system: AnySystem, x: ArrayLike) -> None:
    """Make sure that the Jacobian of a system written in Python is the derivative of its residual at a point.

    Newton's method forgives a wrong Jacobian, and would find a manifold's points with wrong tangent spaces. Differences
    of several lengths are tried, so that an equation may be steep or rough; where none is finite nothing is said.

    Args:
        system: Any system; compiled ones are not asked.
        x: A point (configuration_size,).

    Raises:
        GraspAtlasError: If all differences say that the Jacobian is another one.
    """
    if not isinstance(system, System):
        return
    size = float(np.abs(system.evaluate_jacobian(x)).max(initial=0.0))
    smallest = np.inf
    for step in DIFFERENCE_STEPS:
        error = jacobian_error(system, x, step)
        if not error > JACOBIAN_TOLERANCE * size:
            return
        smallest = min(smallest, error)
    raise GraspAtlasError(
        f"jacobian(x) of {type(system).__name__} is not the derivative of residual(x) at the first point: differences "
        f"of the residual are off by {smallest:.2g}, its largest entry is {size:.2g}; correct it, "
        "graspatlas.systems.jacobian_error measures it"
    )
