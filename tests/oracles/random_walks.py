"""Random walks on a manifold, projected by Newton's method in NumPy: points of it that no atlas was asked for.

Many walks go at the same time, so that factorisations are done for all of them at once.
"""

from __future__ import annotations

import numpy as np

import graspatlas as ga

#: Steps of a walk before another begins at the first point.
LONGEST = 500
#: Walks at the same time, at most.
WALKS = 50


def factors(system, X: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Q [n, t, t], whose last columns span the tangent spaces, and R [n, t, equations] of the transposed Jacobians."""
    J = np.array([system.evaluate_jacobian(x) for x in X])
    return np.linalg.qr(J.transpose(0, 2, 1), mode="complete")


def bases_of(system, X: np.ndarray) -> np.ndarray:
    """Orthonormal tangent bases [n, k, t]."""
    return factors(system, X)[0][:, :, system.n_equations :].transpose(0, 2, 1)


def project(system, X: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Newton's method with least-norm steps from each point; the points, and which of them converged."""
    X, m = X.copy(), system.n_equations
    for _ in range(12):
        R = np.array([system.evaluate_residual(x) for x in X]).reshape(len(X), m)
        open_ = np.flatnonzero(np.abs(R).max(axis=1, initial=0.0) >= 1e-12)
        if not len(open_):
            break
        Q, T = factors(system, X[open_])
        w = np.linalg.solve(T[:, :m].transpose(0, 2, 1), -R[open_][:, :, None])
        for i, v in zip(open_, (Q[:, :, :m] @ w)[:, :, 0], strict=True):
            X[i] = system.integrate(X[i], v)
    R = np.array([system.evaluate_residual(x) for x in X]).reshape(len(X), m)
    return X, np.abs(R).max(axis=1, initial=0.0) < 1e-12


def walks(atlas: ga.Atlas, x0: np.ndarray, count: int, seed: int) -> np.ndarray:
    """Points of walks from x0 that keep their directions, more or less, until they meet a bound [count, n]."""
    system, k, length = atlas.system, atlas.dimension, 1.5 * atlas.radius
    rng = np.random.default_rng(seed)
    n = min(WALKS, -(-count // LONGEST) * 5)
    points: list[np.ndarray] = []
    while len(points) < count:
        X = np.repeat(x0[None], n, axis=0)
        directions = np.full((n, system.tangent_size), np.nan)
        for _ in range(LONGEST):
            bases = bases_of(system, X)
            fresh = rng.normal(size=(n, 1, k)) @ bases
            kept = np.nan_to_num(directions)[:, None] @ bases.transpose(0, 2, 1) @ bases
            wanted = np.where(np.isnan(directions), fresh[:, 0], kept[:, 0])
            wanted /= np.linalg.norm(wanted, axis=1, keepdims=True)
            wanted += 0.15 * (rng.normal(size=(n, 1, k)) @ bases)[:, 0]
            wanted *= rng.uniform(0.3, 1.0, (n, 1)) * length / np.linalg.norm(wanted, axis=1, keepdims=True)
            new, good = project(system, np.array([system.integrate(x, v) for x, v in zip(X, wanted, strict=True)]))
            for i in range(n):
                moved = system.difference(X[i], new[i])
                if not good[i] or system.slack(new[i]).min(initial=0.0) < 0.0 or np.linalg.norm(moved) > 1.5 * length:
                    directions[i] = np.nan
                    continue
                # The direction of arrival, in the tangent coordinates of the point where we are now.
                directions[i] = -system.difference(new[i], system.integrate(X[i], 0.5 * moved))
                X[i] = new[i]
                points.append(new[i])
            if len(points) >= count:
                break
    return np.array(points[:count])
