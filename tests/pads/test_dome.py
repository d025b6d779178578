"""Patches fitted to surfaces that are known, and to meshes; the error that is stated against one that is measured."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from graspatlas.collision.shapes import Shape
from graspatlas.pads.dome import fit_dome
from graspatlas.patches import BSpline, Cylinder, Ellipsoid, Plane, Sphere
from graspatlas.viewer.scene.meshes import ellipsoid

Z, X = np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])


def fitted(shapes, point, direction=Z, largest=0.008):
    direction = np.asarray(direction) / np.linalg.norm(direction)
    dome = fit_dome(shapes, np.asarray(point, float), direction, X, largest)
    assert dome is not None
    return dome


def as_mesh(mesh) -> Shape:
    return Shape("mesh", points=mesh.vertices, triangles=mesh.faces.astype(np.int32), link="a")


def test_a_ball_is_a_sphere_as_far_as_it_goes():
    dome = fitted([Shape("sphere", (0.012, 0.0, 0.0))], [0.0, 0.0, 0.012])
    assert isinstance(dome.patch, Sphere)
    assert dome.patch.radius == pytest.approx(0.012)
    assert dome.error < 1e-5
    assert min(dome.patch.u_interval[1], dome.patch.v_interval[1]) > 0.7
    assert_allclose(dome.patch.point(), [0.0, 0.0, 0.012], atol=1e-12)
    assert_allclose(dome.patch.normal_at(), Z, atol=1e-12)


def test_a_tube_is_a_cylinder_as_long_as_it_is():
    """Along y, from -20 to 20 mm; met at y = 5 mm."""
    lying = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, -1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
    dome = fitted([Shape("cylinder", (0.01, 0.04, 0.0), placement=lying)], [0.0, 0.005, 0.01], largest=0.012)
    assert isinstance(dome.patch, Cylinder)
    assert dome.patch.radius == pytest.approx(0.01)
    ends = sorted(float(dome.patch.point(0.0, v)[1]) for v in dome.patch.v_interval)
    assert -0.0201 < ends[0] < -0.01
    assert 0.015 < ends[1] < 0.0201


def test_a_face_is_a_plane_to_its_edges():
    dome = fitted([Shape("box", (0.02, 0.03, 0.01))], [0.0, 0.0, 0.005])
    assert isinstance(dome.patch, Plane)
    assert dome.patch.u_interval == pytest.approx((-0.01, 0.01), abs=5e-4)
    assert 0.0099 < dome.patch.v_interval[1] < 0.015


def test_an_egg_is_an_ellipsoid():
    dome = fitted([as_mesh(ellipsoid([0.01, 0.016, 0.008], 160))], [0.0, 0.0, 0.008], largest=0.006)
    assert isinstance(dome.patch, Ellipsoid)
    # Curvatures at the top are c / a^2 and c / b^2.
    A, B, C = dome.patch.semi_axes
    assert_allclose(sorted([A / B**2, A / C**2]), [0.008 / 0.016**2, 0.008 / 0.01**2], rtol=0.04)


def saddle() -> Shape:
    ticks = np.linspace(-0.02, 0.02, 81)
    x, y = np.meshgrid(ticks, ticks, indexing="ij")
    points = np.stack([x, y, 12.0 * x**2 - 9.0 * y**2], axis=-1).reshape(-1, 3)
    i, j = (a.ravel() for a in np.meshgrid(np.arange(80), np.arange(80), indexing="ij"))
    a, b = 81 * i + j, 81 * (i + 1) + j
    faces = np.concatenate([np.column_stack([a, b, b + 1]), np.column_stack([a, b + 1, a + 1])])
    return Shape("mesh", points=points, triangles=faces.astype(np.int32))


def test_what_is_no_simple_surface_is_a_spline():
    dome = fitted([saddle()], [0.001, 0.0, 0.0], largest=0.01)
    assert isinstance(dome.patch, BSpline)
    assert dome.patch.normal_at()[2] > 0.99


@pytest.mark.parametrize("name", ["saddle", "egg", "capsule"])
def test_the_error_that_is_stated_holds(name):
    """Points of the patch all over its intervals, against the surface itself."""
    shapes = {
        "saddle": ([saddle()], [0.001, 0.0, 0.0], lambda p: np.abs(p[:, 2] - 12.0 * p[:, 0] ** 2 + 9.0 * p[:, 1] ** 2)),
        "egg": ([as_mesh(ellipsoid([0.01, 0.016, 0.008], 160))], [0.0, 0.0, 0.008], None),
        "capsule": ([Shape("capsule", (0.007, 0.02, 0.0))], [0.0049, 0.0, 0.0149], None),
    }
    solids, point, gap = shapes[name]
    dome = fitted(solids, point, [0.0, 0.0, 1.0] if name != "capsule" else [0.7, 0.0, 0.7], largest=0.006)
    rng = np.random.default_rng(0)
    lows, highs = np.transpose([dome.patch.interval(k) for k in dome.patch.parameters])
    points = np.array([dome.patch.point(*w) for w in rng.uniform(lows, highs, (400, 2))])
    if name == "capsule":
        axis = np.clip(points[:, 2], -0.01, 0.01)
        gaps = np.abs(np.linalg.norm(points - np.column_stack([0 * axis, 0 * axis, axis]), axis=1) - 0.007)
    elif name == "egg":
        scaled = np.linalg.norm(points / [0.01, 0.016, 0.008], axis=1)
        gaps = np.abs(scaled - 1.0) * 0.008
    else:
        gaps = gap(points)
    assert gaps.max() <= 1.2 * dome.error + 2e-5


def test_an_edge_has_no_dome():
    """The corner of a thin plate, seen along its diagonal."""
    plate = Shape("box", (0.02, 0.02, 0.0005))
    assert fit_dome([plate], np.array([0.01, 0.01, 0.0]), np.array([0.7071, 0.7071, 0.0]), X, 0.005) is None
