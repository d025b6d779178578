"""Meshes with every fault that files have: repaired, or named."""

from __future__ import annotations

import numpy as np
import pytest
import shapes
from shapes import trimesh

import graspatlas as ga
from graspatlas.meshes.smoothing import smooth_normals
from graspatlas.meshes.triangles import TriangleMesh

BALL = trimesh.creation.icosphere(subdivisions=3, radius=0.03)


def as_triangles(mesh):
    return TriangleMesh(np.array(mesh.vertices), np.array(mesh.faces), np.arange(len(mesh.faces)))


def soup(mesh):
    """Each face with vertices of its own, as in an STL file."""
    return trimesh.Trimesh(mesh.triangles.reshape(-1, 3), np.arange(3 * len(mesh.faces)).reshape(-1, 3), process=False)


def test_a_sound_mesh_stays_as_it_is():
    mesh, report = ga.repaired(BALL)
    np.testing.assert_array_equal(mesh.vertices, BALL.vertices)
    np.testing.assert_array_equal(mesh.faces, BALL.faces)
    assert report.watertight
    assert report.pieces == 1
    assert report.unit is None
    assert report.merged == report.dropped == report.turned == report.turned_pieces == report.unfolded == 0
    assert str(report) == "1280 faces in 1 piece, 60 x 60 x 60 mm; watertight"


def test_vertices_in_one_place_are_merged():
    mesh, report = ga.repaired(soup(BALL))
    assert len(mesh.vertices) == len(BALL.vertices)
    assert report.merged == 3 * len(BALL.faces) - len(BALL.vertices)
    assert mesh.is_watertight


@pytest.mark.parametrize("which", [np.arange(0, 1280, 7), np.arange(900), np.arange(1280)], ids=["some", "most", "all"])
def test_faces_that_are_turned_are_turned_back(which):
    mesh, report = ga.repaired(shapes.with_turned_faces(BALL, which))
    assert mesh.volume == pytest.approx(BALL.volume)
    assert (np.einsum("nk,nk->n", mesh.face_normals, mesh.triangles_center) > 0.0).all()
    assert report.turned == (min(len(which), 1280 - len(which)))
    assert report.turned_pieces == (len(which) > 640)


def test_each_piece_points_out_and_cavities_stay():
    """A ball beside a turned ball, and in it a hollow whose normals point into it, as they shall."""
    beside = BALL.copy()
    beside.apply_translation((0.1, 0.0, 0.0))
    beside.invert()
    hollow = trimesh.creation.icosphere(subdivisions=2, radius=0.01)
    hollow.invert()
    mesh, report = ga.repaired(trimesh.util.concatenate([BALL, beside, hollow]))
    assert report.pieces == 3
    assert report.turned_pieces == 1
    assert mesh.volume == pytest.approx(2.0 * BALL.volume + hollow.volume)
    assert hollow.volume < 0.0


def test_faces_without_area_and_double_ones_are_dropped():
    faces = np.vstack([BALL.faces, BALL.faces[5][[1, 2, 0]], [0, 0, 1], BALL.faces[9][::-1]])
    mesh, report = ga.repaired(trimesh.Trimesh(BALL.vertices, faces, process=False))
    assert report.dropped == 3
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(BALL.volume)


def folded_plate():
    """A flat plate of which one vertex lies beyond the edge opposite, so that a sliver is folded back."""
    x, y = np.meshgrid(np.linspace(0.0, 0.1, 11), np.linspace(0.0, 0.1, 11), indexing="ij")
    vertices = np.stack([x, y, 0.0 * x], axis=-1).reshape(-1, 3)
    i, j = (a.ravel() for a in np.meshgrid(np.arange(10), np.arange(10), indexing="ij"))
    a, b = 11 * i + j, 11 * (i + 1) + j
    faces = np.concatenate([np.column_stack([a, b, b + 1]), np.column_stack([a, b + 1, a + 1])])
    # Split a face by a point just outside of one of its edges: two good parts and a sliver that is turned.
    p, q, r = faces[44]
    outside = 0.5 * (vertices[p] + vertices[q]) + 1e-4 * np.cross(vertices[q] - vertices[p], [0, 0, 1]) / 0.01
    n = len(vertices)
    faces = np.vstack([np.delete(faces, 44, axis=0), [q, r, n], [r, p, n], [p, q, n]])
    return trimesh.Trimesh(np.vstack([vertices, outside]), faces, process=False)


def test_a_sliver_that_is_folded_back_is_laid_open():
    plate = folded_plate()
    up = plate.face_normals[:, 2]
    assert (up < -0.9).sum() == 1
    mesh, report = ga.repaired(plate)
    assert report.unfolded == 1
    assert (mesh.face_normals[:, 2] > 0.99).all()
    assert mesh.area == pytest.approx(0.01)


def test_what_is_left_is_named():
    """Two holes, and a fin that makes an edge with three faces."""
    keep = np.ones(len(BALL.faces), bool)
    keep[[3, 700]] = False
    fin = np.vstack([BALL.vertices, [0.05, 0.05, 0.05]])
    a, b, _ = BALL.faces[100]
    _, report = ga.repaired(trimesh.Trimesh(fin, np.vstack([BALL.faces[keep], [b, a, len(fin) - 1]]), process=False))
    assert (report.holes, report.open_edges, report.crowded_edges) == (3, 8, 1)
    assert not report.watertight
    assert len(report.places) == 6
    middles = BALL.vertices[[a, b]].mean(axis=0)
    assert np.linalg.norm(np.array(report.places[-1]) - middles) < 1e-12
    assert "still 8 open edges (3 holes)" in str(report)
    assert "1 edges with more than two faces" in str(report)


def test_a_strip_without_an_outside_is_named():
    t = np.linspace(0.0, 2.0 * np.pi, 40, endpoint=False)
    out = np.column_stack([np.cos(t), np.sin(t), 0.0 * t])
    across = np.cos(t / 2)[:, None] * out + np.outer(np.sin(t / 2), [0, 0, 1])
    vertices = np.vstack([0.03 * out + 0.005 * across, 0.03 * out - 0.005 * across])
    k = np.arange(39)
    faces = np.concatenate([np.column_stack([k, k + 1, k + 41]), np.column_stack([k, k + 41, k + 40])])
    faces = np.vstack([faces, [39, 40, 0], [39, 0, 79]])  # above meets below
    _, report = ga.repaired(trimesh.Trimesh(vertices, faces, process=False))
    assert report.twisted == report.faces == 80
    assert not report.watertight
    assert "80 faces without an outside" in str(report)


@pytest.mark.parametrize(
    ("factor", "unit", "words"),
    [
        (1.0, None, ""),
        (1000.0, ("millimetres", 0.001), "seems to be in millimetres: say scale 0.001"),
        (100.0, ("centimetres", 0.01), "seems to be in centimetres: say scale 0.01"),
        (1e6, ("micrometres", 1e-6), "micrometres"),
        (0.01, None, "0.0012 m long: say the scale"),
        (1e9, None, "say the scale"),
    ],
)
def test_the_unit_is_guessed_and_nothing_scaled(factor, unit, words):
    mesh = shapes.can()
    mesh.apply_scale(factor)
    same, report = ga.repaired(mesh)
    assert report.unit == unit
    assert same.extents == pytest.approx(mesh.extents)
    assert words in report.unit_doubt()
    assert bool(report.unit_doubt()) == bool(words)


def test_scales_of_three_axes():
    mesh, report = ga.repaired(shapes.box((1.0, 2.0, 3.0)), scale=(0.1, 0.05, 0.02))
    assert mesh.extents == pytest.approx([0.1, 0.1, 0.06])
    assert report.extents == pytest.approx((0.1, 0.1, 0.06))


@pytest.mark.parametrize(
    ("mesh", "scale", "words"),
    [
        (trimesh.Trimesh(np.eye(3)[[0, 0, 0]], [[0, 1, 2]], process=False), 1.0, "no face of the mesh has an area"),
        (trimesh.Trimesh(), 1.0, "no faces"),
        (BALL, 0.0, "scale must be a positive number"),
        (BALL, (1.0, 2.0), "scale must be one number or three"),
        (BALL, "large", "scale must be a positive number"),
        ([1, 2], 1.0, "got list"),
        ("nowhere.ply", 1.0, "there is no mesh file"),
    ],
)
def test_what_cannot_be_repaired_is_refused(mesh, scale, words):
    with pytest.raises(ga.GraspAtlasError, match=words):
        ga.repaired(mesh, scale=scale)


def test_smoothed_normals_are_those_of_the_surface_under_the_noise():
    ball = trimesh.creation.icosphere(subdivisions=5, radius=0.05)
    noisy = shapes.scanned(ball, edge=0.01, noise=0.0003)
    true = noisy.triangles_center / np.linalg.norm(noisy.triangles_center, axis=1, keepdims=True)
    rough = np.einsum("nk,nk->n", noisy.face_normals, true)
    smooth = np.einsum("nk,nk->n", smooth_normals(as_triangles(noisy), 0.005), true)
    assert np.degrees(np.arccos(np.clip(smooth, -1, 1))).mean() < 0.4 * np.degrees(np.arccos(rough)).mean()
    assert np.degrees(np.arccos(np.clip(smooth, -1, 1))).mean() < 4.0


def test_smoothing_leaves_edges_sharp():
    fine = as_triangles(shapes.scanned(shapes.box(), edge=0.01, noise=0.0))
    np.testing.assert_allclose(smooth_normals(fine, 0.02), fine.normals, atol=1e-6)
