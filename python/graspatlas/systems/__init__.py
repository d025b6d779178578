"""Systems F(x) = 0, the projection onto their manifolds, and shortest curves on these."""

from graspatlas.systems.system import (
    Angles,
    AnySystem,
    Rotations,
    Sphere,
    System,
    Torus,
    check_finite,
    check_jacobian,
    jacobian_error,
)

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
