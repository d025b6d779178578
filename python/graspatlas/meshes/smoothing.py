"""Normals of the surface under a noisy mesh."""

from __future__ import annotations

import numpy as np

from graspatlas.meshes.triangles import TriangleMesh
from graspatlas.support.arrays import Array

__all__ = ["smooth_normals"]

#: Neighbours whose normals make this angle [rad] count a third of those that agree: 20 degrees.
LIKE = 0.35
#: How often normals are averaged with those of neighbouring faces, at least and at most.
ROUNDS = (3, 12)
#: A mesh is noisy when half of all neighbouring faces make a larger angle [rad]: 8 degrees.
NOISY = np.radians(8.0)


def smooth_normals(mesh: TriangleMesh, radius: float) -> Array:
    """Normals of the faces averaged over their surroundings, but not across edges (m, 3).

    Vertices of a noisy mesh are drawn to the middle of their neighbours first. Each round then replaces a normal by the
    mean over the face and its neighbours, weighted by area and, by a Gaussian, by how little they turn.

    Args:
        mesh: The mesh.
        radius: About how far the surroundings reach [m].

    Source: Y. Zheng, H. Fu, O. K.-C. Au, C.-L. Tai, "Bilateral normal filtering for mesh denoising", IEEE TVCG 17(10),
    2011.
    """
    i, j = mesh.edges.pairs.T
    rounds = int(np.clip((radius / _step(mesh)) ** 2, *ROUNDS))
    turns = np.einsum("nk,nk->n", mesh.normals[i], mesh.normals[j])
    if len(i) and float(np.median(turns)) < np.cos(NOISY):
        mesh = _relaxed(mesh, radius, rounds)
    normals, areas = mesh.normals, mesh.areas
    for _ in range(rounds):
        nearness = np.exp((np.einsum("nk,nk->n", normals[i], normals[j]) - 1.0) / (0.5 * LIKE**2))
        total = areas[:, None] * normals
        for k in range(3):
            total[:, k] += np.bincount(i, nearness * areas[j] * normals[j, k], len(areas))
            total[:, k] += np.bincount(j, nearness * areas[i] * normals[i, k], len(areas))
        lengths = np.linalg.norm(total, axis=1, keepdims=True)
        normals = np.where(lengths > 0.0, total / np.maximum(lengths, 1e-300), normals)
    return np.asarray(normals)


def _step(mesh: TriangleMesh) -> float:
    """About how far apart neighbouring faces are [m]."""
    return float(np.sqrt(2.0 * np.median(mesh.areas)))


def _relaxed(mesh: TriangleMesh, radius: float, rounds: int) -> TriangleMesh:
    """A mesh whose vertices are drawn to the middle of their near neighbours, so that noise dies away."""
    i, j = mesh.edges.ends.T
    n, places = len(mesh.vertices), mesh.vertices
    lengths = np.linalg.norm(places[i] - places[j], axis=1)
    near = np.exp(-((lengths / (2.0 * radius)) ** 2))
    weight = np.bincount(i, near, n) + np.bincount(j, near, n)
    share = weight / (weight + 1e-3)
    for _ in range(rounds):
        total = np.stack(
            [np.bincount(i, near * places[j, k], n) + np.bincount(j, near * places[i, k], n) for k in range(3)], axis=1
        )
        middle = total / np.maximum(weight, 1e-300)[:, None]
        places = places + 0.5 * share[:, None] * (middle - places)
    relaxed = TriangleMesh(places, mesh.faces, mesh.source)
    if not (relaxed.areas > 0.0).all():
        return mesh
    return relaxed
