"""Curves on other patches."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from graspatlas import _core
from graspatlas.errors import GraspAtlasError
from graspatlas.patches.base import Interval, Patch
from graspatlas.patches.nearest import nearest_parameters
from graspatlas.support.arrays import Array
from graspatlas.support.validation import PlainTable, number_array

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

__all__ = ["Curve"]

#: Points between two given ones at which a curve is measured and checked.
SAMPLES = 129
#: How far a curve may leave its patch's intervals [rad, m or number].
INTERVAL_TOLERANCE = 1e-9
#: Shortest piece of a curve [m].
SHORTEST = 1e-9


@dataclass(frozen=True)
class Curve(Patch):
    """A curve on another patch, with the patch's normal; its one parameter, ``"u"``, is about the length along it [m].

    u(s) and v(s) go through the given points of the patch: straight in the parameters for two points, as a natural
    cubic spline for more. A curve of constant u or v needs no such patch: freeze that parameter of the contact.

    Attributes:
        patch: A patch with two parameters.
        points: Parameters (u, v) of points on it (n, 2), in their order along the curve.
    """

    patch: Patch
    points: tuple[tuple[float, float], ...] = field(repr=False)
    kind: ClassVar[str] = "curve"
    parameters: ClassVar[tuple[str, ...]] = ("u",)

    def __post_init__(self) -> None:
        if not isinstance(self.patch, Patch) or len(self.patch.parameters) != 2:
            kind = getattr(self.patch, "kind", type(self.patch).__name__)
            raise GraspAtlasError(f"a curve lies on a patch with two parameters, not on a {kind}")
        points = number_array(self.points, "points")
        if points.ndim != 2 or points.shape[1] != 2 or len(points) < 2 or not np.isfinite(points).all():
            raise GraspAtlasError(f"points must be at least two pairs (u, v) of finite numbers, got {self.points!r}")
        object.__setattr__(self, "points", tuple((float(u), float(v)) for u, v in points))
        lengths = self._lengths()
        if (lengths < SHORTEST).any():
            i = int(np.argmin(lengths))
            raise GraspAtlasError(f"points {i} and {i + 1} of the curve are the same; drop one")
        self._check_within()

    def _lengths(self) -> Array:
        """Lengths on the patch of the straight lines between the points in the parameters (n - 1,)."""
        core, points = self.patch.core(), np.array(self.points)
        lengths = []
        for start, end in pairwise(points):
            line = [core.evaluate(*(start + share * (end - start)))["o"] for share in np.linspace(0.0, 1.0, SAMPLES)]
            lengths.append(np.linalg.norm(np.diff(line, axis=0), axis=1).sum())
        return np.array(lengths)

    def _check_within(self) -> None:
        spline = self._spline()
        s = np.linspace(0.0, spline.x[-1], SAMPLES * len(self.points))
        for name, values in zip(("u", "v"), spline(s).T, strict=True):
            low, high = self.patch.interval(name) or (-np.inf, np.inf)
            beyond = np.maximum(low - values, values - high)
            if beyond.max() > INTERVAL_TOLERANCE:
                worst = int(np.argmax(beyond))
                raise GraspAtlasError(
                    f"the curve leaves the patch: {name} = {values[worst]:g} at s = {s[worst]:g} m, its interval is "
                    f"({low:g}, {high:g})"
                )

    def _spline(self) -> CubicSpline:
        """Parameters (u, v) over the length along the curve."""
        from scipy.interpolate import CubicSpline  # slow to import

        s = np.concatenate([[0.0], np.cumsum(self._lengths())])
        return CubicSpline(s, np.array(self.points), bc_type="natural")

    def interval(self, parameter: str) -> Interval:
        """From 0 to the length of the curve [m]."""
        return (0.0, float(self._lengths().sum()))

    def locate(self, point: ArrayLike) -> tuple[float, float]:
        """Parameter of the curve's nearest point, by least squares, and 0."""
        interval = self.interval("u")
        return (float(nearest_parameters(self.core(), point, [interval], [interval])[0]), 0.0)

    def core(self) -> _core.Patch:
        """The compiled curve."""
        spline = self._spline()
        u, v = (np.ascontiguousarray(spline.c[::-1, :, i].T) for i in range(2))
        return _core.CurvePatch(self.patch.core(), list(spline.x), u, v)

    def to_dict(self) -> PlainTable:
        """The curve as plain data, with its patch's."""
        return {"type": self.kind, "patch": self.patch.to_dict(), "points": self.points}
