r"""Curves on a manifold, as short as they can be: from any chain of points to a shortest one between its ends.

A chain :math:`x_0, \dots, x_n` on the manifold has the energy

.. math:: E = \tfrac12 \sum_i \| x_{i+1} \ominus x_i \|^2 ,

least when the chain is a geodesic with even steps. Gauss-Newton steps in the tangent spaces at all points at once,
:math:`x_i \leftarrow x_i \oplus \Phi_i^\top u_i` and back to the manifold, lower it: one banded system a step. Bounds
are half-spaces :math:`C u \le S` of each tangent space, kept by an interior-point method. Points that would leave what
is allowed, a black box, are given half-spaces too, found by asking, and the move is planned again.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from scipy.linalg import solveh_banded

from graspatlas import _core
from graspatlas.support.arrays import Array, BoolArray, IndexArray
from graspatlas.support.progress import progress_bar
from graspatlas.systems.system import AnySystem

__all__ = ["BOUND_TOLERANCE", "Allowed", "arc_lengths", "bridge", "evenly", "nearest_point", "shorten"]

#: Tells which points [n, configuration_size] may be part of the chain [n].
Allowed = Callable[[Array], BoolArray]

#: Largest entry of |R(x)| that counts as zero, as in the projection of the compiled core.
ZERO = 1e-11
#: Iterations after which Newton's method is given up.
MAX_ITERATIONS = 12
#: Even steps are planned this much shorter than the longest, for want of an even speed along a chain.
UNEVEN = 1e-3
#: How far a point may be outside its bounds [units of the tangent space].
BOUND_TOLERANCE = 1e-9
#: Largest share of a step that one of its halves may have; a step that does not shrink leads to another sheet.
HALF = 0.75
#: Halvings after which a gap counts as one that cannot be bridged.
MAX_HALVINGS = 24
#: Step of the differences by which the energy is derived, as a share of a step of the chain.
DIFFERENCE = 1e-2
#: Steps of Gauss-Newton after which the chain is left as it is, and the relative gain that ends them before.
MAX_STEPS = 60
LEAST_GAIN = 2e-6
#: Gain that ends them where a black box limits the chain: what follows is slow and small.
LEAST_GAIN_LIMITED = 1e-5
#: Shares of a move that are tried, and rounds in which half-spaces are learned.
FRACTIONS = (1.0, 0.5, 0.25, 0.1)
ROUNDS = 3
#: Halvings of a move that find where it leaves what is allowed, and how far from there, as a share of a step, it is
#: asked on which side that lies.
BORDER_HALVINGS = 6
PROBE = 0.25
#: What is asked round a place says nothing of a border when the sum of the directions is shorter than this.
NO_SIDE = 1e-9
#: Steps of the interior-point method, share of the complementarity that each aims at, and what may be left of it.
MAX_INTERIOR_STEPS = 60
CENTRING = 0.1
INTERIOR_TOLERANCE = 1e-10


def arc_lengths(system: AnySystem, X: Array) -> Array:
    """Length of the chain from its first point to each point [n], units of the tangent space."""
    steps = [float(np.linalg.norm(system.difference(a, b))) for a, b in pairwise(X)]
    return np.concatenate([[0.0], np.cumsum(steps)])


def tangent_bases(system: AnySystem, X: Array) -> Array:
    """Orthonormal tangent bases [n, k, tangent_size], one tangent vector a row."""
    if system.n_equations == 0:
        return np.tile(np.eye(system.tangent_size), (len(X), 1, 1))
    J = np.array([system.evaluate_jacobian(x) for x in X])
    Q = np.linalg.qr(J.transpose(0, 2, 1), mode="complete")[0]
    return np.ascontiguousarray(Q[:, :, system.n_equations :].transpose(0, 2, 1))


def nearest_point(system: AnySystem, x: Array) -> Array | None:
    """The point of the manifold near x, inside its bounds: least-norm Newton steps, broken bounds held as equations.

    Returns:
        The point [configuration_size], or None when Newton's method does not converge.
    """
    B = system.bound_normals
    held = np.zeros(len(B), bool)
    for _ in range(MAX_ITERATIONS):
        R, slack = system.evaluate_residual(x), system.slack(x)
        held |= slack < 0.0
        if np.abs(R).max(initial=0.0) <= ZERO and slack.min(initial=0.0) >= -BOUND_TOLERANCE:
            return np.asarray(x)
        rows = np.vstack([system.evaluate_jacobian(x), -B[held]])
        x = system.integrate(x, -np.linalg.pinv(rows, rcond=1e-12) @ np.concatenate([R, slack[held]]))
    return None


def _above(system: AnySystem, x: Array, Phi: Array, u: Array) -> Array | None:
    """The point of the manifold above u in the tangent space at x, moved inside its bounds."""
    y = _core.project(system, x, Phi, u)
    if y is None:
        return None
    return np.asarray(y) if system.slack(y).min(initial=0.0) >= 0.0 else nearest_point(system, np.asarray(y))


def bridge(system: AnySystem, a: Array, b: Array, step: float) -> Array | None:
    """A chain on the manifold, and inside its bounds, from a to b.

    Args:
        system: The system.
        a: First point [configuration_size].
        b: Last point.
        step: Longest step [units of the tangent space].

    Returns:
        The chain [n, configuration_size], or None where no line leads from one to the other.
    """
    chain = [a]
    ahead = [(b, 0)]
    while ahead:
        target, halvings = ahead[-1]
        d = system.difference(chain[-1], target)
        length = float(np.linalg.norm(d))
        if length <= step:
            chain.append(ahead.pop()[0])
            continue
        Phi = tangent_bases(system, chain[-1][None])[0]
        middle = _above(system, chain[-1], Phi, Phi @ d / 2.0)
        if middle is None or halvings == MAX_HALVINGS:
            return None
        halves = np.linalg.norm([system.difference(chain[-1], middle), system.difference(middle, target)], axis=1)
        if halves.max() > HALF * length:
            return None
        ahead[-1] = (target, halvings + 1)
        ahead.append((middle, halvings + 1))
    return np.array(chain)


def evenly(system: AnySystem, X: Array, step: float) -> Array | None:
    """The same curve with steps of even length.

    Args:
        system: The system.
        X: A chain [n, configuration_size].
        step: Longest step [units of the tangent space].

    Returns:
        The chain, with the same ends; None when a point cannot be projected.
    """
    s = arc_lengths(system, X)
    wanted = np.linspace(0.0, s[-1], int(np.ceil(s[-1] / step * (1.0 + UNEVEN))) + 1)[1:-1]
    at = np.clip(np.searchsorted(s, wanted, side="right") - 1, 0, len(X) - 2)
    bases = dict(zip(np.unique(at).tolist(), tangent_bases(system, X[np.unique(at)]), strict=True))
    chain = [X[0]]
    for target, i in zip(wanted, at.tolist(), strict=True):
        d = system.difference(X[i], X[i + 1]) * ((target - s[i]) / (s[i + 1] - s[i]))
        x = _above(system, X[i], bases[i], bases[i] @ d)
        if x is None:
            return None
        chain.append(x)
    return np.array([*chain, X[-1]])


def shorten(
    system: AnySystem,
    X: Array,
    *,
    trust_radius: float,
    longest: float,
    allowed: Allowed | None = None,
    progress: bool = False,
) -> tuple[Array, bool]:
    """Shorten a chain between its ends until it is as short as its neighbours allow.

    Ctrl-C ends the work and returns the chain as it is: it is on the manifold and allowed at any time.

    Args:
        system: The system.
        X: The chain [n, configuration_size], on the manifold and inside its bounds.
        trust_radius: How far a point may move at once [units of the tangent space].
        longest: Longest step that the chain may have.
        allowed: Tells which points may be part of the chain; that holds for all of X.
        progress: Show a progress bar on standard error.

    Returns:
        The chain [n, configuration_size] and whether it is as short as it can be made.
    """
    if len(X) < 3:
        return X, True
    chain = _Chain(system, X)
    least = LEAST_GAIN if allowed is None else LEAST_GAIN_LIMITED
    try:
        with progress_bar("path", "steps", MAX_STEPS, progress) as bar:
            for _ in range(MAX_STEPS):
                shorter = _shortened(chain, trust_radius, longest, allowed)
                if shorter is None:
                    return chain.X, True
                gain = 1.0 - shorter.energy / chain.energy
                chain = shorter
                bar.update()
                if gain < least:
                    return chain.X, True
    except KeyboardInterrupt:
        pass
    return chain.X, False


def _shortened(chain: _Chain, trust_radius: float, longest: float, allowed: Allowed | None) -> _Chain | None:
    """The chain after one step, or None when no step makes it shorter."""
    learned = _HalfSpaces.none(chain)
    u = _capped(chain.plan(learned, trust_radius), trust_radius)
    for fraction in FRACTIONS:
        move = fraction * u
        moved = chain.moved(move) if allowed is None else _allowed_move(chain, move, fraction, trust_radius, allowed)
        if moved is None:
            continue
        shorter = _Chain(chain.system, moved)
        if shorter.energy < chain.energy and shorter.longest <= max(longest, chain.longest):
            return shorter
    return None


def _allowed_move(chain: _Chain, u: Array, fraction: float, trust_radius: float, allowed: Allowed) -> Array | None:
    """The chain moved by u [n, k], all its points allowed: by a fraction of another move where some are not."""
    learned = _HalfSpaces.none(chain)
    for attempt in range(ROUNDS + 1):
        moved = chain.moved(u)
        if moved is None:
            return None
        going = np.flatnonzero(np.any(u != 0.0, axis=1))
        bad = going[~allowed(moved[going])]
        if len(bad) == 0:
            return moved
        if attempt == ROUNDS:
            moved[bad] = chain.X[bad]
            return moved
        learned.add(chain, bad, u, allowed)
        u = fraction * _capped(chain.plan(learned, trust_radius), trust_radius)
    return None


def _capped(u: Array, trust_radius: float) -> Array:
    """Moves u [n, k] shortened so that none is longer than this."""
    return np.asarray(u * min(1.0, trust_radius / max(float(np.linalg.norm(u, axis=1).max()), 1e-300)))


class _Chain:
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

    def plan(self, learned: _HalfSpaces, trust_radius: float) -> Array:
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
            x = _above(self.system, self.X[i], self.model[0][i], u[i])
            if x is None:
                return None
            X[i] = x
        return X

    def above(self, i: int, u: Array) -> Array:
        """The point of the manifold above u [k] at point i; point i where there is none."""
        x = _above(self.system, self.X[i], self.model[0][i], u)
        return np.asarray(self.X[i] if x is None else x)


@dataclass(frozen=True, eq=False)
class _HalfSpaces:
    """What a black box forbids, as one half-space of each tangent space: normals (n, k), offsets (n,).

    One is learned by halving the move that leads out of what is allowed, and by asking round the place where it does.
    """

    normals: Array
    offsets: Array

    @classmethod
    def none(cls, chain: _Chain) -> _HalfSpaces:
        """None yet."""
        n, k = len(chain.X), chain.system.dimension
        return cls(np.zeros((n, k)), np.full(n, np.inf))

    def add(self, chain: _Chain, points: IndexArray, u: Array, allowed: Allowed) -> None:
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
