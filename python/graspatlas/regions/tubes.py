"""Bent tubes: B-splines about a curved spine, such as a banana or a handle of any section."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from graspatlas.patches.base import Interval, Patch
from graspatlas.patches.spline import BSpline, clamped_knots
from graspatlas.regions.fitting import Samples, lying_on
from graspatlas.regions.sampling import neighbours
from graspatlas.regions.surfaces import Surface, natural_splines, vector
from graspatlas.support.arrays import Array, BoolArray

__all__ = ["Spine", "Tube", "fitted_tube"]

#: Knots of the spine, rounds in which it is drawn through the middle, and points along it.
KNOTS, ROUNDS, POINTS = 5, 4, 121
#: Samples whose normals make less than 45 degrees with the spine lie on its ends.
AT_END = 0.7
#: Numbers of control points that are tried, around and along.
NETS = ((9, 5), (11, 8), (13, 12), (18, 10))
#: The tube goes all the way round when no gap between samples is wider than this [rad]: 34 degrees.
WIDEST_GAP = 0.6
#: Most of the radius of a bend that the tube's own radius is.
TIGHTEST = 0.9
#: The tube ends where it is thinner than this share of its largest radius.
THINNEST = 0.3
#: A tube is worth having when this share of the samples lies on it.
WORTH = 0.5
#: How far samples are repeated beyond the seam [rad].
BEYOND_SEAM = 0.6


@dataclass(frozen=True, eq=False)
class Spine:
    """A curve, and directions across it that turn as little as can be.

    Attributes:
        points: Places along it (k, 3) [m].
        lengths: Lengths along it to these (k,) [m].
        tangents: Unit tangents (k, 3).
        across: Unit vectors across it from which angles are counted (k, 3).
    """

    points: Array
    lengths: Array
    tangents: Array
    across: Array

    @classmethod
    def through(cls, points: Array) -> Spine:
        """The spine through places along a curve, with angle 0 on the outside of its bend."""
        lengths = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
        tangents = np.gradient(points, lengths, axis=0)
        tangents = tangents / np.linalg.norm(tangents, axis=1, keepdims=True)
        middle = len(points) // 2
        outward = points[middle] - 0.5 * (points[0] + points[-1])
        if np.linalg.norm(outward) < 0.01 * lengths[-1]:
            outward = np.eye(3)[np.argmin(np.abs(tangents[middle]))]
        across = np.zeros_like(points)
        for order in (range(middle, len(points)), range(middle, -1, -1)):
            hint = outward
            for k in order:
                hint = hint - (hint @ tangents[k]) * tangents[k]
                hint = hint / np.linalg.norm(hint)
                across[k] = hint
        return cls(points, lengths, tangents, across)

    def feet(self, points: Array) -> tuple[Array, Array, Array]:
        """Lengths along the spine [m], angles about it [rad] and distances from it [m] of points (n, 3)."""
        from scipy.spatial import cKDTree  # slow to import

        _, k = cKDTree(self.points).query(points)
        gap = points - self.points[k]
        along = np.einsum("nk,nk->n", gap, self.tangents[k])
        low = np.where(k == 0, -np.inf, -0.5 * self.lengths[1])
        high = np.where(k == len(self.points) - 1, np.inf, 0.5 * self.lengths[1])
        s = self.lengths[k] + np.clip(along, low, high)
        x = np.einsum("nk,nk->n", gap, self.across[k])
        y = np.einsum("nk,nk->n", gap, np.cross(self.tangents[k], self.across[k]))
        return s, np.arctan2(y, x), np.hypot(x, y)

    @property
    def bend(self) -> float:
        """Largest curvature [1/m]."""
        turns = np.linalg.norm(np.diff(self.tangents, axis=0), axis=1)
        return float((turns / np.diff(self.lengths)).max())


@dataclass(frozen=True, eq=False)
class Tube(Surface):
    """A bicubic spline surface around a spine; u is about the length around it, v the length along it [m].

    Attributes:
        spine: What it goes around.
        radius: Its mean radius, by which angles are multiplied [m].
        net: Control points (p, q, 3).
        u_knots: Knots of u.
        v_knots: Knots of v.
        flipped: Whether the outside is within.
    """

    spine: Spine
    radius: float
    net: Array
    u_knots: Array
    v_knots: Array
    flipped: bool
    kind: ClassVar[str] = "bspline"

    @property
    def concave(self) -> bool:
        """Whether it is the inside."""
        return self.flipped

    def _evaluated(self, uv: Array, du: int = 0, dv: int = 0) -> Array:
        """Points of the surface, or their derivatives (n, 3)."""
        from scipy.interpolate import NdBSpline  # slow to import

        low, high = np.array([self.u_knots[3], self.v_knots[3]]), np.array([self.u_knots[-4], self.v_knots[-4]])
        return np.asarray(NdBSpline((self.u_knots, self.v_knots), self.net, 3)(np.clip(uv, low, high), nu=(du, dv)))

    def parameters(self, points: Array) -> Array:
        """Lengths around and along."""
        s, angle, _ = self.spine.feet(points)
        return np.column_stack([self.radius * angle, s])

    def regular(self, points: Array) -> BoolArray:
        """Where points are between the ends."""
        s, _, _ = self.spine.feet(points)
        return np.asarray((s >= self.v_knots[3]) & (s <= self.v_knots[-4]))

    def distances(self, points: Array) -> Array:
        """Distances along the normals."""
        uv = self.parameters(points)
        beyond = uv[:, 1] - np.clip(uv[:, 1], self.v_knots[3], self.v_knots[-4])
        gap = np.einsum("nk,nk->n", points - self._evaluated(uv), self._normals(uv))
        return np.asarray(np.copysign(np.hypot(gap, beyond), gap))

    def normals(self, points: Array) -> Array:
        """Normals of the spline."""
        return self._normals(self.parameters(points))

    def _normals(self, uv: Array) -> Array:
        out = np.cross(self._evaluated(uv, 1, 0), self._evaluated(uv, 0, 1))
        out = out / np.maximum(np.linalg.norm(out, axis=1, keepdims=True), 1e-300)
        return np.asarray(-out if self.flipped else out)

    def patch(self, u: Interval | None, v: Interval) -> Patch:
        """A B-spline, with a seam on the inside of the bend."""
        ends = [(float(k[3]), float(k[-4])) for k in (self.u_knots, self.v_knots)]
        kept = [
            (max(low, least), min(high, most))
            for (low, high), (least, most) in zip((u or ends[0], v), ends, strict=True)
        ]
        return BSpline(
            control_points=tuple(tuple(vector(p) for p in row) for row in self.net),
            u_knots=tuple(map(float, self.u_knots)),
            v_knots=tuple(map(float, self.v_knots)),
            u_interval=kept[0],
            v_interval=kept[1],
            unit="m",
            flipped=self.flipped,
        )


def fitted_tube(samples: Samples, tolerance: float) -> Tube | None:
    """The tube that most of the samples lie on; None where they go round no spine."""
    spine, sign = _spine(samples)
    if spine is None:
        return None
    s, angle, radius = spine.feet(samples.points)
    on_side = np.abs(np.einsum("nk,nk->n", samples.normals, _tangents(spine, s))) < AT_END
    if on_side.sum() < 50 or not _goes_round(angle[on_side]):
        return None
    low, high = _ends(s[on_side], radius[on_side])
    mean = float(radius[on_side].mean())
    if high - low < 2.0 * mean or spine.bend * mean > TIGHTEST:
        return None
    best, most = None, WORTH * len(samples)
    for counts in NETS:
        tube = _net(samples.points[on_side], s[on_side], angle[on_side], spine, (low, high), mean, counts, sign < 0.0)
        count = float((lying_on(tube, samples, tolerance) & tube.regular(samples.points)).sum())
        if count > 1.02 * most:
            best, most = tube, count
    return best


def _spine(samples: Samples) -> tuple[Spine | None, float]:
    """The line that normals come from, p = c(s) + r(s) n, by linear least squares; and the sign of r."""
    s = _along(samples)
    if s is None:
        return None, 1.0
    points, sign = None, 1.0
    weights = np.ones(len(samples))
    spine = None
    for _ in range(ROUNDS):
        low, high = np.quantile(s, (0.01, 0.99))
        if not high > low:
            return None, 1.0
        x = np.clip((s - low) / (high - low), 0.0, 1.0)
        N = natural_splines(x, KNOTS)
        A = np.zeros((len(samples), 3, 4 * KNOTS))
        for k in range(3):
            A[:, k, k * KNOTS : (k + 1) * KNOTS] = N
            A[:, k, 3 * KNOTS :] = samples.normals[:, k, None] * N
        W = weights[:, None]
        found = np.linalg.lstsq((A * W[:, :, None]).reshape(-1, 4 * KNOTS), (samples.points * W).ravel(), rcond=1e-6)[0]
        curve = natural_splines(np.linspace(0.0, 1.0, POINTS), KNOTS)
        points = curve @ found[: 3 * KNOTS].reshape(3, KNOTS).T
        sign = float(np.sign(found[3 * KNOTS :].sum()))
        if np.linalg.norm(np.diff(points, axis=0), axis=1).min() < 1e-6 * samples.size:
            return None, sign
        spine = Spine.through(points)
        s, _, _ = spine.feet(samples.points)
        weights = np.where(np.abs(np.einsum("nk,nk->n", samples.normals, _tangents(spine, s))) < AT_END, 1.0, 0.05)
    return spine, sign


def _tangents(spine: Spine, s: Array) -> Array:
    """Tangents at lengths along a spine (n, 3)."""
    return np.asarray(spine.tangents[np.clip(np.searchsorted(spine.lengths, s), 0, len(spine.lengths) - 1)])


def _along(samples: Samples) -> Array | None:
    """Lengths of the shortest ways over the samples from one end (n,)."""
    from scipy.sparse import coo_array  # slow to import
    from scipy.sparse.csgraph import dijkstra

    i, j = neighbours(samples).T
    lengths = np.linalg.norm(samples.points[i] - samples.points[j], axis=1)
    graph = coo_array((np.maximum(lengths, 1e-12), (i, j)), (len(samples), len(samples))).tocsr()
    ways = dijkstra(graph, directed=False, indices=0)
    if np.isfinite(ways).mean() < 0.95:
        return None
    end = int(np.argmax(np.where(np.isfinite(ways), ways, -1.0)))
    ways = dijkstra(graph, directed=False, indices=end)
    return np.asarray(np.where(np.isfinite(ways), ways, ways[np.isfinite(ways)].max()))


def _goes_round(angles: Array) -> bool:
    """Whether angles leave no wide gap."""
    ordered = np.sort(angles)
    return bool(np.diff(ordered, append=ordered[0] + 2.0 * np.pi).max() < WIDEST_GAP)


def _ends(s: Array, radius: Array) -> Interval:
    """From where to where along the spine a tube is not thin."""
    order = np.argsort(s)
    width = max(len(s) // 60, 5)
    smooth = np.convolve(radius[order], np.full(width, 1.0 / width), mode="valid")
    places = np.convolve(s[order], np.full(width, 1.0 / width), mode="valid")
    thick = places[smooth >= THINNEST * np.quantile(smooth, 0.95)]
    return float(thick.min()), float(thick.max())


def _net(
    points: Array,
    s: Array,
    angle: Array,
    spine: Spine,
    ends: Interval,
    radius: float,
    counts: tuple[int, int],
    flipped: bool,
) -> Tube:
    """Control points by least squares, with samples near the seam on both of its sides."""
    from scipy.interpolate import BSpline as Basis  # slow to import

    u_knots = clamped_knots(counts[0], 3, -np.pi * radius, np.pi * radius)
    v_knots = clamped_knots(counts[1], 3, *ends)
    beyond = BEYOND_SEAM
    angles = np.concatenate([angle, angle - 2.0 * np.pi, angle + 2.0 * np.pi])
    wide = clamped_knots(counts[0], 3, -(np.pi + beyond) * radius, (np.pi + beyond) * radius)
    keep = np.abs(angles) <= np.pi + beyond
    P, S, U = np.tile(points, (3, 1))[keep], np.tile(s, 3)[keep], radius * angles[keep]
    inside = (ends[0] <= S) & (ends[1] >= S)
    P, S, U = P[inside], S[inside], U[inside]
    A, B = Basis.design_matrix(U, wide, 3).toarray(), Basis.design_matrix(S, v_knots, 3).toarray()
    M = np.einsum("ni,nj->nij", A, B).reshape(len(P), -1)
    D, E = (np.diff(np.eye(n), 2, axis=0) for n in counts)
    bends = np.kron(D.T @ D, np.eye(counts[1])) + np.kron(np.eye(counts[0]), E.T @ E)
    net = np.linalg.solve(M.T @ M + 1e-4 * len(P) / len(bends) * bends + 1e-12 * np.eye(len(bends)), M.T @ P)
    net = net.reshape(*counts, 3)
    # The same surface between seam and seam: values there, fitted again with knots that end at the seam.
    u = np.linspace(-np.pi * radius, np.pi * radius, 8 * counts[0])
    rows = Basis.design_matrix(u, wide, 3).toarray() @ net.reshape(counts[0], -1)
    C = Basis.design_matrix(u, u_knots, 3).toarray()
    net = np.linalg.lstsq(C, rows, rcond=None)[0].reshape(*counts, 3)
    return Tube(spine, radius, net, u_knots, v_knots, flipped)
