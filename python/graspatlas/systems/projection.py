"""Points of a manifold near a point that may be far off it: Levenberg and Marquardt's method within bounds."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from graspatlas import _core
from graspatlas.errors import GraspAtlasError
from graspatlas.support.arrays import Array
from graspatlas.support.validation import number_array
from graspatlas.systems.system import AnySystem

__all__ = ["checked_point", "project"]


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
    X, there = _core.project_far(system, checked_point(system, x0, "x0")[None])
    return np.asarray(X[0]) if there[0] else None


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
