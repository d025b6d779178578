"""Patches fitted to meshes: they are the surface that was meshed, and grasps on them are the grasps on that surface."""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np
import pytest

import graspatlas as ga
from graspatlas.patches import Cylinder, patch_from_dict, patch_from_mesh

trimesh = pytest.importorskip("trimesh")

RADIUS = 0.022
#: Places on a patch, as shares of its size.
SHARES = [(u, v) for u in (-1.0, -0.6, 0.0, 0.35, 1.0) for v in (-0.9, 0.0, 0.5, 1.0)]


def cylinder_mesh(radius: float = RADIUS, height: float = 0.1, sections: int = 400):
    """A cylinder about y."""
    mesh = trimesh.creation.cylinder(radius=radius, height=height, sections=sections)
    mesh.apply_transform(trimesh.transformations.rotation_matrix(-np.pi / 2, (1, 0, 0)))
    return mesh


def grid_mesh(height, half: float = 0.03, n: int = 61):
    """The graph of a function of (x, y), up being outside."""
    ticks = np.linspace(-half, half, n)
    x, y = np.meshgrid(ticks, ticks, indexing="ij")
    vertices = np.stack([x, y, height(x, y)], axis=-1).reshape(-1, 3)
    i, j = (a.ravel() for a in np.meshgrid(np.arange(n - 1), np.arange(n - 1), indexing="ij"))
    a, b = i * n + j, (i + 1) * n + j
    faces = np.concatenate([np.column_stack([a, b, b + 1]), np.column_stack([a, b + 1, a + 1])])
    return trimesh.Trimesh(vertices, faces, process=False)


def test_a_fit_to_a_sphere_is_the_sphere():
    mesh = trimesh.creation.icosphere(subdivisions=5, radius=0.02)
    patch, report = patch_from_mesh(mesh, (0.01, 0.01, 0.02), 0.01)
    for u, v in SHARES:
        point = patch.point(0.01 * u, 0.01 * v)
        assert np.linalg.norm(point) == pytest.approx(0.02, abs=1.5e-5)
        assert patch.normal_at(0.01 * u, 0.01 * v) @ point / np.linalg.norm(point) > np.cos(0.02)
    assert report.largest < 2e-5
    assert 0.0 < report.rms < report.largest
    assert np.degrees(report.turn) == pytest.approx(np.degrees(np.arcsin(np.sqrt(0.5))), abs=3.0)
    assert patch_from_dict(patch.to_dict()) == patch


def test_a_fit_to_a_cylinder_is_the_cylinder():
    patch, report = patch_from_mesh(cylinder_mesh(), (RADIUS, 0.01, 0.0), 0.012, u_axis=(0.0, 0.0, 1.0))
    for u, v in SHARES:
        x, y, z = patch.point(0.012 * u, 0.012 * v)
        assert np.hypot(x, z) == pytest.approx(RADIUS, abs=2e-6)
        assert (abs(y - 0.01), z) == pytest.approx((0.012 * abs(v), 0.012 * u), abs=1e-5)
        np.testing.assert_allclose(patch.normal_at(0.012 * u, 0.012 * v), np.array([x, 0.0, z]) / RADIUS, atol=2e-3)
    assert report.largest < 2e-6
    assert "mm" in str(report)


def test_the_reported_distance_is_that_of_the_mesh():
    """Against the distance of dense points of the mesh from the patch, found by `locate`."""
    mesh = grid_mesh(lambda x, y: 0.002 * np.sin(250.0 * x) * np.cos(200.0 * y))
    patch, report = patch_from_mesh(mesh, (0.0, 0.0, 0.0), 0.015, control_points=7, tolerance=0.2)
    inside = mesh.vertices[np.abs(mesh.vertices[:, :2]).max(axis=1) < 0.0149]
    gaps = [np.linalg.norm(patch.point(*patch.locate(p)) - p) for p in inside[::17]]
    assert max(gaps) <= report.largest
    assert max(gaps) > 0.3 * report.largest
    with pytest.raises(ga.GraspAtlasError, match="misses the mesh by"):
        patch_from_mesh(mesh, (0.0, 0.0, 0.0), 0.015, control_points=7)
    finer, better = patch_from_mesh(mesh, (0.0, 0.0, 0.0), 0.015, control_points=20)
    assert better.largest < 0.2 * report.largest
    assert len(finer.control_points) == 20


def test_a_mesh_file_is_read(tmp_path):
    mesh = cylinder_mesh()
    mesh.export(tmp_path / "can.stl")
    from_file, _ = patch_from_mesh(tmp_path / "can.stl", (RADIUS, 0.0, 0.0), 0.01)
    same, _ = patch_from_mesh(mesh, (RADIUS, 0.0, 0.0), 0.01)
    np.testing.assert_allclose(from_file.point(0.004, -0.003), same.point(0.004, -0.003), atol=1e-8)


def test_far_faces_do_not_count():
    """A second sheet below, which the first one hides, is another region."""
    top, bottom = grid_mesh(lambda x, y: 0.0 * x + 0.004), grid_mesh(lambda x, y: 0.1 * x)
    patch, _ = patch_from_mesh(trimesh.util.concatenate([top, bottom]), (0.0, 0.0, 0.005), 0.01)
    np.testing.assert_allclose(patch.point(0.005, 0.005)[2], 0.004, atol=1e-12)


def three_sheets():
    """Three half-planes that meet in one edge."""
    vertices = [(0, -1, 0), (0, 1, 0), (1, 0, 0), (-1, 0, 0.1), (-1, 0, -0.1)]
    return trimesh.Trimesh(0.05 * np.array(vertices, float), [(0, 2, 1), (0, 1, 3), (0, 1, 4)], process=False)


def turned_faces():
    mesh = grid_mesh(lambda x, y: 0.0 * x)
    faces = np.array(mesh.faces)
    faces[1800:1810] = faces[1800:1810, ::-1]
    return trimesh.Trimesh(mesh.vertices, faces, process=False)


def with_hole():
    mesh = grid_mesh(lambda x, y: 0.0 * x)
    middles = mesh.triangles.mean(axis=1)
    keep = np.hypot(middles[:, 0] - 0.005, middles[:, 1]) > 0.002
    return trimesh.Trimesh(mesh.vertices, mesh.faces[keep], process=False)


def not_finite():
    mesh = grid_mesh(lambda x, y: 0.0 * x)
    return trimesh.Trimesh(np.where(mesh.vertices > 0.0299, np.nan, mesh.vertices), mesh.faces, process=False)


ROUND = (RADIUS, 0.0, 0.0)
WRONG = {
    "a file that is not there": (lambda: "nowhere.stl", ROUND, {}, "there is no mesh file"),
    "a number": (lambda: 3, ROUND, {}, "trimesh.Trimesh, got int"),
    "no faces": (lambda: trimesh.Trimesh(), ROUND, {}, "no faces"),
    "NaN": (not_finite, (0, 0, 0), {}, "not finite"),
    "two coordinates": (cylinder_mesh, (0.0, 0.0), {}, "center must be three finite numbers"),
    "far away": (cylinder_mesh, (0.5, 0.0, 0.0), {}, "away from the centre"),
    "size of zero": (cylinder_mesh, ROUND, {"size": 0.0}, "size must be positive"),
    "round the back": (cylinder_mesh, ROUND, {"size": 0.03}, "turns by"),
    "over the rim": (cylinder_mesh, (RADIUS, 0.049, 0.0), {}, "turns by"),
    "over the edge": (lambda: grid_mesh(lambda x, y: 0.0 * x), (0.029, 0.0, 0.0), {}, "edge or a hole"),
    "over a hole": (with_hole, (0.0, 0.0, 0.0), {}, "edge or a hole"),
    "three sheets": (three_sheets, (0.005, 0.0, 0.0), {}, "not a manifold"),
    "three sizes": (cylinder_mesh, ROUND, {"size": [0.01, 0.01, 0.01]}, "one length or two"),
    "a size of text": (cylinder_mesh, ROUND, {"size": "large"}, "size must be a number"),
    "a scale of zero": (cylinder_mesh, ROUND, {"scale": 0.0}, "scale must be a positive number"),
    "three control points": (cylinder_mesh, ROUND, {"control_points": 3}, "control_points must be"),
    "tolerance of text": (cylinder_mesh, ROUND, {"tolerance": "small"}, "tolerance must be a number"),
}


@pytest.mark.parametrize("name", WRONG)
def test_wrong_regions_are_refused(name):
    make, center, options, words = WRONG[name]
    with pytest.raises(ga.GraspAtlasError, match=words) as caught:
        patch_from_mesh(make(), center, **{"size": 0.01, **options})
    assert "\n" not in str(caught.value)


def test_a_damaged_file_is_refused(tmp_path):
    (tmp_path / "broken.ply").write_bytes(b"not a mesh")
    with pytest.raises(ga.GraspAtlasError, match=r"cannot read mesh file .*broken\.ply"):
        patch_from_mesh(tmp_path / "broken.ply", ROUND, 0.01)


def test_without_trimesh_the_error_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "trimesh", None)
    with pytest.raises(ga.GraspAtlasError, match=r"pip install graspatlas\[mesh\]"):
        patch_from_mesh("can.stl", ROUND, 0.01)


def test_the_best_grasp_on_a_fit_is_the_best_on_the_surface(can):
    """The index finger may touch one square of the can: as a part of the cylinder, and as a fit to a mesh of it."""
    size, cylinder = 0.012, can.contacts[1].object
    u, v = can.x1_array[-4:-2]
    center = cylinder.point(u, v)
    fit, _ = patch_from_mesh(cylinder_mesh(cylinder.radius), center, size, u_axis=(-np.sin(u), 0.0, np.cos(u)))
    reach = float(np.arcsin(size / cylinder.radius))
    part = Cylinder(
        radius=cylinder.radius, u_interval=(u - reach, u + reach), v_interval=(float(v) - size, float(v) + size)
    )
    bests, climbed = [], []
    for patch in (part, fit):
        contacts = [*can.contacts]
        contacts[1] = replace(contacts[1], object=patch)
        problem = replace(can, contacts=tuple(contacts))
        assert ga.systems.jacobian_error(problem.full_system, problem.x1_array) < 1e-7
        result = ga.optimize(problem, dimension=2, radius=0.1, epsilon=0.5, quality="inverse_condition_number")
        assert result.status is ga.Status.COMPLETE
        bests.append(result.best)
        climbed.append(ga.climb(result, result.best.chart))
    # The charts lie elsewhere, since u and v are other parameters; a climb from the best one does away with that.
    assert bests[1].quality == pytest.approx(bests[0].quality, rel=0.03)
    assert climbed[1].quality == pytest.approx(climbed[0].quality, rel=1e-3)
    np.testing.assert_allclose(climbed[1].x[13:16], climbed[0].x[13:16], atol=1e-4)
