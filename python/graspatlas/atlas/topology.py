"""Topology of a closed surface from its charts: the Euler characteristic of the triangulation that they make."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from graspatlas.support.arrays import Array, Int32Array

__all__ = ["euler_characteristic", "facet_ring"]


def facet_ring(normals: Array, offsets: Array, tags: Int32Array, shortest: float) -> list[int]:
    """Neighbours behind the facets of a polygon that are longer than `shortest`, in order round it.

    Args:
        normals: Unit normals (f, 2) of the facets.
        offsets: Their distances (f,) from the centre.
        tags: The neighbour (f,) behind each.
        shortest: Length [units of the tangent space].
    """
    ring = np.argsort(np.arctan2(normals[:, 1], normals[:, 0]))
    after = np.roll(ring, -1)
    corners = np.linalg.solve(
        np.stack([normals[ring], normals[after]], axis=1),
        np.stack([offsets[ring], offsets[after]], axis=1)[..., None],
    )[..., 0]
    lengths = np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1)
    return [int(tags[f]) for f, length in zip(ring, lengths, strict=True) if length > shortest]


def euler_characteristic(order: Sequence[Sequence[int]], bases: Array) -> int:
    """V - E + F: charts are the vertices, facets that two charts have in common are the edges.

    The faces are traced round the charts' polygons, so that the count holds also where four charts meet. Near a corner
    of four charts, seen in four tangent planes, both diagonals may seem to be edges: short facets should be left out.
    Leaving out an edge joins two faces and keeps V - E + F.

    Args:
        order: Neighbours of each chart in order round its polygon; see :func:`facet_ring`.
        bases: Orthonormal tangent bases (n, 2, tangent_size).
    """
    rings, edges = _rotation_system(order)
    seen: set[tuple[int, int, int]] = set()
    faces = 0
    for start in [(i, j, turn) for turn in (1, -1) for i, ring in enumerate(rings) for j in ring]:
        if start in seen:
            continue
        faces += 1
        dart = start
        while dart not in seen:
            seen.add(dart)
            i, j, turn = dart
            turn *= _orientation(bases[i], bases[j])
            ring = rings[j]
            dart = (j, ring[(ring.index(i) + turn) % len(ring)], turn)
    # Every face is traced twice, once in each direction.
    return len(rings) - len(edges) + faces // 2


def _rotation_system(order: Sequence[Sequence[int]]) -> tuple[list[list[int]], set[tuple[int, int]]]:
    """Neighbours of each chart in order round its polygon, joined by facets that both charts have; and these edges."""
    edges = {(i, j) for i, ring in enumerate(order) for j in ring if i < j and i in order[j]}
    rings = [[j for j in ring if (min(i, j), max(i, j)) in edges] for i, ring in enumerate(order)]
    return rings, edges


def _orientation(basis: Array, other: Array) -> int:
    """1 when two tangent bases have the same orientation, else -1."""
    return 1 if np.linalg.det(basis @ other.T) > 0.0 else -1
