"""Tensor-product Bezier and B-spline patches."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import product
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from graspatlas import _core
from graspatlas.errors import GraspAtlasError
from graspatlas.patches.base import LARGEST, FlippablePatch, Interval, Vector3, checked_interval
from graspatlas.patches.nearest import nearest_parameters
from graspatlas.support.arrays import Array
from graspatlas.support.validation import number_array

__all__ = ["BSpline", "Bezier"]

ControlPoints = tuple[tuple[Vector3, ...], ...]

#: Largest degree of the compiled splines.
MAX_DEGREE = 9
#: The surface is singular where sin(angle of o_u and o_v), or one of them beside the longest, is below this.
SINGULAR = 1e-6
#: Points along each parameter at which a patch is checked to be regular.
CHECKED = 11
#: How far an interval may leave the domain of the knots, as a share of the domain.
DOMAIN_TOLERANCE = 1e-12


@dataclass(frozen=True)
class _TensorProduct(FlippablePatch):
    """o(u, v) = sum over i, j of N_i(u) N_j(v) P_ij, with the normal along o_u x o_v."""

    control_points: ControlPoints = field(default=(), repr=False)
    u_interval: Interval | None = None
    v_interval: Interval | None = None
    parameters: ClassVar[tuple[str, ...]] = ("u", "v")

    def __post_init__(self) -> None:
        super().__post_init__()
        points = number_array(self.control_points, "control_points")
        if points.ndim != 3 or points.shape[2] != 3 or min(points.shape) < 2 or not (np.abs(points) < LARGEST).all():
            raise GraspAtlasError(
                "control_points must be finite numbers of shape [p, q, 3] with p and q at least 2, got shape "
                f"{list(points.shape)}{'' if np.isfinite(points).all() else ' with numbers that are not finite'}"
            )
        rows = tuple(tuple((float(x), float(y), float(z)) for x, y, z in row) for row in points)
        object.__setattr__(self, "control_points", rows)

    def basis(self) -> tuple[tuple[int, int], tuple[Array, Array], str]:
        """Degrees of u and v, their knots, and the unit of the parameters."""
        raise NotImplementedError

    def _check_surface(self) -> None:
        """The intervals must lie in the domain, and the surface must have a normal everywhere in them."""
        degrees, knots, _ = self.basis()
        core = self.surface()
        for name, degree, values in zip(("u", "v"), degrees, knots, strict=True):
            low, high = values[degree], values[-degree - 1]
            given = getattr(self, f"{name}_interval")
            if given is None:
                continue
            lower, upper = checked_interval(given, f"{name}_interval")
            slack = DOMAIN_TOLERANCE * (high - low)
            if lower < low - slack or upper > high + slack:
                raise GraspAtlasError(
                    f"{name}_interval ({lower:g}, {upper:g}) leaves the domain of the knots, ({low:g}, {high:g})"
                )
            object.__setattr__(self, f"{name}_interval", (lower, upper))
        grid = list(product(*(np.linspace(*self.interval(name), CHECKED) for name in ("u", "v"))))
        points = [core.evaluate(u, v) for u, v in grid]
        o_u, o_v = (np.array([p[name] for p in points]) for name in ("o_u", "o_v"))
        lengths = np.linalg.norm(o_u, axis=1).max() * np.linalg.norm(o_v, axis=1).max()
        areas = np.linalg.norm(np.cross(o_u, o_v), axis=1)
        if not areas.min() > SINGULAR * lengths:
            u, v = grid[int(np.argmin(areas))]
            raise GraspAtlasError(
                f"the surface has no normal at u = {u:g}, v = {v:g}: control points collapse there; spread them, or "
                "keep u_interval and v_interval away"
            )

    def interval(self, parameter: str) -> Interval:
        """Interval of u or v: by default the domain of the knots."""
        given = self.u_interval if parameter == "u" else self.v_interval
        if given is not None:
            return given
        degrees, knots, _ = self.basis()
        which = 0 if parameter == "u" else 1
        values = knots[which]
        return (float(values[degrees[which]]), float(values[-degrees[which] - 1]))

    def locate(self, point: ArrayLike) -> tuple[float, float]:
        """Parameters of the nearest point within the intervals, by least squares."""
        intervals = (self.interval("u"), self.interval("v"))
        u, v = nearest_parameters(self.surface(), point, intervals, intervals)
        return (float(u), float(v))

    def surface(self) -> _core.Patch:
        """The compiled B-spline."""
        degrees, (u_knots, v_knots), unit = self.basis()
        points = np.array(self.control_points).reshape(-1, 3)
        return _core.BSplinePatch(degrees, list(u_knots), list(v_knots), points, unit)


@dataclass(frozen=True)
class Bezier(_TensorProduct):
    """A tensor-product Bezier patch: u and v run from 0 to 1, and the patch passes through its corner points.

    Attributes:
        control_points: P (p, q, 3), u along the first axis and v along the second; degrees are p - 1 and q - 1 [m].
        u_interval, v_interval: Parts of (0, 1); all of it by default.
        flipped: False for the outward normal along o_u x o_v, True for its opposite.

    Source: "Global Optimization of Robotic Grasps", Section II, after eq (4).
    """

    kind: ClassVar[str] = "bezier"

    def __post_init__(self) -> None:
        super().__post_init__()
        p, q = len(self.control_points), len(self.control_points[0])
        if max(p, q) > MAX_DEGREE + 1:
            raise GraspAtlasError(
                f"a Bezier patch has at most {MAX_DEGREE + 1} control points each way, got {p} x {q}; use a B-spline"
            )
        self._check_surface()

    def basis(self) -> tuple[tuple[int, int], tuple[Array, Array], str]:
        """Degrees of u and v, their knots, and the unit of the parameters."""
        p, q = len(self.control_points), len(self.control_points[0])
        return (p - 1, q - 1), (np.repeat((0.0, 1.0), p), np.repeat((0.0, 1.0), q)), "number"


@dataclass(frozen=True)
class BSpline(_TensorProduct):
    """A tensor-product B-spline patch.

    It is not periodic: a closed surface has a seam that no grasp crosses.

    Attributes:
        control_points: P (p, q, 3), u along the first axis and v along the second [m].
        degrees: Degrees of u and v, 3 by default: below 3 the Jacobian of the contact jumps at the knots.
        u_knots, v_knots: Knots (p + degree + 1,), (q + degree + 1,), not descending; by default evenly spaced from 0 to
            1, with the ends repeated so that the patch passes through its corner points.
        u_interval, v_interval: Parts of the domains, ``knots[degree]`` to ``knots[p]``; all of them by default.
        unit: ``"number"``, or ``"m"`` when the knots are lengths [m], so that u and v are measured as such.
        flipped: False for the outward normal along o_u x o_v, True for its opposite.
    """

    degrees: tuple[int, int] = (3, 3)
    u_knots: tuple[float, ...] | None = field(default=None, repr=False)
    v_knots: tuple[float, ...] | None = field(default=None, repr=False)
    unit: str = "number"
    kind: ClassVar[str] = "bspline"

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "degrees", _checked_degrees(self.degrees))
        counts = (len(self.control_points), len(self.control_points[0]))
        for name, degree, count in zip(("u", "v"), self.degrees, counts, strict=True):
            if count < degree + 1:
                raise GraspAtlasError(
                    f"degree {degree} of {name} needs at least {degree + 1} control points along {name}, got {count}"
                )
            given = getattr(self, f"{name}_knots")
            knots = clamped_knots(count, degree) if given is None else number_array(given, f"{name}_knots")
            if knots.shape != (count + degree + 1,):
                raise GraspAtlasError(
                    f"{name}_knots must be {count + degree + 1} numbers, for {count} control points of degree "
                    f"{degree}; got shape {list(knots.shape)}"
                )
            object.__setattr__(self, f"{name}_knots", tuple(map(float, knots)))
        self._check_surface()

    def basis(self) -> tuple[tuple[int, int], tuple[Array, Array], str]:
        """Degrees of u and v, their knots, and the unit of the parameters."""
        return self.degrees, (np.array(self.u_knots), np.array(self.v_knots)), self.unit


def clamped_knots(count: int, degree: int, low: float = 0.0, high: float = 1.0) -> Array:
    """Evenly spaced knots (count + degree + 1,) whose ends come degree + 1 times."""
    inner = np.linspace(low, high, count - degree + 1)
    return np.concatenate([np.full(degree, low), inner, np.full(degree, high)])


def _checked_degrees(value: object) -> tuple[int, int]:
    degrees = tuple(value) if isinstance(value, tuple | list) else ()
    if len(degrees) != 2 or not all(
        isinstance(d, int) and not isinstance(d, bool) and 1 <= d <= MAX_DEGREE for d in degrees
    ):
        raise GraspAtlasError(f"degrees must be two whole numbers from 1 to {MAX_DEGREE}, got {value!r}")
    return (degrees[0], degrees[1])
