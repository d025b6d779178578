"""Algorithm 1 for surfaces (k = 2) in plain NumPy: what a careful user would write in an afternoon.

The same steps and tests as the compiled core: Newton's method by `numpy.linalg.solve`, polygons cut by half-planes, and
neighbours found by comparing with all centres at once. ``compare.py`` holds the core against it.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

import graspatlas as ga

Array = NDArray[np.float64]

ZERO = 1e-11
MAX_ITERATIONS = 10
SHRINK = 0.9
SMALLEST_STEP = 0.05


@dataclass
class NumpyAtlas:
    """Charts of a surface; `build` grows them.

    Attributes:
        system: The equations; only their values and the addition of the configuration space are used.
        radius, epsilon: r and epsilon of the paper.
        centers, bases, polygons: Of the charts: [n, size of x], [n, 2, size of v], and corners in order [c, 2].
        embedded: Euclidean images of the centres, in an array that grows by doubling.
    """

    system: ga.systems.AnySystem
    radius: float
    epsilon: float
    centers: list[Array] = field(default_factory=list)
    bases: list[Array] = field(default_factory=list)
    polygons: list[Array] = field(default_factory=list)
    embedded: Array = field(default_factory=lambda: np.empty((0, 0)))

    def build(self, x0: ArrayLike) -> NumpyAtlas:
        """Cover the surface through a point on it."""
        x = np.asarray(x0, float)
        self._add(x, np.linalg.svd(self.system.evaluate_jacobian(x))[2][self.system.n_equations :])
        for i, _ in enumerate(self.centers):  # grows while it is walked
            closed: list[Array] = []
            while (corner := self._expandable(i, closed)) is not None:
                new = self._step(i, corner / np.linalg.norm(corner))
                if new is not None:
                    self._add(*new)
                if new is None or (self.polygons[i] == corner).all(axis=1).any():
                    closed.append(corner)
        return self

    def _expandable(self, i: int, closed: list[Array]) -> Array | None:
        """The corner of a polygon farthest outside its ball."""
        polygon = self.polygons[i]
        lengths = np.linalg.norm(polygon, axis=1)
        for corner in closed:
            lengths[(polygon == corner).all(axis=1)] = 0.0
        farthest = int(lengths.argmax())
        return polygon[farthest].copy() if lengths[farthest] > self.radius else None

    def _step(self, i: int, direction: Array) -> tuple[Array, Array] | None:
        """A new centre and its basis, as far from chart i as the tests allow."""
        alpha = self.radius
        while alpha >= SMALLEST_STEP * self.radius:
            new = self._project(
                self.system.integrate(self.centers[i], alpha * direction @ self.bases[i]), self.bases[i]
            )
            if new is not None and self.system.slack(new[0]).min(initial=0.0) >= 0.0 and self._neighbours([i], *new)[0]:
                return new
            alpha *= SHRINK
        return None

    def _project(self, x: Array, Phi: Array) -> tuple[Array, Array] | None:
        """Newton's method, eq (15), and the tangent basis where it ends."""
        for _ in range(MAX_ITERATIONS):
            R = self.system.evaluate_residual(x)
            A = np.vstack([self.system.evaluate_jacobian(x), Phi])
            if np.abs(R).max() <= ZERO:
                tangents = np.linalg.solve(A, np.eye(len(A))[:, len(R) :])
                return x, np.linalg.qr(tangents)[0].T
            x = self.system.integrate(x, np.linalg.solve(A, -np.r_[R, 0.0, 0.0]))
        return None

    def _neighbours(self, charts: ArrayLike, x: Array, Phi: Array) -> tuple[Array, Array, Array]:
        """Which charts pass eqs (17) and (18) with a point, and the images of the centres in each other's plane."""
        d = np.array([self.system.difference(self.centers[c], x) for c in np.asarray(charts)])
        B = np.array([self.bases[c] for c in np.asarray(charts)])
        there, back = np.einsum("nkv,nv->nk", B, d), -d @ Phi.T
        squared = (d * d).sum(axis=1)
        cosine = 1.0 - self.epsilon
        limit = np.minimum(self.epsilon**2, (1.0 - cosine**2) * squared)
        near = squared <= 4.0 * self.radius**2
        flat = (squared - (there**2).sum(axis=1) <= limit) & (squared - (back**2).sum(axis=1) <= limit)
        agree = np.linalg.svd(B @ Phi.T, compute_uv=False)[:, -1] >= cosine
        return near & flat & agree, there, back

    def _add(self, x: Array, Phi: Array) -> None:
        """A chart, cut by its bounds and with its neighbours."""
        j = len(self.centers)
        point = self.system.embed(x)
        if j == 0:
            self.embedded = np.empty((64, len(point)))
        elif j == len(self.embedded):
            self.embedded = np.vstack([self.embedded, np.empty_like(self.embedded)])
        near = np.flatnonzero(((self.embedded[:j] - point) ** 2).sum(axis=1) <= 4.0 * self.radius**2)
        self.embedded[j] = point
        self.centers.append(x)
        self.bases.append(Phi)
        self.polygons.append(self.radius * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]))
        for normal, slack in zip(self.system.bound_normals @ Phi.T, self.system.slack(x), strict=True):
            self.polygons[j] = cut(self.polygons[j], normal, max(slack, 0.0))
        if len(near):
            passed, there, back = self._neighbours(near, x, Phi)
            for i, p, q in zip(near[passed], there[passed], back[passed], strict=True):
                self.polygons[i] = cut(self.polygons[i], p, 0.5 * p @ p)
                self.polygons[j] = cut(self.polygons[j], q, 0.5 * q @ q)


def cut(polygon: Array, normal: Array, offset: float) -> Array:
    """The part of a polygon with normal . u <= offset."""
    s = polygon @ normal - offset
    if (s <= 0.0).all():
        return polygon
    following, after = np.roll(polygon, -1, axis=0), np.roll(s, -1)
    corners = []
    for a, b, sa, sb in zip(polygon, following, s, after, strict=True):
        if sa <= 0.0:
            corners.append(a)
        if (sa <= 0.0) != (sb <= 0.0):
            corners.append(a + sa / (sa - sb) * (b - a))
    return np.array(corners)
