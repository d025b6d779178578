"""Normals of the surface under a noisy mesh."""

from __future__ import annotations

import numpy as np

from graspatlas.meshes.triangles import TriangleMesh
from graspatlas.support.arrays import Array

__all__ = ["smooth_normals"]

#: Neighbours whose normals make this angle [rad] count a third of those that agree: 20 degrees.
LIKE = 0.35
#: How often normals are averaged with those of neighbouring faces, at least and at most.
ROUNDS = (3, 25)


def smooth_normals(mesh: TriangleMesh, radius: float) -> Array:
    """Normals of the faces averaged over their surroundings, but not across edges (m, 3).

    Each round replaces a normal by the mean over the face and its neighbours, weighted by area and, by a Gaussian, by how
    little they turn.

    Args:
        mesh: The mesh.
        radius: About how far the surroundings reach [m].

    Source: Y. Zheng, H. Fu, O. K.-C. Au, C.-L. Tai, "Bilateral normal filtering for mesh denoising", IEEE TVCG 17(10),
    2011.
    """
    i, j = mesh.edges.pairs.T
    normals, areas = mesh.normals, mesh.areas
    step = np.sqrt(2.0 * float(np.median(areas)))
    for _ in range(int(np.clip((radius / step) ** 2, *ROUNDS))):
        nearness = np.exp((np.einsum("nk,nk->n", normals[i], normals[j]) - 1.0) / (0.5 * LIKE**2))
        total = areas[:, None] * normals
        for k in range(3):
            total[:, k] += np.bincount(i, nearness * areas[j] * normals[j, k], len(areas))
            total[:, k] += np.bincount(j, nearness * areas[i] * normals[i, k], len(areas))
        lengths = np.linalg.norm(total, axis=1, keepdims=True)
        normals = np.where(lengths > 0.0, total / np.maximum(lengths, 1e-300), normals)
    return np.asarray(normals)
