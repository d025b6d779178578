"""Meshes made fit for use: vertices merged, faces turned outwards, folds undone; and what is left is named."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from graspatlas.errors import GraspAtlasError
from graspatlas.meshes.reading import AnyMesh, read_mesh, trimesh_library
from graspatlas.meshes.triangles import TriangleMesh, cross_products
from graspatlas.meshes.turning import turned_outwards, unfolded
from graspatlas.numerics.groups import linked_groups
from graspatlas.support.arrays import Array, IntArray
from graspatlas.support.validation import positive, shown

if TYPE_CHECKING:
    import trimesh

Vector3 = tuple[float, float, float]
#: From the unit of a mesh to metres: one number, or three along x, y and z.
Scale: TypeAlias = "float | Sequence[float]"

__all__ = ["Repair", "Scale", "checked_scale", "repaired", "repaired_triangles"]

#: Vertices in the same cell of a grid this fine are one, as a share of the mesh's largest extent.
SAME_PLACE = 1e-6
#: A face whose height is below this share of its longest side is none.
FLAT = 1e-7
#: Most places that a report names.
MOST_NAMED = 5
#: Things that a hand grasps are about so large [m].
GRASPABLE = (0.004, 2.0)
#: Units in which meshes come, and how long the largest extent of a thing that is held is in them, about.
UNITS = (("centimetres", 0.01, 2.0, 25.0), ("millimetres", 0.001, 25.0, 2000.0), ("micrometres", 1e-6, 2e4, 2e6))


@dataclass(frozen=True)
class Repair:
    """What was done to a mesh, and what is wrong with it still.

    Attributes:
        faces: Faces of the mesh that was given.
        merged: Vertices that lay in the place of another.
        dropped: Faces without area, and faces that stood twice.
        turned: Faces that were turned to agree with their neighbours: inverted ones.
        pieces: Pieces of the mesh that hang together by their edges.
        turned_pieces: Those that were inside out, and were turned as a whole.
        unfolded: Slivers that lay folded back over a neighbour, and were laid open.
        open_edges: Edges with one face.
        holes: Closed rows of such edges, and open ones.
        crowded_edges: Edges with more than two faces: the mesh is no manifold there.
        twisted: Faces of pieces that have no outside, as a Moebius strip.
        places: Some places of open and of crowded edges, in this order [m].
        extents: Lengths of the box around the mesh along x, y and z, scaled [m].
        unit: Unit in which the mesh seems to be, with the scale to metres; None where metres fit.
    """

    faces: int
    merged: int
    dropped: int
    turned: int
    pieces: int
    turned_pieces: int
    unfolded: int
    open_edges: int
    holes: int
    crowded_edges: int
    twisted: int
    places: tuple[Vector3, ...]
    extents: Vector3
    unit: tuple[str, float] | None

    @property
    def watertight(self) -> bool:
        """Whether the mesh bounds a body: neither open nor crowded edges, and an outside."""
        return self.open_edges == self.crowded_edges == self.twisted == 0

    def unit_doubt(self) -> str:
        """What is odd about the size of the mesh, or nothing."""
        largest = max(self.extents)
        if self.unit is not None:
            return (
                f"the mesh is {largest:.4g} m long, so it seems to be in {self.unit[0]}: say scale {self.unit[1]:g}, "
                "or scale 1 if it is in metres"
            )
        if largest < GRASPABLE[0]:
            return f"the mesh is {largest:.3g} m long: say the scale from its unit to metres, or scale 1"
        if largest > GRASPABLE[1]:
            return f"the mesh is {largest:.4g} m long: say the scale from its unit to metres, or scale 1"
        return ""

    def __str__(self) -> str:
        counts = (
            (self.merged, "vertices merged"),
            (self.dropped, "faces dropped that have no area or stand twice"),
            (self.turned, "inverted faces turned"),
            (self.turned_pieces, "inverted pieces turned"),
            (self.unfolded, "folded slivers laid open"),
        )
        left = (
            (self.open_edges, f"open edges ({self.holes} holes)"),
            (self.crowded_edges, "edges with more than two faces"),
            (self.twisted, "faces without an outside"),
        )
        x, y, z = (1e3 * length for length in self.extents)
        pieces = f"{self.pieces} piece{'s' if self.pieces != 1 else ''}"
        words = [f"{self.faces} faces in {pieces}, {x:.4g} x {y:.4g} x {z:.4g} mm"]
        words += [f"{count} {what}" for count, what in counts if count]
        words += ["watertight"] if self.watertight else [f"still {count} {what}" for count, what in left if count]
        if self.places:
            words.append("near " + ", ".join("(" + ", ".join(f"{c:.4g}" for c in place) + ")" for place in self.places))
        return "; ".join([*words, *([doubt] if (doubt := self.unit_doubt()) else [])])


def repaired(mesh: AnyMesh, *, scale: Scale = 1.0) -> tuple[trimesh.Trimesh, Repair]:
    """A mesh made fit for use: with shared vertices, no face without area, and normals that point out.

    Vertices in one place are merged; faces without area or that stand twice are dropped; faces that are turned against
    their neighbours are turned, and pieces that are inside out as a whole, those inside another piece excepted, which
    may be cavities; slivers that lie folded back over a neighbour are laid open by turning their longest edge. Holes
    are not filled and crowded edges not cut: the report names them. Nothing is scaled but by `scale`: the report names
    the unit in which the mesh seems to be.

    Args:
        mesh: A file that trimesh reads, or a ``trimesh.Trimesh``.
        scale: From the mesh's unit to metres; one number, or three along x, y and z.

    Returns:
        The mesh in metres, and what was done.

    Raises:
        GraspAtlasError: If trimesh is missing, the mesh cannot be read, or no face of it has an area.
    """
    whole, report = repaired_triangles(mesh, scale)
    return trimesh_library().Trimesh(whole.vertices, whole.faces, process=False), report


def repaired_triangles(mesh: AnyMesh, scale: Scale = 1.0) -> tuple[TriangleMesh, Repair]:
    """:func:`repaired` as arrays, with the numbers of the faces in the mesh that was given."""
    factors = checked_scale(scale)
    vertices, faces = read_mesh(mesh)
    given = len(faces)
    whole, merged = _merged(factors * vertices, faces)
    whole = _without_flat(whole)
    dropped = given - len(whole.faces)
    whole, turned, pieces, turned_pieces, twisted = turned_outwards(whole)
    whole, folds = unfolded(whole)
    edges = whole.edges
    rows = _rows(edges.open)
    ends = np.concatenate([edges.open[:MOST_NAMED], edges.crowded[:MOST_NAMED]])
    extents = np.ptp(whole.vertices[np.unique(whole.faces)], axis=0)
    report = Repair(
        faces=given,
        merged=merged,
        dropped=dropped,
        turned=turned,
        pieces=pieces,
        turned_pieces=turned_pieces,
        unfolded=folds,
        open_edges=len(edges.open),
        holes=rows,
        crowded_edges=len(edges.crowded),
        twisted=twisted,
        places=tuple(_vector(place) for place in whole.vertices[ends].mean(axis=1)),
        extents=_vector(extents),
        unit=_unit(float(extents.max())),
    )
    return whole, report


def checked_scale(scale: Scale) -> Array:
    """Scales along x, y and z (3,).

    Raises:
        GraspAtlasError: If they are not one positive number or three.
    """
    if isinstance(scale, Sequence | np.ndarray) and not isinstance(scale, str):
        if len(scale) != 3:
            raise GraspAtlasError(f"scale must be one number or three, along x, y and z, got {shown(scale)}")
        return np.array([positive(factor, "scale") for factor in scale])
    return np.full(3, positive(scale, "scale"))


def _vector(place: Array) -> Vector3:
    return (float(place[0]), float(place[1]), float(place[2]))


def _unit(largest: float) -> tuple[str, float] | None:
    """The unit in which a mesh of such an extent seems to be; None where metres fit."""
    return next(((name, scale) for name, scale, low, high in UNITS if low < largest <= high), None)


def _merged(vertices: Array, faces: IntArray) -> tuple[TriangleMesh, int]:
    """The mesh with one vertex for each place that a face uses, and how many were too many."""
    used = np.zeros(len(vertices), bool)
    used[faces.ravel()] = True
    places = vertices[used]
    low = places.min(axis=0)
    cell = max(float(np.ptp(places, axis=0).max()) * SAME_PLACE, 1e-300)
    x, y, z = np.rint((places - low) / cell).astype(np.int64).T
    side = 1 << 21
    _, first, which = np.unique((x * side + y) * side + z, return_index=True, return_inverse=True)
    order = np.argsort(first, kind="stable")  # vertices keep the order in which they came
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    number = np.zeros(len(vertices), np.int64)
    number[used] = rank[which.reshape(-1)]
    whole = TriangleMesh(places[first[order]], number[faces], np.arange(len(faces)))
    return whole, len(places) - len(first)


def _without_flat(mesh: TriangleMesh) -> TriangleMesh:
    """The mesh without faces that have no area or stand twice."""
    sides = np.linalg.norm(mesh.corners - np.roll(mesh.corners, 1, axis=1), axis=2).max(axis=1)
    keep = np.linalg.norm(cross_products(mesh.corners), axis=1) > FLAT * sides**2
    if not keep.any():
        raise GraspAtlasError("no face of the mesh has an area: its corners lie in one point or line")
    rows = np.sort(mesh.faces, axis=1)
    order = np.lexsort(rows.T)
    again = (np.diff(rows[order], axis=0) == 0).all(axis=1)
    keep[order[1:][again]] = False
    return mesh.part(np.flatnonzero(keep))


def _rows(edges: IntArray) -> int:
    """How many rows of edges hang together."""
    if len(edges) == 0:
        return 0
    known, ends = np.unique(edges, return_inverse=True)
    return int(linked_groups(len(known), ends.reshape(-1, 2)).max()) + 1
