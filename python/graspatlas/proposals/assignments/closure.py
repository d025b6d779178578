"""Which points could hold a thing at all: a quick test of many sets of points at a time, to leave others out."""

from __future__ import annotations

import numpy as np

from graspatlas.support.arrays import Array

__all__ = ["imbalance"]

#: Edges of the pyramid that stands for a friction cone, and steps towards the least imbalance.
EDGES, STEPS = 6, 60
#: Sets of points that are in memory at a time.
AT_A_TIME = 4096


def imbalance(points: Array, normals: Array, friction: float) -> Array:
    """The least wrench that contact forces which add up to one leave over, about, of sets of contacts (n,).

    It is 0 where forces in the friction cones balance, which a grasp that holds needs. Frank and Wolfe's steps come
    near it from above.

    Args:
        points: Contact points (n, m, 3).
        normals: Inward unit normals of the object there (n, m, 3).
        friction: Coefficient of friction.
    """
    parts = range(0, len(points), AT_A_TIME)
    found = [_imbalance(points[i : i + AT_A_TIME], normals[i : i + AT_A_TIME], friction) for i in parts]
    return np.concatenate(found) if found else np.zeros(0)


def _imbalance(points: Array, normals: Array, friction: float) -> Array:
    wrenches = _edges(points, normals, friction)
    w = wrenches.mean(axis=1)
    for _ in range(STEPS):
        lowest = np.einsum("nec,nc->ne", wrenches, w).argmin(axis=1)
        to = wrenches[np.arange(len(w)), lowest] - w
        # As far as the wrench becomes smaller, and never past the edge.
        length = np.einsum("nc,nc->n", to, to)
        share = np.clip(-np.einsum("nc,nc->n", to, w) / np.where(length > 0.0, length, 1.0), 0.0, 1.0)
        w = w + share[:, None] * to
    return np.asarray(np.linalg.norm(w, axis=1))


def _edges(points: Array, normals: Array, friction: float) -> Array:
    """Wrenches of the unit forces along the edges of all friction pyramids (n, m * EDGES, 6).

    Torques are about the middle of the points, and divided by their mean distance from it.
    """
    arms = points - points.mean(axis=1, keepdims=True)
    size = np.linalg.norm(arms, axis=2).mean(axis=1)[:, None, None]
    arms = arms / np.where(size > 0.0, size, 1.0)
    other = np.where(np.abs(normals[..., :1]) < 0.9, (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    t = np.cross(normals, other)
    t /= np.linalg.norm(t, axis=2, keepdims=True)
    b = np.cross(normals, t)
    forces = []
    for angle in np.linspace(0.0, 2.0 * np.pi, EDGES, endpoint=False):
        forces.append(normals + friction * (np.cos(angle) * t + np.sin(angle) * b))
    f = np.stack(forces, axis=2)
    torques = np.cross(arms[:, :, None], f)
    return np.concatenate([f, torques], axis=3).reshape(len(points), -1, 6)
