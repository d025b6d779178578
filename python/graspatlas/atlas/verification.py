"""Verification of an atlas against the equations of its system; every check could fail."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from graspatlas import _core
from graspatlas.atlas.atlas import BOX_TAG, Atlas
from graspatlas.atlas.status import Closed, Status
from graspatlas.support.arrays import Array
from graspatlas.systems.system import AnySystem

__all__ = ["RESIDUAL_TOLERANCE", "Check", "CheckReport", "atlas_checks", "check_atlas"]

#: Largest residual of a chart centre, of its contacts and of its frozen hand motions.
RESIDUAL_TOLERANCE = 1e-9
#: How far a tangent basis may be from orthonormal, and from the null space of the Jacobian.
TANGENT_TOLERANCE = 1e-6
#: How far the half-spaces of two neighbours may be from the bisectors of their centres.
HALF_SPACE_TOLERANCE = 1e-9
#: How far a vertex that is listed may be from where its facets meet, and outside the ball without being listed, where
#: not all vertices are: as a share of the radius.
OUTER_TOLERANCE = 1e-6


@dataclass(frozen=True)
class Check:
    """One claim and what was measured.

    Attributes:
        claim: What should hold.
        measured: The worst value found.
        limit: The largest value allowed.
    """

    claim: str
    measured: float
    limit: float

    @property
    def passed(self) -> bool:
        """True when the claim holds; false for NaN."""
        return bool(self.measured <= self.limit)

    def __str__(self) -> str:
        return f"{'ok  ' if self.passed else 'FAIL'}  {self.claim}: {self.measured:.3g} (limit {self.limit:.3g})"


@dataclass(frozen=True)
class CheckReport:
    """The outcome of all checks.

    Attributes:
        checks: The checks, in the order in which they were made.
    """

    checks: tuple[Check, ...]

    def __repr__(self) -> str:
        failed = sum(not check.passed for check in self.checks)
        return f"<CheckReport: {len(self.checks)} checks, {failed} failed>"

    @property
    def passed(self) -> bool:
        """True when every check passed."""
        return all(check.passed for check in self.checks)

    def __bool__(self) -> bool:
        return self.passed

    def __str__(self) -> str:
        return "\n".join(str(check) for check in self.checks)


def check_atlas(atlas: Atlas, system: AnySystem | None = None) -> CheckReport:
    """Verify an atlas against its system: centres, bounds, tangent bases, polytopes and neighbours.

    Args:
        atlas: The atlas.
        system: The system to check against; the atlas's own by default.

    Returns:
        What was measured.
    """
    return CheckReport(tuple(atlas_checks(atlas, system or atlas.system)))


def atlas_checks(atlas: Atlas, system: AnySystem) -> Iterator[Check]:
    """The checks of :func:`check_atlas`, one by one."""
    residuals = [np.abs(system.evaluate_residual(x)).max(initial=0.0) for x in atlas.centers]
    yield Check("largest residual of a chart centre", float(np.max(residuals)), RESIDUAL_TOLERANCE)
    slacks = [system.slack(x).min(initial=np.inf) for x in atlas.centers]
    yield Check("farthest that a centre lies outside its bounds", float(-np.min(slacks)), RESIDUAL_TOLERANCE)
    gram = atlas.bases @ atlas.bases.transpose(0, 2, 1) - np.eye(atlas.dimension)
    yield Check("tangent bases are orthonormal to", float(np.abs(gram).max()), RESIDUAL_TOLERANCE)
    slopes = [
        np.abs(system.evaluate_jacobian(x) @ basis.T).max(initial=0.0)
        for x, basis in zip(atlas.centers, atlas.bases, strict=True)
    ]
    yield Check(
        "tangent bases lie in the null space of the Jacobian to",
        float(np.max(slopes)),
        TANGENT_TOLERANCE,
    )
    yield from _neighbour_checks(atlas, system)
    if atlas.status in (Status.COMPLETE, Status.BLOCKED):
        beyond = sum(_expandable(atlas, chart) for chart in range(atlas.n_charts))
        yield Check("vertices of an atlas without open charts that could still be expanded", float(beyond), 0.0)


def _expandable(atlas: Atlas, chart: int) -> int:
    """Number of vertices of a chart outside its ball that are not closed."""
    rows = slice(atlas.vertex_start[chart], atlas.vertex_start[chart + 1])
    listed, closed = atlas.vertices[rows], atlas.vertex_closed[rows] != Closed.OPEN.value
    if atlas.lists_all_vertices:
        return int(((np.linalg.norm(listed, axis=1) > atlas.radius) & ~closed).sum())
    every = atlas.polytope(chart)
    outside = every[np.linalg.norm(every, axis=1) > atlas.radius * (1.0 + OUTER_TOLERANCE)]
    gaps = np.linalg.norm(outside[:, None] - listed[closed], axis=2).min(axis=1, initial=np.inf)
    return int((gaps > OUTER_TOLERANCE * atlas.radius).sum())


def _neighbour_checks(atlas: Atlas, system: AnySystem) -> Iterator[Check]:
    """Neighbours pass the tests of eqs (17) and (18), and each facet is the bisector that both charts agree on."""
    pairs = {(int(i), int(j)): system.difference(atlas.centers[i], atlas.centers[j]) for i, j in atlas.neighbour_pairs}
    i, j = atlas.neighbour_pairs.T
    d = np.array(list(pairs.values())).reshape(len(pairs), system.tangent_size)
    images = [np.einsum("nkv,nv->nk", atlas.bases[c], d) for c in (i, j)]
    off = [np.sqrt(np.maximum((d * d).sum(axis=1) - (p * p).sum(axis=1), 0.0)) for p in images]
    yield Check(
        "neighbours are off each other's tangent space by",
        float(np.max(off, initial=0.0)),
        atlas.epsilon,
    )
    lengths = np.maximum(np.linalg.norm(d, axis=1), 1e-300)
    slant = max(float(1.0 - (np.linalg.norm(p, axis=1) / lengths).min(initial=1.0)) for p in images)
    yield Check("displacements leave the tangent spaces by 1 - cosine of", slant, atlas.epsilon * (1.0 + 1e-9))
    M = np.einsum("nav,nbv->nab", atlas.bases[i], atlas.bases[j])
    cosines = np.linalg.svd(M, compute_uv=False).min(axis=1, initial=1.0)
    widest = float(1.0 - cosines.min(initial=1.0))
    yield Check("neighbouring tangent spaces differ by 1 - cosine of", widest, atlas.epsilon * (1.0 + 1e-9))
    yield from _polytope_checks(atlas, system, pairs)


def _polytope_checks(atlas: Atlas, system: AnySystem, pairs: dict[tuple[int, int], Array]) -> Iterator[Check]:
    """Facets are where box, bounds and neighbours say, and the vertices are those of all these half-spaces."""
    strangers, misplaced, outside, loose = 0, 0.0, 0.0, 0.0
    images: list[list[Array]] = [[] for _ in range(atlas.n_charts)]
    for (i, j), d in pairs.items():
        images[i].append(atlas.bases[i] @ d)
        images[j].append(-atlas.bases[j] @ d)
    for chart in range(atlas.n_charts):
        normals, offsets, tags = atlas.facets(chart)
        vertices = atlas.polytope(chart)
        for normal, offset, tag in zip(normals, offsets, tags, strict=True):
            expected = _half_space(atlas, system, pairs, chart, int(tag), normal)
            if expected is None:
                strangers += 1
                continue
            misplaced = max(misplaced, float(np.abs(expected[0] - normal).max()), abs(expected[1] - offset))
        excess = vertices @ normals.T - offsets
        outside = max(outside, float(excess.max()))
        loose = max(loose, float(np.sort(np.abs(excess), axis=1)[:, atlas.dimension - 1].max()))
        if images[chart]:
            p = np.array(images[chart])
            lengths = np.maximum(np.linalg.norm(p, axis=1), 1e-300)
            outside = max(outside, float((vertices @ (p / lengths[:, None]).T - lengths / 2.0).max()))
    yield Check("facets that neither box, bounds nor neighbours make", float(strangers), 0.0)
    yield Check("half-spaces are off those of box, bounds and neighbours by", misplaced, HALF_SPACE_TOLERANCE)
    yield Check("vertices lie outside a half-space by", outside, HALF_SPACE_TOLERANCE)
    yield Check("vertices are off the facets that should make them by", loose, HALF_SPACE_TOLERANCE)


def _half_space(
    atlas: Atlas, system: AnySystem, pairs: dict[tuple[int, int], Array], chart: int, tag: int, normal: Array
) -> tuple[Array, float] | None:
    """Unit normal and offset that a facet must have, from what its tag says it is; None when there is no such thing."""
    basis = atlas.bases[chart]
    if tag >= 0:
        key = (min(chart, tag), max(chart, tag))
        if key not in pairs:
            return None
        p = basis @ (pairs[key] if chart == key[0] else -pairs[key])
        length = float(np.linalg.norm(p))
        return (p / length, length / 2.0) if length > 0.0 else None
    if tag == BOX_TAG:
        axis = int(np.abs(normal).argmax())
        return np.sign(normal[axis]) * np.eye(atlas.dimension)[axis], atlas.box_half_width
    bound = _core.Polytope.bound_of_tag(tag)
    if bound >= len(system.bound_normals):
        return None
    p = basis @ system.bound_normals[bound]
    length = float(np.linalg.norm(p))
    if not length > 0.0:
        return None
    return p / length, max(float(system.slack(atlas.centers[chart])[bound]), 0.0) / length
