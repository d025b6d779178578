"""`check_atlas` passes on what is right and fails on each thing that is made wrong."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from helpers import PythonSphere, changed

import graspatlas as ga
from graspatlas import _core
from graspatlas.atlas import BOX_TAG, Closed
from graspatlas.atlas.verification import Check, check_atlas
from graspatlas.systems import Sphere


@pytest.fixture(scope="module")
def half() -> ga.Atlas:
    """Half a sphere, z >= 0: it has facets of neighbours and of a bound."""
    system = PythonSphere(3, lower=[-np.inf, -np.inf, 0.0])
    return ga.build_atlas(system, [0.0, 0.0, 1.0], radius=0.2, epsilon=0.1)


@pytest.fixture(scope="module")
def corner() -> ga.Atlas:
    """One chart of a sphere, far too large: its four vertices are closed for curvature, on facets of the first box."""
    builder = _core.AtlasBuilder(Sphere(3), [0.0, 0.0, 1.0], 10.0, 0.1, 1)
    builder.expand(10, 1e3)  # without an audit, which would go on from there
    whole = ga.build_atlas(Sphere(3), [0.0, 0.0, 1.0], radius=10.0, epsilon=0.1, max_charts=1)
    atlas = replace(whole, status=ga.Status.COMPLETE, **builder.arrays())
    assert (atlas.vertex_closed == Closed.CURVATURE.value).all()
    return atlas


def rotated_basis(atlas: ga.Atlas, chart: int, angle: float) -> np.ndarray:
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    return changed(atlas.bases, chart, turn @ atlas.bases[chart])


def tilted_basis(atlas: ga.Atlas, chart: int, angle: float) -> np.ndarray:
    a, b = atlas.bases[chart]
    return changed(atlas.bases, chart, [np.cos(angle) * a + np.sin(angle) * np.cross(a, b), b])


def facet_of(atlas: ga.Atlas, chart: int, wanted: Callable[[int], bool]) -> int:
    rows = range(atlas.facet_start[chart], atlas.facet_start[chart + 1])
    return next(row for row in rows if wanted(int(atlas.facet_tags[row])))


def without_pair(atlas: ga.Atlas) -> np.ndarray:
    """The neighbour pairs without one whose facet is part of a polytope."""
    other = atlas.facet_tags[facet_of(atlas, 0, lambda tag: tag >= 0)]
    keep = ~((atlas.neighbour_pairs == [0, other]).all(axis=1))
    assert keep.sum() == len(keep) - 1
    return atlas.neighbour_pairs[keep]


def first_bound_chart(atlas: ga.Atlas) -> int:
    return int(np.searchsorted(atlas.facet_start, np.flatnonzero(atlas.facet_tags == -2)[0], side="right")) - 1


def without_facet(atlas: ga.Atlas, row: int) -> ga.Atlas:
    chart = int(np.searchsorted(atlas.facet_start, row, side="right")) - 1
    start = atlas.facet_start.copy()
    start[chart + 1 :] -= 1
    return replace(
        atlas,
        facet_start=start,
        facet_normals=np.delete(atlas.facet_normals, row, axis=0),
        facet_offsets=np.delete(atlas.facet_offsets, row),
        facet_tags=np.delete(atlas.facet_tags, row),
    )


TAMPERS: dict[str, Callable[[ga.Atlas], ga.Atlas]] = {
    "centre off the manifold": lambda a: replace(a, centers=changed(a.centers, 7, a.centers[7] * (1 + 1e-8))),
    "centre elsewhere on the manifold": lambda a: replace(a, centers=changed(a.centers, 7, a.point(7, [0.02, 0.01]))),
    "centre outside the bounds": lambda a: replace(a, centers=changed(a.centers, 0, [0.6, 0.0, -0.8])),
    "centre NaN": lambda a: replace(a, centers=changed(a.centers, (3, 1), np.nan)),
    "basis turned in its plane": lambda a: replace(a, bases=rotated_basis(a, 5, 1e-3)),
    "basis tilted out of its plane": lambda a: replace(a, bases=tilted_basis(a, 5, 1e-4)),
    "basis scaled": lambda a: replace(a, bases=changed(a.bases, 5, 1.001 * a.bases[5])),
    "bases exchanged": lambda a: replace(a, bases=changed(a.bases, [4, 40], a.bases[[40, 4]])),
    "facet normal turned": lambda a: replace(
        a, facet_normals=changed(a.facet_normals, 0, a.facet_normals[0] @ [[0.8, 0.6], [-0.6, 0.8]])
    ),
    "facet moved out": lambda a: replace(a, facet_offsets=changed(a.facet_offsets, 0, 1.01 * a.facet_offsets[0])),
    "facet of another neighbour": lambda a: replace(
        a, facet_tags=changed(a.facet_tags, 0, a.facet_tags[facet_of(a, 0, lambda t: t >= 0) + 1])
    ),
    "facet of a stranger": lambda a: replace(a, facet_tags=changed(a.facet_tags, 0, a.n_charts - 1)),
    "facet dropped": lambda a: without_facet(a, 0),
    "bound's facet moved in": lambda a: moved_bound(a, 0.7),
    "bound's facet moved out": lambda a: moved_bound(a, 1.3),
    "neighbour pair removed": lambda a: replace(a, neighbour_pairs=without_pair(a)),
    "strangers made neighbours": lambda a: replace(
        a, neighbour_pairs=np.vstack([a.neighbour_pairs, [[0, a.n_charts - 1]]]).astype(np.int32)
    ),
    "vertex moved out of the ball": lambda a: replace(
        a, vertices=changed(a.vertices, 0, 1.5 * a.radius * a.vertices[0] / np.linalg.norm(a.vertices[0]))
    ),
    "vertex moved towards the centre": lambda a: replace(a, vertices=changed(a.vertices, 0, 0.5 * a.vertices[0])),
    "smaller radius": lambda a: replace(a, radius=0.5 * a.radius),
    "smaller epsilon": lambda a: replace(a, epsilon=0.01 * a.epsilon),
}


def moved_bound(atlas: ga.Atlas, factor: float) -> ga.Atlas:
    row = int(np.flatnonzero((atlas.facet_tags == -2) & (atlas.facet_offsets > 0.01))[0])
    offsets = changed(atlas.facet_offsets, row, factor * atlas.facet_offsets[row])
    return replace(atlas, facet_offsets=offsets)


def test_a_right_atlas_passes(half, corner, sphere):
    for atlas in (half, corner, sphere):
        report = check_atlas(atlas)
        assert report.passed, str(report)
        assert bool(report)


@pytest.mark.parametrize("tamper", TAMPERS)
def test_a_wrong_atlas_fails(half, tamper):
    wrong = TAMPERS[tamper](half)
    report = check_atlas(wrong)
    assert not report.passed, str(report)
    assert "FAIL" in str(report)


def test_a_reopened_vertex_fails(corner):
    reopened = replace(corner, vertex_closed=changed(corner.vertex_closed, 0, Closed.OPEN.value))
    assert not check_atlas(reopened).passed


def test_a_moved_box_facet_fails(corner):
    assert corner.facet_tags[0] == BOX_TAG
    assert not check_atlas(replace(corner, facet_offsets=changed(corner.facet_offsets, 0, 4.0))).passed


def test_an_atlas_cut_short_does_not_pass_as_complete():
    part = ga.build_atlas(Sphere(3), [0.0, 0.0, 1.0], radius=0.2, epsilon=0.1, max_charts=20)
    assert check_atlas(part).passed
    assert not check_atlas(replace(part, status=ga.Status.COMPLETE)).passed


def test_another_system_fails(half):
    assert not check_atlas(half, ga.systems.Torus(2.0, 0.5)).passed


def test_checks_compare_with_their_limits():
    assert Check("x", 1.0, 1.0).passed
    assert not Check("x", 1.0 + 1e-12, 1.0).passed
    assert not Check("x", float("nan"), 1.0).passed


def test_centres_outside_their_bounds_are_found():
    """The bounds are those of the system to check against."""
    half, less = (PythonSphere(3, lower=[-np.inf, -np.inf, low]) for low in (0.0, 0.5))
    atlas = ga.build_atlas(half, [0, 0, 1], radius=0.2, epsilon=0.2)
    outside = {
        system: next(check for check in check_atlas(atlas, system).checks if "outside its bounds" in check.claim)
        for system in (half, less)
    }
    assert outside[half].passed
    assert not outside[less].passed
    assert outside[less].measured == pytest.approx(0.5 - atlas.centers[:, 2].min())
