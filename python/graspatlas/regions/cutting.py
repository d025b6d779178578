"""A mesh cut into parts, each of which one surface fits."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from graspatlas.meshes.smoothing import smooth_normals
from graspatlas.meshes.triangles import TriangleMesh
from graspatlas.regions.covering import FILLED_PART, filled
from graspatlas.regions.extraction import extracted
from graspatlas.regions.fitting import STEEPEST, Samples, lying_on, simplest_surface
from graspatlas.regions.sampling import spread
from graspatlas.regions.surfaces import Surface
from graspatlas.regions.tubes import fitted_tube
from graspatlas.support.arrays import Array, IntArray

__all__ = ["Cutting", "Part"]

#: Samples of a part of the mesh.
SAMPLES = 1500
#: A face belongs to a surface when its corners and centroid lie within the tolerance, and its normal so near [rad].
ALIKE = np.radians(35.0)
#: Fewest samples that a surface is fitted to.
LEAST = 30
#: Normals are smoothed over this share of the mesh's diagonal.
SMOOTHED = 0.01
#: A part has its own tolerance where it is small: this share of the side of a square as large.
RELATIVE_TOLERANCE = 0.05
#: How often parts are cut again.
DEEPEST = 6
#: A part is one with a larger one when this share of so many samples lies on the surface of that one ...
SAME, FEW = 0.9, 200
#: ... and the two are no farther apart than this share of the mesh's diagonal.
BESIDE = 0.02
#: How often faces at its rim may join a part.
JOINED = 8
#: Numbers of parts into which a bent part is cut, and rounds of Lloyd's algorithm.
CLUSTERS, ROUNDS = (2, 3, 4, 6), 12
#: What a place weighs beside a normal when bent parts are cut, for parts of one size.
PLACE_WEIGHT = 0.6


@dataclass(frozen=True, eq=False)
class Part:
    """Faces of a mesh and the surface that fits them."""

    faces: IntArray
    surface: Surface


@dataclass(frozen=True, eq=False)
class Cutting:
    """How a mesh is cut.

    Attributes:
        mesh: A repaired mesh.
        tolerance: Largest distance of a part from its surface [m].
        crease: Faces that make a larger angle belong to different parts [rad].
        smallest: Least area of a part [m2].
    """

    mesh: TriangleMesh
    tolerance: float
    crease: float
    smallest: float

    @cached_property
    def normals(self) -> Array:
        """Smoothed normals of the faces (m, 3)."""
        return smooth_normals(self.mesh, SMOOTHED * self.mesh.diagonal)

    @cached_property
    def links(self) -> IntArray:
        """Pairs of faces on either side of an edge that is no crease (p, 2)."""
        i, j = self.mesh.edges.pairs.T
        smooth = np.einsum("nk,nk->n", self.normals[i], self.normals[j]) > np.cos(self.crease)
        return np.asarray(self.mesh.edges.pairs[smooth])

    def parts(self) -> list[Part]:
        """The parts, with what joins them at their rims."""
        charts = self._groups(np.zeros(len(self.mesh.faces), np.int64))
        return self._joined(self._merged([part for chart in charts for part in self._cut(chart, DEEPEST)]))

    def samples(self, faces: IntArray, count: int = SAMPLES) -> Samples:
        """Samples of some faces."""
        return spread(self.mesh.corners, self.mesh.areas, self.normals, faces, count)

    def tolerance_of(self, faces: IntArray) -> float:
        """The tolerance of a part: less where the part is small [m]."""
        return min(self.tolerance, RELATIVE_TOLERANCE * float(np.sqrt(self.mesh.areas[faces].sum())))

    def _groups(self, labels: IntArray) -> Iterator[IntArray]:
        """Faces with the same label, from 0 on, that hang together; the large ones alone, the largest first."""
        from scipy.sparse import coo_array  # slow to import
        from scipy.sparse.csgraph import connected_components

        i, j = self.links.T
        same = (labels[i] == labels[j]) & (labels[i] >= 0)
        i, j, n = i[same], j[same], len(labels)
        _, group = connected_components(coo_array((np.ones(len(i), bool), (i, j)), (n, n)), directed=False)
        areas = np.bincount(group, self.mesh.areas * (labels >= 0))
        large = np.flatnonzero(areas >= self.smallest)
        order = np.argsort(group, kind="stable")
        starts = np.searchsorted(group[order], [large, large + 1])
        for k in np.argsort(-areas[large], kind="stable"):
            yield order[starts[0][k] : starts[1][k]]

    def _cut(self, faces: IntArray, deeper: int, *, whole: bool = False) -> Iterator[Part]:
        """The parts of a piece of surface."""
        tolerance, samples = self.tolerance_of(faces), self.samples(faces)
        surface = simplest_surface(samples, tolerance)
        if surface is not None and _fills(surface, samples):
            yield self._trimmed(faces, surface, tolerance)
            return
        if deeper == 0:
            return
        surfaces = [] if whole else self._surfaces(faces, samples, tolerance)
        labels = np.full(len(self.mesh.faces), -1)
        if surfaces:
            labels[faces] = self._nearest(faces, surfaces, tolerance)
            taken = np.zeros(len(labels), bool)
            for group in self._groups(labels):
                taken[group] = True
                yield from self._fitted(group, surfaces[labels[group[0]]], tolerance, deeper)
            labels[:] = -1
            labels[faces[~taken[faces]]] = 0
        else:
            labels[faces] = self._clusters(faces, samples)
        for group in self._groups(labels):
            yield from self._cut(group, deeper - 1, whole=bool(surfaces))

    def _surfaces(self, faces: IntArray, samples: Samples, tolerance: float) -> list[Surface]:
        """Surfaces that parts of some faces lie on; else the tube that they are."""
        least = self.smallest / float(self.mesh.areas[faces].sum())
        found = extracted(samples, tolerance, least)
        tube = None if found else fitted_tube(samples, tolerance)
        return found if tube is None else [tube]

    def _fitted(self, faces: IntArray, surface: Surface, tolerance: float, deeper: int) -> Iterator[Part]:
        """A part that lies on a surface, as a whole, or in parts where it fills little of its rectangle."""
        samples = self.samples(faces)
        kept = samples[lying_on(surface, samples, tolerance)]
        found = (simplest_surface(kept, tolerance, freeform=False) if len(kept) > LEAST else None) or surface
        if _fills(found, samples):
            yield self._trimmed(faces, found, tolerance)
        elif deeper > 0:
            labels = np.full(len(self.mesh.faces), -1)
            labels[faces] = self._clusters(faces, samples)
            for group in self._groups(labels):
                yield from self._cut(group, deeper - 1, whole=True)

    def _misfit(self, faces: IntArray, surface: Surface, tolerance: float) -> Array:
        """How badly faces fit a surface (n,): infinite for those that do not."""
        corners = self.mesh.corners[faces]
        places = np.concatenate([corners.reshape(-1, 3), self.mesh.centers[faces]])
        gaps = np.abs(surface.distances(places))
        gaps = np.maximum(gaps[: 3 * len(faces)].reshape(-1, 3).max(axis=1), gaps[3 * len(faces) :]) / tolerance
        cosines = np.einsum("nk,nk->n", surface.normals(self.mesh.centers[faces]), self.normals[faces])
        turns = np.arccos(np.clip(cosines, -1.0, 1.0))
        fit = (gaps <= 1.0) & (turns <= ALIKE) & surface.regular(self.mesh.centers[faces])
        return np.where(fit, gaps**2 + (turns / ALIKE * 2.0) ** 2, np.inf)

    def _nearest(self, faces: IntArray, surfaces: list[Surface], tolerance: float) -> IntArray:
        """The surface that each face fits best; -1 for none."""
        misfits = np.column_stack([self._misfit(faces, surface, tolerance) for surface in surfaces])
        best = np.argmin(misfits, axis=1)
        return np.where(np.isfinite(misfits[np.arange(len(faces)), best]), best, -1)

    def _trimmed(self, faces: IntArray, surface: Surface, tolerance: float) -> Part:
        """A part without faces that do not fit."""
        return Part(faces[np.isfinite(self._misfit(faces, surface, tolerance))], surface)

    def _clusters(self, faces: IntArray, samples: Samples) -> IntArray:
        """Labels of faces by normals and places: the fewest clusters in which normals turn little."""
        size = max(samples.size, 1e-12)
        features = np.column_stack([samples.normals, PLACE_WEIGHT * samples.points / size])
        own = np.column_stack([self.normals[faces], PLACE_WEIGHT * self.mesh.centers[faces] / size])
        for count in CLUSTERS:
            centers, label = _lloyd(features, count)
            if all(_turn(samples.normals[label == k]) <= 0.9 * STEEPEST for k in range(count)):
                break
        nearest = np.argmin([((own - center) ** 2).sum(axis=1) for center in centers], axis=0)
        return self._without_islands(faces, nearest)

    def _without_islands(self, faces: IntArray, labels: IntArray) -> IntArray:
        """Labels of which each small group takes that of the neighbours with whom it shares most edges."""
        position = np.full(len(self.mesh.faces), -1)
        position[faces] = np.arange(len(faces))
        links = position[self.links]
        links = links[(links >= 0).all(axis=1)]
        labels = labels.copy()
        for _ in range(3):
            votes = np.zeros((len(labels), int(labels.max()) + 1))
            np.add.at(votes, (links[:, 0], labels[links[:, 1]]), 1.0)
            np.add.at(votes, (links[:, 1], labels[links[:, 0]]), 1.0)
            votes[np.arange(len(labels)), labels] += 0.5
            labels = np.argmax(votes, axis=1)
        return labels

    def _merged(self, parts: list[Part]) -> list[Part]:
        """Parts of which each holds those beside it, cut off by noise, that lie on its surface too."""
        from scipy.spatial import cKDTree  # slow to import

        rest = sorted(parts, key=lambda part: -float(self.mesh.areas[part.faces].sum()))
        merged: list[Part] = []
        while rest:
            part, others = rest[0], []
            tolerance = self.tolerance_of(part.faces)
            tree = cKDTree(self.mesh.centers[part.faces])
            for other in rest[1:]:
                samples = self.samples(other.faces, FEW)
                apart = tree.query(self.mesh.centers[other.faces])[0].min()
                if apart > BESIDE * self.mesh.diagonal or lying_on(part.surface, samples, tolerance).mean() < SAME:
                    others.append(other)
                    continue
                part = self._trimmed(np.concatenate([part.faces, other.faces]), part.surface, tolerance)
            merged.append(part)
            rest = others
        return merged

    def _joined(self, parts: list[Part]) -> list[Part]:
        """Parts with faces at their rims that fit them too and that no part has."""
        owner = np.full(len(self.mesh.faces), -1)
        for k, part in enumerate(parts):
            owner[part.faces] = k
        pairs = np.concatenate([self.links, self.links[:, ::-1]])
        for _ in range(JOINED):
            pairs = pairs[owner[pairs[:, 1]] < 0]
            ready = owner[pairs[:, 0]] >= 0
            wanted, sought = owner[pairs[ready, 0]], pairs[ready, 1]
            pairs = pairs[~ready]
            for k in np.unique(wanted):
                faces = np.unique(sought[wanted == k])
                faces = faces[owner[faces] < 0]
                tolerance = self.tolerance_of(parts[k].faces)
                owner[faces[np.isfinite(self._misfit(faces, parts[k].surface, tolerance))]] = k
        order = np.argsort(owner, kind="stable")
        ends = np.searchsorted(owner[order], np.arange(len(parts) + 1))
        grown = [Part(order[a:b], p.surface) for a, b, p in zip(ends, ends[1:], parts, strict=False)]
        return [p for p in grown if self.mesh.areas[p.faces].sum() >= self.smallest]


def _fills(surface: Surface, samples: Samples) -> bool:
    """Whether a part fills enough of the rectangle of u and v around it; flats do without."""
    return surface.kind == "plane" or filled(surface, samples.points) > FILLED_PART


def _turn(normals: Array) -> float:
    """The angle from their mean within which nearly all normals lie [rad]."""
    if len(normals) == 0:
        return 0.0
    mean = normals.mean(axis=0)
    length = float(np.linalg.norm(mean))
    if length < 1e-3:
        return float(np.pi)
    return float(np.quantile(np.arccos(np.clip(normals @ mean / length, -1.0, 1.0)), 0.98))


def _lloyd(features: Array, count: int) -> tuple[Array, IntArray]:
    """Centres (count, d) of clusters and the cluster of each row: Lloyd's algorithm from rows far from one another."""
    first = int(np.argmax(((features - features.mean(axis=0)) ** 2).sum(axis=1)))
    chosen = [first]
    while len(chosen) < count:
        gaps = np.min([((features - features[k]) ** 2).sum(axis=1) for k in chosen], axis=0)
        chosen.append(int(np.argmax(gaps)))
    centers = features[chosen]
    for _ in range(ROUNDS):
        label = np.argmin([((features - center) ** 2).sum(axis=1) for center in centers], axis=0)
        centers = np.array(
            [features[label == k].mean(axis=0) if (label == k).any() else centers[k] for k in range(count)]
        )
    return centers, label
