"""The simplest surface that fits points with normals."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from graspatlas.patches.spline import clamped_knots
from graspatlas.regions.surfaces import Ball, Flat, Graph, Outline, Surface, Turned, frame_about, natural_splines
from graspatlas.support.arrays import Array, BoolArray, IndexArray, IntArray

__all__ = ["Samples", "fits", "fitted_ball", "fitted_flat", "fitted_round", "rough_round", "simplest_surface"]

#: Shares of the area that must lie within the tolerance, and whose normals must agree.
WITHIN, AGREEING = 0.98, 0.95
#: Normals of the surface and of the mesh agree within this angle [rad]: 25 degrees.
SAME_NORMAL = np.radians(25.0)
#: Points farther from a first fit than so many tolerances are left out of the second.
OUTLIERS = 2.0
#: Normals of the graph of a spline turn from its plane's by this at most [rad]: 70 degrees.
STEEPEST = np.radians(70.0)
#: Radii beyond this many sizes of the region are those of planes.
LARGEST_RADIUS = 50.0
#: How far the centroid of points on a sphere is from its centre, in radii: of a bit more than a half, and of the whole.
HALF, WHOLE = 0.45, 0.02
#: Numbers of control points along the longer side of a spline that are tried, and along an outline.
NETS, OUTLINES = (5, 7, 10, 14, 18), (4, 6, 9, 13, 18, 24)
#: Weight of the bends of a control net beside the points.
SMOOTHING = 1e-4
#: Most points of the fits by iteration.
ITERATED = 400


@dataclass(frozen=True, eq=False)
class Samples:
    """Points spread evenly over a part of a mesh.

    Attributes:
        points: Places (n, 3) [m].
        normals: Outward unit normals there (n, 3).
        faces: Faces that they lie on (n,).
    """

    points: Array
    normals: Array
    faces: IntArray

    def __getitem__(self, which: IntArray | BoolArray | IndexArray) -> Samples:
        return Samples(self.points[which], self.normals[which], self.faces[which])

    def __len__(self) -> int:
        return len(self.points)

    @property
    def size(self) -> float:
        """Diagonal of the box around them [m]."""
        return float(np.linalg.norm(np.ptp(self.points, axis=0)))


def fits(surface: Surface, samples: Samples, tolerance: float) -> bool:
    """Whether a surface lies within the tolerance of nearly all points, and its normals agree with theirs."""
    near = np.abs(surface.distances(samples.points)) <= tolerance
    if np.mean(near & surface.regular(samples.points)) < WITHIN:
        return False
    cosines = np.einsum("nk,nk->n", surface.normals(samples.points), samples.normals)
    return bool(np.mean(cosines >= np.cos(SAME_NORMAL)) >= AGREEING)


def lying_on(surface: Surface, samples: Samples, tolerance: float) -> BoolArray:
    """Which samples lie on a surface, and their normals with its (n,)."""
    near = np.abs(surface.distances(samples.points)) <= tolerance
    cosines = np.einsum("nk,nk->n", surface.normals(samples.points), samples.normals)
    return np.asarray(near & (cosines >= np.cos(SAME_NORMAL)))


def simplest_surface(samples: Samples, tolerance: float, *, freeform: bool = True) -> Surface | None:
    """The first that fits of plane, cylinder, sphere, cone, torus, surface of revolution and, if wanted, spline."""
    tries: list[Callable[[Samples, float], Iterator[Surface]]] = [_flats, _rounds]
    if freeform:
        tries.append(_graphs)
    for surfaces in tries:
        for surface in surfaces(samples, tolerance):
            if fits(surface, samples, tolerance):
                return surface
    return None


def _flats(samples: Samples, tolerance: float) -> Iterator[Surface]:
    yield fitted_flat(samples)


def _rounds(samples: Samples, tolerance: float) -> Iterator[Surface]:
    """Turned surfaces and spheres from the simplest on, each fitted again without what lies far off the first fit."""
    for kind in ("cylinder", "sphere", "cone", "torus", "revolution"):
        surface = fitted_round(kind, samples, tolerance)
        if surface is not None:
            yield surface


# Planes and spheres -----------------------------------------------------------------------------------


def fitted_flat(samples: Samples) -> Flat:
    """The plane of least squares, with u along the longer side of the smallest rectangle around the points."""
    middle = samples.points.mean(axis=0)
    _, axes = np.linalg.eigh(np.cov((samples.points - middle).T))
    normal = axes[:, 0] * (1.0 if axes[:, 0] @ samples.normals.sum(axis=0) >= 0.0 else -1.0)
    return Flat(middle, _rectangle_axes(samples.points - middle, normal, axes[:, 2]))


def _rectangle_axes(points: Array, normal: Array, hint: Array) -> Array:
    """Axes (3, 3): along the longer and the shorter side of the smallest rectangle around points, and the normal."""
    y, x = frame_about(normal, hint)[:, 2], frame_about(normal, hint)[:, 0]
    angles = np.linspace(0.0, 0.5 * np.pi, 91)[:-1]
    along = np.outer(points @ x, np.cos(angles)) + np.outer(points @ y, np.sin(angles))
    across = np.outer(points @ y, np.cos(angles)) - np.outer(points @ x, np.sin(angles))
    spans = np.ptp(along, axis=0), np.ptp(across, axis=0)
    best = int(np.argmin(np.round(spans[0] * spans[1], 12)))
    u = np.cos(angles[best]) * x + np.sin(angles[best]) * y
    if spans[1][best] > spans[0][best]:
        u = np.cross(normal, u)
    return np.column_stack([u, np.cross(normal, u), normal])


def fitted_ball(samples: Samples) -> Ball | None:
    """The sphere on which points and normals agree best: p = c + r n, by linear least squares and then by distances."""
    p, n = samples.points, samples.normals
    pm, nm = p.mean(axis=0), n.mean(axis=0)
    spread = float(((n - nm) ** 2).sum())
    if spread < 1e-6 * len(p):
        return None
    radius = float(((p - pm) * (n - nm)).sum()) / spread
    center = pm - radius * nm
    for _ in range(5):  # Gauss-Newton on the distances
        out = p - center
        lengths = np.linalg.norm(out, axis=1)
        J = np.column_stack([-out / np.maximum(lengths, 1e-300)[:, None], -np.ones(len(p))])
        step = np.linalg.lstsq(J, -(lengths - abs(radius)), rcond=1e-9)[0]
        center, radius = center + step[:3], float(np.copysign(abs(radius) + step[3], radius))
    if not 0.0 < abs(radius) < LARGEST_RADIUS * samples.size:
        return None
    return _placed_ball(center, abs(radius), radius < 0.0, p)


def _placed_ball(center: Array, radius: float, flipped: bool, points: Array) -> Ball:
    """A sphere whose poles lie away from the points, if they leave room."""
    out = points.mean(axis=0) - center
    share = float(np.linalg.norm(out)) / radius  # 0 for the whole sphere, 1/2 for a half, 1 for a point
    if share > HALF:
        out = out / np.linalg.norm(out)
        across = np.eye(3)[np.argmin(np.abs(out))]
        return Ball(center, radius, flipped, frame_about(np.cross(out, across), out))
    axis = out if share > WHOLE else np.array([0.0, 0.0, 1.0])
    return Ball(center, radius, flipped, frame_about(axis, np.eye(3)[np.argmin(np.abs(axis))]))


# Turned surfaces --------------------------------------------------------------------------------------


def fitted_round(kind: str, samples: Samples, tolerance: float) -> Surface | None:
    """The best turned surface, or sphere, of a kind; None where there is none."""
    best, error = None, np.inf
    for surface in _round_candidates(kind, samples):
        gaps = np.abs(surface.distances(samples.points))
        kept = samples[gaps <= max(OUTLIERS * tolerance, float(np.median(gaps)))]
        for again in _round_candidates(kind, kept, surface) if len(kept) > 20 else ():
            gap = float(np.mean(np.minimum(np.abs(again.distances(samples.points)), OUTLIERS * tolerance) ** 2))
            if gap < error:
                best, error = again, gap
    return best


def rough_round(kind: str, samples: Samples, first: Surface | None = None) -> Surface | None:
    """A turned surface, or sphere, by linear least squares; about the axis of another fit of outlines by height."""
    if kind in ("torus", "revolution") and isinstance(first, Turned):
        return _turned(kind, samples, first.origin, first.axes[:, 1])
    return next(iter(_round_candidates(kind, samples)), None)


def _round_candidates(kind: str, samples: Samples, first: Surface | None = None) -> Iterator[Surface]:
    if kind == "sphere":
        ball = fitted_ball(samples)
        if ball is not None:
            yield ball
        return
    axes = [(first.origin, first.axes[:, 1])] if isinstance(first, Turned) else list(_axes(kind, samples))
    for origin, axis in axes:
        surface = _turned(kind, samples, origin, axis)
        if surface is not None and first is not None:
            surface = _refined(kind, samples, surface)
        if surface is not None:
            yield surface


def _axes(kind: str, samples: Samples) -> Iterator[tuple[Array, Array]]:
    """A point and the direction of axes about which the points may be turned.

    Normals of a surface of revolution meet its axis: n . (c + a x p) = 0, with the direction a and the moment c of the
    axis (Pottmann and Wallner, "Computational Line Geometry", 2001, section 5.3). Those of a cylinder, moreover, are
    normal to it, and those of a cone make one angle with it.
    """
    middle, size = samples.points.mean(axis=0), max(samples.size, 1e-12)
    p, n = (samples.points - middle) / size, samples.normals
    if kind in ("torus", "revolution"):
        M = np.column_stack([np.cross(p, n), n])
        S = M.T @ M / len(M)
        A, B, C = S[:3, :3], S[:3, 3:], S[3:, 3:]
        inverse = np.linalg.pinv(C + 1e-9 * np.eye(3))
        _, directions = np.linalg.eigh(A - B @ inverse @ B.T)
        for a in directions.T[: 2 if kind == "revolution" else 1]:
            c = -inverse @ B.T @ a
            yield middle + size * np.cross(a, c), a
        return
    mean = n.mean(axis=0) if kind == "cone" else np.zeros(3)
    _, directions = np.linalg.eigh((n - mean).T @ (n - mean))
    a = directions[:, 0]
    yield _center_line(p, n, a) * size + middle, a


def _center_line(p: Array, n: Array, a: Array) -> Array:
    """The point of the axis along a that the normals meet best, by linear least squares."""
    across = n - np.outer(n @ a, a)
    lengths = np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-9)
    side = np.cross(a, across / lengths)  # the axis lies in the plane of a and n through p: side . (p - q) = 0
    weight = side * lengths
    q = np.linalg.lstsq(weight, np.einsum("nk,nk->n", weight, p), rcond=1e-6)[0]
    return np.asarray(q - (q @ a) * a)


def _turned(kind: str, samples: Samples, origin: Array, axis: Array) -> Turned | None:
    """The surface of a kind about an axis: a line, circle or curve through the points' radii and heights."""
    local = samples.points - origin
    h = local @ axis
    low, high = float(h.min()), float(h.max())
    middle = 0.5 * (low + high)
    origin, h, half = origin + middle * axis, h - middle, 0.5 * (high - low)
    across = local - np.outer(local @ axis, axis)
    r = np.linalg.norm(across, axis=1)
    out = np.einsum("nk,nk->n", across / np.maximum(r, 1e-300)[:, None], samples.normals)
    hint = across.mean(axis=0)
    if np.linalg.norm(hint) < 0.3 * r.mean():  # all round: any direction will do, but let it be stable
        hint = np.eye(3)[np.argmin(np.abs(axis))]
    outline = _outline(kind, h, r, samples.normals @ axis, out, half, samples.size)
    if outline is None:
        return None
    sense = out if kind != "torus" else _tube_sense(outline, h, r, samples.normals @ axis, out)
    return Turned(origin, frame_about(axis, hint), outline, bool(np.median(sense) < 0.0))


def _tube_sense(outline: Outline, h: Array, r: Array, along: Array, out: Array) -> Array:
    a, b = outline.normals(h, r)
    return a * along + b * out


def _outline(kind: str, h: Array, r: Array, along: Array, out: Array, half: float, size: float) -> Outline | None:
    if half < 1e-9 * size or r.mean() > LARGEST_RADIUS * size:
        return None
    ends = np.array([-half, half])
    if kind == "cylinder":
        return Outline(kind, ends, np.full(2, float(r.mean())))
    if kind == "cone":
        slope, middle = np.polyfit(h, r, 1)
        radii = middle + slope * ends
        return Outline(kind, ends, radii) if abs(slope) < 20.0 and radii.max() > 0.0 else None
    if kind == "torus":
        return _circle(h, r, along, out, size)
    return _curve(h, r, half)


def _circle(h: Array, r: Array, along: Array, out: Array, size: float) -> Outline | None:
    """The circle through heights and radii: by normals, and then by distances."""
    q, m = np.column_stack([h, r]), np.column_stack([along, out])
    spread = ((m - m.mean(axis=0)) ** 2).sum()
    if spread < 1e-6 * len(h):
        return None
    tube = ((q - q.mean(axis=0)) * (m - m.mean(axis=0))).sum() / spread
    center = q.mean(axis=0) - tube * m.mean(axis=0)
    tube = abs(float(tube))
    for _ in range(5):
        gap = q - center
        lengths = np.maximum(np.linalg.norm(gap, axis=1), 1e-300)
        J = np.column_stack([-gap / lengths[:, None], -np.ones(len(q))])
        step = np.linalg.lstsq(J, tube - lengths, rcond=1e-9)[0]
        center, tube = center + step[:2], tube + float(step[2])
    if not (0.0 < tube < LARGEST_RADIUS * size and center[1] > 1.05 * tube):
        return None
    return Outline("torus", center[:1], center[1:], tube)


def _curve(h: Array, r: Array, half: float) -> Outline | None:
    """A natural cubic spline of the radius by height, with as few knots as follow the points."""
    if half < 1e-9 or r.min() < 0.0:
        return None
    best = None
    last = np.inf
    for count in OUTLINES:
        knots = np.linspace(-half, half, count)
        A = natural_splines((h + half) / (2.0 * half), count)
        D = np.diff(np.eye(count), 2, axis=0)
        radii = np.linalg.solve(A.T @ A + 1e-3 * len(h) / count * (D.T @ D) + 1e-9 * np.eye(count), A.T @ r)
        if not (radii > 0.0).all():
            continue
        outline = Outline("revolution", knots, radii)
        error = float(np.sqrt(np.mean(outline.distances(h, r) ** 2)))
        if error < 0.8 * last:
            best, last = outline, error
        else:
            break
    return best


def _refined(kind: str, samples: Samples, surface: Turned) -> Turned | None:
    """The surface whose axis makes the distances least: two turns and two shifts of the axis, by Gauss-Newton."""
    few = samples[np.linspace(0, len(samples) - 1, min(len(samples), ITERATED)).astype(int)]
    x, axis, z = surface.axes.T
    origin, size = surface.origin, max(samples.size, 1e-12)

    def moved(w: Array) -> tuple[Array, Array]:
        direction = axis + w[2] * x + w[3] * z
        return origin + size * (w[0] * x + w[1] * z), direction / np.linalg.norm(direction)

    def gaps(w: Array) -> Array | None:
        found = _turned(kind, few, *moved(w))
        return None if found is None else found.distances(few.points) / size

    best, value = np.zeros(4), gaps(np.zeros(4))
    step_size = 1e-4
    for _ in range(6):
        if value is None:
            return None
        columns = [gaps(best + step_size * e) for e in np.eye(4)]
        if any(column is None for column in columns):
            break
        J = (np.column_stack([c for c in columns if c is not None]) - value[:, None]) / step_size
        step = np.linalg.lstsq(J, -value, rcond=1e-4)[0]
        trial = gaps(best + step)
        if trial is None or trial @ trial > (1.0 - 1e-4) * (value @ value):
            break
        best, value = best + step, trial
    return _turned(kind, samples, *moved(best))


# Splines ----------------------------------------------------------------------------------------------


def _graphs(samples: Samples, tolerance: float) -> Iterator[Surface]:
    """Splines over the plane that the normals point away from, with more and more control points."""
    up = samples.normals.sum(axis=0)
    if np.linalg.norm(up) < 1e-3 * len(samples):
        return
    up = up / np.linalg.norm(up)
    if np.mean(samples.normals @ up >= np.cos(STEEPEST)) < WITHIN:
        return
    middle = samples.points.mean(axis=0)
    axes = _rectangle_axes(samples.points - middle, up, np.eye(3)[np.argmin(np.abs(up))])
    local = (samples.points - middle) @ axes
    low, high = local[:, :2].min(axis=0), local[:, :2].max(axis=0)
    middle = middle + axes[:, :2] @ (0.5 * (low + high))
    half = np.maximum(0.5 * (high - low), 1e-9) * 1.002
    local = (samples.points - middle) @ axes
    for count in NETS:
        counts = [count, max(4, round(count * half[1] / half[0]))]
        if counts[0] * counts[1] > len(samples) / 4:
            return
        yield _graph(middle, axes, local, half, counts)


def _graph(middle: Array, axes: Array, local: Array, half: Array, counts: list[int]) -> Graph:
    """The heights of a net by least squares, with a penalty on bends where nothing else decides."""
    from scipy.interpolate import BSpline  # slow to import

    knots = [clamped_knots(n, 3, -float(h), float(h)) for n, h in zip(counts, half, strict=True)]
    U, V = (BSpline.design_matrix(np.clip(local[:, i], -half[i], half[i]), knots[i], 3).toarray() for i in range(2))
    A = np.einsum("ni,nj->nij", U, V).reshape(len(local), -1)
    D, E = (np.diff(np.eye(n), 2, axis=0) for n in counts)
    bends = np.kron(D.T @ D, np.eye(counts[1])) + np.kron(np.eye(counts[0]), E.T @ E)
    weight = SMOOTHING * len(local) / len(A[0])
    net = np.linalg.solve(A.T @ A + weight * bends + 1e-12 * np.eye(len(bends)), A.T @ local[:, 2])
    return Graph(middle, axes, net.reshape(counts), knots[0], knots[1])
