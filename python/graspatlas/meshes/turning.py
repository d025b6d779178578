"""Which way the faces of a mesh are turned: with their neighbours, and outwards."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from graspatlas.meshes.triangles import TriangleMesh, cross_products
from graspatlas.support.arrays import Array, BoolArray, IntArray

__all__ = ["turned_outwards", "unfolded"]

#: The volume of a piece says which side is out only when it exceeds this share of its area times its size.
THINNEST = 1e-3
#: A piece lies inside another if so many of its vertices do, all of these.
TRIED = 8
#: Most pieces that are tried for lying inside another.
MOST_NESTED = 50
#: A face is folded back when its normal makes more than about 100 degrees with those of two neighbours ...
FOLDED = -0.2
#: ... and it is smaller than this share of their mean area.
SLIVER = 0.3
#: Most folded faces that are laid open: a mesh with more has other faults.
MOST_FOLDS = 20_000


def turned_outwards(mesh: TriangleMesh) -> tuple[TriangleMesh, int, int, int, int]:
    """A mesh whose faces agree with their neighbours, and whose pieces point out.

    Each face stands twice in a graph, as it is and turned; edges link those that agree. A piece that can be made to
    agree falls apart into itself and itself turned.

    Returns:
        The mesh, how many faces were turned against their piece, how many pieces there are, how many of these were
        turned, and how many faces belong to pieces that have no outside.
    """
    from scipy.sparse import coo_array  # slow to import
    from scipy.sparse.csgraph import connected_components

    n, edges = len(mesh.faces), mesh.edges
    (i, j), swap = edges.pairs.T, edges.opposed * len(mesh.faces)
    graph = coo_array((np.ones(2 * len(i), bool), (np.r_[i, i + n], np.r_[j + swap, j + n - swap])), (2 * n, 2 * n))
    _, states = connected_components(graph, directed=False)
    as_is, turned = states[:n], states[n:]
    piece = np.unique(np.minimum(as_is, turned), return_inverse=True)[1].reshape(-1)
    count = int(piece.max()) + 1
    twisted = as_is == turned
    against = (as_is > turned) & ~twisted
    # The larger part of a piece by area stays as it was.
    areas = mesh.areas
    share = np.bincount(piece, areas * against, count) / np.bincount(piece, areas, count)
    against ^= (share > 0.5)[piece] & ~twisted
    inverted = _inside_out(mesh, against, piece, count)
    turn = against ^ (inverted[piece] & ~twisted)
    faces = np.where(turn[:, None], mesh.faces[:, ::-1], mesh.faces)
    whole = TriangleMesh(mesh.vertices, faces, mesh.source) if turn.any() else mesh
    return whole, int(against.sum()), count, int(inverted.sum()), int(twisted.sum())


def _inside_out(mesh: TriangleMesh, against: BoolArray, piece: IntArray, count: int) -> BoolArray:
    """Which pieces have their normals inside (count,): by their signed volumes about their centroids."""
    normals = cross_products(mesh.corners) * np.where(against, -0.5, 0.5)[:, None]
    areas = np.bincount(piece, mesh.areas, count)
    middle = np.stack([np.bincount(piece, mesh.areas * mesh.centers[:, k], count) for k in range(3)], axis=1)
    arms = mesh.centers - (middle / areas[:, None])[piece]
    volumes = np.bincount(piece, np.einsum("nk,nk->n", normals, arms), count) / 3.0
    inverted = np.asarray(volumes < -THINNEST * areas**1.5)
    for k in np.flatnonzero(inverted)[:MOST_NESTED] if count > 1 else ():
        inverted[k] = not _is_cavity(mesh, piece, int(k))
    return inverted


def _is_cavity(mesh: TriangleMesh, piece: IntArray, k: int) -> bool:
    """Whether all of a piece lies inside the others: then its normals may well point into it."""
    mine = np.unique(mesh.faces[piece == k])
    points = mesh.vertices[mine[np.linspace(0, len(mine) - 1, TRIED).astype(int)]]
    others = mesh.corners[piece != k]
    low, high = others.min(axis=(0, 1)), others.max(axis=(0, 1))
    if not ((points > low) & (points < high)).all():
        return False
    return all(abs(_winding(others - point)) > 0.5 for point in points)


def _winding(corners: Array) -> float:
    """How often triangles (m, 3, 3) go round the origin."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    la, lb, lc = (np.linalg.norm(x, axis=1) for x in (a, b, c))
    dot = np.einsum
    below = la * lb * lc + dot("nk,nk->n", a, b) * lc + dot("nk,nk->n", b, c) * la + dot("nk,nk->n", c, a) * lb
    return float(2.0 * np.arctan2(dot("nk,nk->n", a, np.cross(b, c)), below).sum() / (4.0 * np.pi))


def unfolded(mesh: TriangleMesh) -> tuple[TriangleMesh, int]:
    """A mesh whose slivers that lay folded back over a neighbour are laid open, and how many there were.

    The longest edge of such a sliver is turned: the sliver and the face beyond it become the two other triangles over
    the same four vertices, if these have areas and agree with the face beyond.
    """
    edges, normals, areas = mesh.edges, mesh.normals, mesh.areas
    i, j = edges.pairs.T
    both = np.r_[i, j], np.r_[j, i]
    turned = np.einsum("nk,nk->n", normals[both[0]], normals[both[1]]) < FOLDED
    against = np.bincount(both[0], turned, len(areas))
    around = np.bincount(both[0], areas[both[1]], len(areas)) / np.maximum(
        np.bincount(both[0], minlength=len(areas)), 1
    )
    folded = np.flatnonzero((against >= 2) & (areas < SLIVER * around))
    if len(folded) == 0 or len(folded) > MOST_FOLDS:
        return mesh, 0
    beyond = _neighbours(mesh, folded)
    faces, laid_open = mesh.faces.copy(), 0
    changed = np.zeros(len(faces), bool)
    for f, g in zip(folded, beyond, strict=True):
        if g < 0 or changed[f] or changed[g]:
            continue
        pair = _turned_edge(mesh.vertices, faces[f], faces[g], normals[g])
        if pair is not None:
            faces[f], faces[g] = pair
            changed[[f, g]] = True
            laid_open += 1
    return (replace(mesh, faces=faces), laid_open) if laid_open else (mesh, 0)


def _neighbours(mesh: TriangleMesh, chosen: IntArray) -> IntArray:
    """The faces beyond the longest edges of some faces; -1 where there is none."""
    edges, ends = mesh.edges, np.sort(mesh.edges.ends, axis=1)
    key = {(int(a), int(b)): (int(f), int(g)) for (a, b), (f, g) in _of(chosen, ends, edges.pairs)}
    found = []
    for f in chosen:
        corners = mesh.corners[f]
        k = int(np.argmax(np.linalg.norm(corners - np.roll(corners, -1, axis=0), axis=1)))
        a, b = sorted((int(mesh.faces[f, k]), int(mesh.faces[f, (k + 1) % 3])))
        pair = key.get((a, b))
        found.append(-1 if pair is None else pair[0] if pair[1] == f else pair[1])
    return np.array(found)


def _of(chosen: IntArray, ends: IntArray, pairs: IntArray) -> zip[tuple[IntArray, IntArray]]:
    """Ends and faces of the edges of some faces."""
    mine = np.isin(pairs, chosen).any(axis=1)
    return zip(ends[mine], pairs[mine], strict=True)


def _turned_edge(vertices: Array, f: IntArray, g: IntArray, normal: Array) -> tuple[IntArray, IntArray] | None:
    """The two other triangles over the vertices of two that share an edge, if they agree with a normal."""
    shared = [v for v in f if v in g]
    if len(shared) != 2:
        return None
    c, d = next(v for v in f if v not in shared), next(v for v in g if v not in shared)
    k = list(f).index(c)
    a, b = f[(k + 1) % 3], f[(k + 2) % 3]  # f is (c, a, b)
    pair = np.array([[a, d, c], [d, b, c]])
    cross = cross_products(vertices[pair])
    lengths = np.linalg.norm(cross, axis=1)
    if not (cross @ normal > 0.2 * np.maximum(lengths, 1e-300)).all() or len({int(v) for v in pair.ravel()}) != 4:
        return None
    return pair[0], pair[1]
