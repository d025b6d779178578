"""Patches: parametrised pieces of surface on a hand's fingertip or on the object, eqs (3) and (4) of the paper.

A patch lives in the frame of the body that carries it and has up to two parameters, u and v. Lengths are in metres,
angles in radians. A contact decides which parameters are free and which are frozen.
"""

from graspatlas.patches.base import Patch
from graspatlas.patches.curve import Curve
from graspatlas.patches.flat import Plane, Point
from graspatlas.patches.mesh_fit import FitReport, patch_from_mesh
from graspatlas.patches.registry import patch_from_dict, patch_types
from graspatlas.patches.round import Ellipsoid, Sphere, Torus
from graspatlas.patches.spline import Bezier, BSpline
from graspatlas.patches.turned import Cone, Cylinder, Revolution

__all__ = [
    "BSpline",
    "Bezier",
    "Cone",
    "Curve",
    "Cylinder",
    "Ellipsoid",
    "FitReport",
    "Patch",
    "Plane",
    "Point",
    "Revolution",
    "Sphere",
    "Torus",
    "patch_from_dict",
    "patch_from_mesh",
    "patch_types",
]
