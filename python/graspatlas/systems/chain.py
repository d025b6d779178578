"""A chain of points on a manifold, the quadratic model of its energy, and what a black box forbids to its points."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from graspatlas.support.arrays import Array, BoolArray, IndexArray
from graspatlas.systems.system import AnySystem
from graspatlas.systems.tangent_maps import point_above, tangent_bases

__all__ = ["Allowed", "Chain", "HalfSpaces"]

#: Tells which points [n, configuration_size] may be part of the chain [n].
Allowed = Callable[[Array], BoolArray]
#: Step of the differences by which the energy is derived, as a share of a step of the chain.
DIFFERENCE = 1e-2
#: What is asked round a place says nothing of a border when the sum of the directions is shorter than this.
NO_SIDE = 1e-9
#: Halvings of a move that find where it leaves what is allowed, and how far from there, as a share of a step, it is
#: asked on which side that lies.
BORDER_HALVINGS = 6
PROBE = 0.25
#: Steps of the interior-point method, share of the complementarity that each aims at, and what may be left of it.
MAX_INTERIOR_STEPS = 60
CENTRING = 0.1
INTERIOR_TOLERANCE = 1e-10


class Chain:
    """A chain X (n, configuration_size) with its energy, and the quadratic model of that in the tangent spaces."""

    def __init__(self, system: AnySystem, X: Array) -> None:
        self.system, self.X = system, X
        steps = np.array([system.difference(a, b) for a, b in pairwise(X)])
        lengths = np.linalg.norm(steps, axis=1)
        self.energy = 0.5 * float(lengths @ lengths)
        self.longest = float(lengths.max())

    @cached_property
    def model(self) -> tuple[Array, Array, Array, Array]:
        """Tangent bases [n, k, v], gradient [n, k], and bounds C [n, b, k], S [n, b]: C u <= S."""
        Phi = tangent_bases(self.system, self.X)
        S = np.array([self.system.slack(x) for x in self.X])
        return Phi, self._gradient(Phi), self.system.bound_normals @ Phi.transpose(0, 2, 1), S

    def _gradient(self, Phi: Array) -> Array:
        """Derivative of the energy by u [n, k], by central differences; zero at the ends.

        Differences of points are no vectors of one space, such as those of poses, so this is not their difference.
        """
        h = DIFFERENCE * self.longest
        gradient = np.zeros(Phi.shape[:2])
        integrate = self.system.integrate
        for i in range(1, len(self.X) - 1):
            for a, direction in enumerate(h * Phi[i]):
                ahead, behind = (self.local_energy(i, integrate(self.X[i], sign * direction)) for sign in (1.0, -1.0))
                gradient[i, a] = (ahead - behind) / (2.0 * h)
        return gradient

    def local_energy(self, i: int, x: Array) -> float:
        """Energy of the two steps at point i, if that were at x."""
        before = self.system.difference(self.X[i - 1], x)
        after = self.system.difference(x, self.X[i + 1])
        return 0.5 * float(before @ before + after @ after)

    def plan(self, learned: HalfSpaces, trust_radius: float) -> Array:
        """Moves u [n, k] that lower the model's energy most inside the bounds, by a primal-dual interior-point method.

        Args:
            learned: Half-spaces beside the bounds.
            trust_radius: Half-spaces farther away than this play no part.
        """
        Phi, gradient, C, S = self.model
        C = np.concatenate([C, learned.normals[:, None]], axis=1)
        S = np.column_stack([S, learned.offsets])
        near = trust_radius * np.linalg.norm(C, axis=2) >= S
        near[[0, -1]] = False
        rows = near.any(axis=0)
        if not rows.any():
            return self._solve(gradient)
        near = near[:, rows]
        C, S = np.where(near[..., None], C[:, rows], 0.0), np.where(near, S[:, rows], 1.0)
        u = np.zeros_like(gradient)
        first = mu = float(np.abs(gradient).max()) * self.longest
        s = np.maximum(S, 1e-3 * trust_radius)  # distances from the bounds
        z = np.where(near, mu / s, 0.0)  # forces of the bounds
        for _ in range(MAX_INTERIOR_STEPS):
            off = np.einsum("nbk,nk->nb", C, u) + s - S
            aim = np.where(near, (CENTRING * mu + z * off) / s, 0.0)
            force = gradient + self._stiffness(Phi, u) + np.einsum("nbk,nb->nk", C, aim)
            du = self._solve(force, np.einsum("nbi,nb,nbj->nij", C, z / s, C))
            ds = -off - np.einsum("nbk,nk->nb", C, du)
            dz = np.where(near, CENTRING * mu / s - z - z / s * ds, 0.0)
            ratios = np.concatenate([(-ds / s)[near], (-dz / np.where(near, z, 1.0))[near]])
            share = min(1.0, 0.99 / max(float(ratios.max()), 1e-300))
            u, s, z = u + share * du, s + share * ds, z + share * dz
            mu = float((s * z)[near].mean())
            if mu < INTERIOR_TOLERANCE * first and np.abs(off[near]).max() < INTERIOR_TOLERANCE * trust_radius:
                break
        return u

    @staticmethod
    def _stiffness(Phi: Array, u: Array) -> Array:
        """Hessian of the model times u: each point is coupled to the two beside it [n, k]."""
        v = np.einsum("nkv,nk->nv", Phi, u)
        beside = np.zeros_like(v)
        beside[1:] += v[:-1]
        beside[:-1] += v[1:]
        return np.asarray(2.0 * u - np.einsum("nkv,nv->nk", Phi, beside))

    def _solve(self, force: Array, barrier: float | Array = 0.0) -> Array:
        """Moves du [n, k] with (Hessian + barrier) du = -force, and none of the ends; barrier (n, k, k)."""
        from scipy.linalg import solveh_banded  # slow to import

        n, k = force.shape
        free = np.ones((n, 1, 1))
        free[[0, -1]] = 0.0
        diagonal = (1.0 + free) * np.eye(k) + free * barrier
        below = free[1:] * self._couplings * free[:-1]
        bands = np.zeros((2 * k, n, k))
        for row in range(k):
            for column in range(k):
                if row >= column:
                    bands[row - column, :, column] = diagonal[:, row, column]
                bands[k + row - column, :-1, column] = below[:, row, column]
        du = solveh_banded(bands.reshape(2 * k, n * k), -(free[..., 0] * force).ravel(), lower=True)
        return np.asarray(du.reshape(n, k))

    @cached_property
    def _couplings(self) -> Array:
        """Blocks of the Hessian between neighbouring points [n - 1, k, k]."""
        Phi = self.model[0]
        return np.asarray(-Phi[1:] @ Phi[:-1].transpose(0, 2, 1))

    def moved(self, u: Array) -> Array | None:
        """The points of the manifold above u [n, k], inside their bounds; None when one cannot be projected."""
        X: Array = self.X.copy()
        for i in np.flatnonzero(np.any(u != 0.0, axis=1)):
            x = point_above(self.system, self.X[i], self.model[0][i], u[i])
            if x is None:
                return None
            X[i] = x
        return X

    def above(self, i: int, u: Array) -> Array:
        """The point of the manifold above u [k] at point i; point i where there is none."""
        x = point_above(self.system, self.X[i], self.model[0][i], u)
        return np.asarray(self.X[i] if x is None else x)


@dataclass(frozen=True, eq=False)
class HalfSpaces:
    """What a black box forbids, as one half-space of each tangent space: normals (n, k), offsets (n,).

    One is learned by halving the move that leads out of what is allowed, and by asking round the place where it does.
    """

    normals: Array
    offsets: Array

    @classmethod
    def none(cls, chain: Chain) -> HalfSpaces:
        """None yet."""
        n, k = len(chain.X), chain.system.dimension
        return cls(np.zeros((n, k)), np.full(n, np.inf))

    def add(self, chain: Chain, points: IndexArray, u: Array, allowed: Allowed) -> None:
        """Add those between points and the places to which they would move, u (n, k)."""
        share, width = np.zeros(len(points)), 1.0
        for _ in range(BORDER_HALVINGS):
            width /= 2.0
            tried = np.array([chain.above(i, (f + width) * u[i]) for i, f in zip(points, share, strict=True)])
            share += np.where(allowed(tried), width, 0.0)
        ring = _directions(u.shape[1])
        places = share[:, None] * u[points]
        probe = PROBE * chain.longest
        asked = [chain.above(i, place + probe * e) for i, place in zip(points, places, strict=True) for e in ring]
        side = np.where(allowed(np.array(asked)), -1.0, 1.0).reshape(len(points), len(ring)) @ ring
        size = np.linalg.norm(side, axis=1, keepdims=True)
        ahead = u[points] / np.linalg.norm(u[points], axis=1, keepdims=True)
        self.normals[points] = np.where(size > NO_SIDE, side / np.maximum(size, NO_SIDE), ahead)
        self.offsets[points] = np.maximum(np.sum(self.normals[points] * places, axis=1), 0.0)


def _directions(k: int) -> Array:
    """Unit vectors along the axes of R^k and halfway between every two of them [2 k^2, k]."""
    axes = np.concatenate([np.eye(k), -np.eye(k)])
    between = [(a + b) / np.sqrt(2.0) for i, a in enumerate(axes) for b in axes[:i] if a @ b == 0.0]
    return np.array([*axes, *between])
