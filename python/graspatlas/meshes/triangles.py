"""A triangle mesh as arrays, and which of its faces share an edge."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from graspatlas.support.arrays import Array, BoolArray, IntArray

__all__ = ["Edges", "TriangleMesh", "cross_products"]


def cross_products(corners: Array) -> Array:
    """Cross products of two edges of triangles (m, 3, 3): along the normals, twice the areas long (m, 3)."""
    return np.asarray(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))


@dataclass(frozen=True, eq=False)
class Edges:
    """The edges of a mesh.

    Attributes:
        pairs: Faces on either side of each edge that has two (p, 2).
        opposed: Which of these pairs run through their edge in the same direction: one of the two is turned (p,).
        ends: Vertices at the ends of these edges (p, 2).
        open: Vertices at the ends of edges with one face (e, 2), in the direction in which that face has them.
        crowded: Vertices at the ends of edges with more than two faces (c, 2).
    """

    pairs: IntArray
    opposed: BoolArray
    ends: IntArray
    open: IntArray
    crowded: IntArray


@dataclass(frozen=True, eq=False)
class TriangleMesh:
    """Triangles with shared vertices.

    Attributes:
        vertices: Places (n, 3), metres.
        faces: Vertices of each triangle (m, 3), counter-clockwise seen from outside.
        source: Number of each triangle in the mesh that was given (m,).
    """

    vertices: Array
    faces: IntArray
    source: IntArray

    @cached_property
    def corners(self) -> Array:
        """Corners of the triangles (m, 3, 3)."""
        return np.asarray(self.vertices[self.faces])

    @cached_property
    def areas(self) -> Array:
        """Areas (m,), square metres."""
        return np.asarray(0.5 * np.linalg.norm(cross_products(self.corners), axis=1))

    @cached_property
    def normals(self) -> Array:
        """Outward unit normals (m, 3)."""
        return np.asarray(cross_products(self.corners) / (2.0 * self.areas[:, None]))

    @cached_property
    def centers(self) -> Array:
        """Centroids of the triangles (m, 3)."""
        return np.asarray(self.corners.mean(axis=1))

    @cached_property
    def diagonal(self) -> float:
        """Length of the diagonal of the box around all vertices [m]."""
        return float(np.linalg.norm(np.ptp(self.vertices, axis=0)))

    @cached_property
    def edges(self) -> Edges:
        """Which faces share which edges."""
        return edges_of(self.faces, len(self.vertices))

    def part(self, which: IntArray) -> TriangleMesh:
        """Some of the triangles, with all vertices."""
        return TriangleMesh(self.vertices, self.faces[which], self.source[which])


def edges_of(faces: IntArray, n_vertices: int) -> Edges:
    """The edges of triangles."""
    start, end = faces.ravel(), faces[:, [1, 2, 0]].ravel()
    key = np.minimum(start, end) * n_vertices + np.maximum(start, end)
    order = np.argsort(key, kind="stable")
    first = np.flatnonzero(np.diff(key[order], prepend=-1))
    counts = np.diff(first, append=len(order))
    two = first[counts == 2]
    i, j = order[two], order[two + 1]
    lone, crowd = order[first[counts == 1]], order[first[counts > 2]]
    return Edges(
        pairs=np.column_stack([i // 3, j // 3]),
        opposed=start[i] == start[j],
        ends=np.column_stack([start[i], end[i]]),
        open=np.column_stack([start[lone], end[lone]]),
        crowded=np.column_stack([start[crowd], end[crowd]]),
    )
