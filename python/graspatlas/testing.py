"""Checks of a system or a patch of your own: the identities that an atlas relies on, tried out with numbers.

They belong in your tests, one line for each class::

    from graspatlas.testing import check_patch, check_system

    def test_the_ellipsoid():
        check_system(Ellipsoid(), np.random.default_rng(0).normal(size=(20, 3)))

    def test_the_fingertip():
        check_patch(Sphere(radius=0.012))

Neither returns anything: the first identity that does not hold is an error that names it, with the figures.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import ArrayLike

from graspatlas import _core
from graspatlas.errors import GraspAtlasError
from graspatlas.patches.base import Patch
from graspatlas.patches.registry import patch_from_dict
from graspatlas.support.arrays import Array
from graspatlas.systems.system import AnySystem, jacobian_error

__all__ = ["check_patch", "check_system"]


#: How far a central difference with a step of 1e-6 may be off, relative to the largest entry or 1.
DERIVATIVE = 1e-6
#: Rounding of what holds exactly, per unit of length or angle, and of numbers as large as x.
ROUNDING, RELATIVE_ROUNDING = 1e-9, 1e-14
#: Length of the step whose image must not vanish, as a share of the displacement tried.
TINY = 1e-4
#: Length of the step along which a slack is compared with its slope, as a share of the displacement tried.
SHORT = 1e-3
#: How far a patch's point may lie from what `locate` finds for it [m].
FOUND = 1e-7
#: Largest height over a patch from which `locate` is tried [m], and what the distance found may exceed it by [m].
HEIGHT, ABOVE = 0.005, 1e-6
#: Most places at which a patch's own methods are tried: on splines `locate` takes as long as a thousand points.
LOCATED = 15
#: Interval of a parameter that has no limit, for trying.
TRIED = (-0.3, 0.3)


def check_system(
    system: AnySystem,
    points: ArrayLike,
    *,
    longest: float = 1.0,
    tolerance: float | None = None,
    seed: int = 0,
) -> None:
    r"""Make sure that a system satisfies the identities that every system must satisfy.

    With a random tangent vector v at each point x:

    * R(x) and its Jacobian have the sizes stated, are finite, and are the same to the bit when asked for again;
    * the Jacobian is the derivative of R: :math:`J v = \frac{d}{dh} R(x \oplus h v)` at h = 0;
    * addition is undone: :math:`(x \oplus v) \ominus x = v`, :math:`x \ominus (x \oplus v) = -v` and
      :math:`x \ominus x = 0`;
    * the embedding keeps points apart and shortens distances:
      :math:`0 < \lVert e(x \oplus v) - e(x) \rVert \le \lVert v \rVert`;
    * bounds are linear: :math:`s(x \oplus v) = s(x) - B v` for short v, with the slacks s and the bound normals B.

    Args:
        system: Any system, compiled or in Python.
        points: Where to try [n, configuration_size], on the manifold or not.
        longest: Length of the longest v; with angles among the coordinates below half a turn.
        tolerance: Largest difference between J and central differences; by default 1e-6 of its largest entry, or 1e-6.
        seed: Of the tangent vectors.

    Raises:
        GraspAtlasError: If one does not hold, with its name, the point and the figures; or if there is no point.
    """
    try:
        X = np.atleast_2d(np.asarray(points, float))
    except (TypeError, ValueError) as error:
        raise GraspAtlasError(f"points must be an array of numbers [n, {system.configuration_size}]: {error}") from None
    if X.ndim != 2 or len(X) == 0 or X.shape[1] != system.configuration_size:
        raise GraspAtlasError(f"points must have the shape [n, {system.configuration_size}], got {list(X.shape)}")
    rng = np.random.default_rng(seed)
    for i, x in enumerate(X):
        check = _Check(f"{type(system).__name__} at point {i}")
        v = rng.normal(size=system.tangent_size)
        v *= rng.uniform(0.1, 1.0) * longest / max(float(np.linalg.norm(v)), 1e-300)
        _check_values(check, system, x)
        size = max(1.0, float(np.abs(system.evaluate_jacobian(x)).max(initial=0.0)))
        limit = DERIVATIVE * size if tolerance is None else tolerance
        check.small(jacobian_error(system, x), limit, "the Jacobian is the derivative of the residual")
        _check_addition(check, system, x, v)
        _check_embedding(check, system, x, v)
        _check_bounds(check, system, x, v)


def check_patch(
    patch: Patch,
    at: Iterable[Sequence[float]] | None = None,
    *,
    count: int = 20,
    tolerance: float | None = None,
    seed: int = 0,
) -> None:
    """Make sure that a patch satisfies the identities that every patch must satisfy.

    At each (u, v), with the point o, the normal m and the tangents a and b:

    * a, b and m are orthonormal, and o_u and o_v are normal to m;
    * the derivatives of o, m, a and b by u and v are those of differences.

    At the first fifteen places moreover:

    * ``point`` and ``normal_at`` are o and m;
    * ``locate`` finds the parameters of a point on the patch, and for one above it a point no farther than its height.

    And once: the ends of each parameter's interval ascend, and the patch comes back from its plain data.

    Args:
        patch: Any patch.
        at: Where to try, pairs (u, v) within the patch's intervals; random ones by default.
        count: How many random ones.
        tolerance: Largest difference between a derivative and that of differences; by default 1e-6 of the largest entry
            of that derivative, or 1e-6.
        seed: Of the random ones, and of the heights.

    Raises:
        GraspAtlasError: If one does not hold, with its name, (u, v) and the figures.
    """
    rng = np.random.default_rng(seed)
    name = patch.kind or type(patch).__name__
    ranges = _check_intervals(_Check(f"patch {name}"), patch)
    places = [tuple(rng.uniform(*zip(*ranges, strict=True))) for _ in range(count)] if at is None else list(at)
    if not places:
        raise GraspAtlasError("check_patch needs at least one pair (u, v) at which to try the patch")
    core = patch.core()
    for i, (u, v) in enumerate(places):
        check = _Check(f"patch {name} at ({u:.6g}, {v:.6g})")
        _check_frame(check, core, u, v)
        _check_derivatives(check, core, u, v, tolerance)
        if i < LOCATED:
            _check_points(check, patch, core, u, v)
            _check_locate(check, patch, u, v, rng.uniform(0.0, HEIGHT))
    _check_plain_data(_Check(f"patch {name}"), patch, places[0])


class _Check:
    """Raises what does not hold, in one form."""

    def __init__(self, subject: str) -> None:
        self.subject = subject

    def small(self, error: float, limit: float, identity: str) -> None:
        if not error <= limit:  # so that NaN is refused
            raise GraspAtlasError(
                f"{self.subject}: violated: {identity}; off by {error:.3g}, at most {limit:.3g} allowed"
            )

    def true(self, holds: bool, identity: str, got: str) -> None:
        if not holds:
            raise GraspAtlasError(f"{self.subject}: violated: {identity}; got {got}")


def _largest(difference: Array) -> float:
    return float(np.abs(difference).max(initial=0.0))


# Systems --------------------------------------------------------------------------------------------


def _check_values(check: _Check, system: AnySystem, x: Array) -> None:
    """Sizes of the residual and its Jacobian, finite numbers, and the same numbers a second time."""
    check.true(
        system.dimension == system.tangent_size - system.n_equations,
        "the dimension is the size of the tangent space less the equations",
        f"{system.dimension}, {system.tangent_size} and {system.n_equations}",
    )
    expected = ((system.n_equations,), (system.n_equations, system.tangent_size))
    evaluations = (("residual", system.evaluate_residual), ("jacobian", system.evaluate_jacobian))
    for (what, evaluate), shape in zip(evaluations, expected, strict=True):
        values = np.asarray(evaluate(x))
        check.true(values.shape == shape, f"the {what} has the shape {list(shape)}", str(list(values.shape)))
        check.true(bool(np.isfinite(values).all()), f"the {what} is finite", f"{values.ravel()[:6].tolist()}")
        again = np.asarray(evaluate(x))
        check.true(
            again.tobytes() == values.tobytes(),
            f"the {what} at one point is the same whenever it is asked for",
            f"a difference of {_largest(again - values):.3g}",
        )


def _check_addition(check: _Check, system: AnySystem, x: Array, v: Array) -> None:
    """That `difference` undoes `integrate`."""
    moved = system.integrate(x, v)
    check.true(moved.shape == x.shape, f"x (+) v has the shape {list(x.shape)}", str(list(moved.shape)))
    limit = ROUNDING + RELATIVE_ROUNDING * _largest(x)
    check.small(_largest(system.difference(x, moved) - v), limit, "(x (+) v) (-) x = v")
    check.small(_largest(system.difference(moved, x) + v), limit, "x (-) (x (+) v) = -v")
    check.small(_largest(system.difference(x, x)), 1e-3 * limit, "x (-) x = 0")


def _check_embedding(check: _Check, system: AnySystem, x: Array, v: Array) -> None:
    """That images are no farther apart than the points, and not in one place."""
    here, length = system.embed(x), float(np.linalg.norm(v))
    limit = ROUNDING + RELATIVE_ROUNDING * _largest(x)
    far = float(np.linalg.norm(system.embed(system.integrate(x, v)) - here))
    check.small(
        far - length, limit, "images of points are no farther apart than the points, |e(x (+) v) - e(x)| <= |v|"
    )
    near = float(np.linalg.norm(system.embed(system.integrate(x, TINY * v)) - here))
    check.true(
        near > 0.3 * TINY * length or length == 0.0,
        "the embedding keeps near points apart, |e(x (+) v) - e(x)| > 0.3 |v| for short v",
        f"{near:.3g} for |v| = {TINY * length:.3g}",
    )


def _check_bounds(check: _Check, system: AnySystem, x: Array, v: Array) -> None:
    """That the slacks change along v as the bound normals say."""
    slack, B = system.slack(x), system.bound_normals
    shape = (len(slack), system.tangent_size)
    check.true(B.shape == shape, f"there is a bound normal for each slack, {list(shape)}", str(list(B.shape)))
    change = system.slack(system.integrate(x, SHORT * v)) - slack + SHORT * (B @ v)
    limit = ROUNDING + RELATIVE_ROUNDING * max(_largest(x), _largest(slack))
    check.small(_largest(change), limit, "bounds are linear, slack(x (+) v) = slack(x) - B v for short v")


# Patches --------------------------------------------------------------------------------------------


def _check_intervals(check: _Check, patch: Patch) -> list[tuple[float, float]]:
    """The ranges of u and v to try; (0, 0) for a parameter that the patch does not have."""
    ranges = []
    for name in ("u", "v"):
        if name not in patch.parameters:
            ranges.append((0.0, 0.0))
            continue
        low, high = patch.interval(name) or (-np.pi, np.pi)
        check.true(low < high, f"the interval of {name} has a lower end below its upper one", f"({low}, {high})")
        ranges.append((low, high) if np.isfinite(high - low) else TRIED)
    return ranges


def _check_frame(check: _Check, core: _core.Patch, u: float, v: float) -> None:
    """That tangents and normal are orthonormal, and the surface's own tangents normal to the normal."""
    p = core.evaluate(u, v)
    frame = np.array([p["a"], p["b"], p["m"]])
    check.small(_largest(frame @ frame.T - np.eye(3)), 1e-12, "the tangents a, b and the normal m are orthonormal")
    for name in ("o_u", "o_v"):
        check.small(abs(float(p[name] @ p["m"])), 1e-12, f"{name} is normal to the normal m [m]")


def _check_points(check: _Check, patch: Patch, core: _core.Patch, u: float, v: float) -> None:
    """That the patch's own methods give the point and the normal."""
    p = core.evaluate(u, v)
    check.small(_largest(patch.point(u, v) - p["o"]), 0.0, "point(u, v) is the point o [m]")
    check.small(_largest(patch.normal_at(u, v) - p["m"]), 0.0, "normal_at(u, v) is the normal m")


def _check_derivatives(check: _Check, core: _core.Patch, u: float, v: float, tolerance: float | None) -> None:
    """That the derivatives are those of differences: central ones, or to one side where a spline has a knot."""
    h = 1e-6
    here = core.evaluate(u, v)
    for name, (du, dv) in {"u": (h, 0.0), "v": (0.0, h)}.items():
        p = {k: core.evaluate(u + k * du, v + k * dv) for k in (-2, -1, 1, 2)}
        for quantity in "omab":
            value = here[f"{quantity}_{name}"]
            central = (p[1][quantity] - p[-1][quantity]) / (2 * h)
            ahead = (4 * p[1][quantity] - p[2][quantity] - 3 * here[quantity]) / (2 * h)
            behind = (3 * here[quantity] - 4 * p[-1][quantity] + p[-2][quantity]) / (2 * h)
            error = min(_largest(value - slope) for slope in (central, ahead, behind))
            limit = DERIVATIVE * max(1.0, _largest(value)) if tolerance is None else tolerance
            check.small(error, limit, f"{quantity}_{name} is the derivative of {quantity} by {name}")


def _check_locate(check: _Check, patch: Patch, u: float, v: float, height: float) -> None:
    """That the nearest point to one of the patch is that point, and to one above it no farther than the height."""
    point = patch.point(u, v)
    gap = float(np.linalg.norm(patch.point(*patch.locate(point)) - point))
    check.small(gap, FOUND, "locate finds the parameters of a point of the patch, point(locate(o)) = o [m]")
    above = point + height * patch.normal_at(u, v)
    gap = float(np.linalg.norm(patch.point(*patch.locate(above)) - above))
    check.small(
        gap - height, ABOVE, f"locate finds a point as near as {height:.3g} m to one at that height above the patch [m]"
    )


def _check_plain_data(check: _Check, patch: Patch, place: Sequence[float]) -> None:
    """That the plain data make the same patch again."""
    data = patch.to_dict()
    again = patch_from_dict(data)
    check.true(
        again.to_dict() == data, "the patch made of its plain data has the same plain data", str(again.to_dict())
    )
    change = max(
        _largest(again.point(*place) - patch.point(*place)), _largest(again.normal_at(*place) - patch.normal_at(*place))
    )
    check.small(change, 0.0, "the patch made of its plain data has the same points and normals")
