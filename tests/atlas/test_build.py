"""Toy manifolds whose size and shape are known."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from helpers import PythonSphere, Written, assert_same_atlas, bare_system, chain, robot, slow_but

import graspatlas as ga
from graspatlas.atlas.verification import check_atlas
from graspatlas.systems import Angles, Rotations, Sphere, Torus

TWO_JOINTS = robot(chain("f", (0.0, 0.0, 0.1), ["0 0 1", "0 1 0"], 0.05, "continuous"))

# system, x0, radius, epsilon, charts (least, most), volume, its relative tolerance
TOYS = {
    "circle": (lambda: Sphere(2), [1, 0], 0.1, 0.1, (58, 72), 2 * np.pi, 0.01),
    "sphere": (lambda: Sphere(3), [0, 0, 1], 0.1, 0.1, (1135, 1205), 4 * np.pi, 0.01),
    "3-sphere": (lambda: Sphere(4), [0, 0, 0, 1], 0.2, 0.1, (2100, 2450), 2 * np.pi**2, 0.03),
    "4-sphere": (lambda: Sphere(5), [0, 0, 0, 0, 1], 0.4, 0.1, (2500, 3500), 8 * np.pi**2 / 3, 0.05),
    "torus": (lambda: Torus(0.8, 0.5), [1.3, 0, 0], 0.1, 0.1, (1440, 1480), 1.6 * np.pi**2, 0.02),
    "one angle": (lambda: Angles(1), [0], 0.1, 0.5, (58, 72), 2 * np.pi, 1e-9),
    "two angles": (lambda: Angles(2), [3, -3], 0.2, 0.5, (700, 1000), 4 * np.pi**2, 1e-6),
    "rotations": (Rotations, [0, 0, 0, 1], 0.4, 0.5, (900, 1400), 8 * np.pi**2, 0.05),
    "two joints": (lambda: bare_system(TWO_JOINTS), [1, 0, 1, 0], 0.2, 0.5, (700, 1000), 4 * np.pi**2, 1e-6),
}


@pytest.mark.parametrize("name", slow_but(TOYS, *(name for name in TOYS if name != "4-sphere")))
def test_covers_the_whole_manifold(name):
    system, x0, radius, epsilon, charts, volume, tolerance = TOYS[name]
    atlas = ga.build_atlas(system(), x0, radius=radius, epsilon=epsilon)
    assert atlas.status is ga.Status.COMPLETE
    assert atlas.complete
    assert charts[0] <= atlas.n_charts <= charts[1]
    assert atlas.volumes.sum() == pytest.approx(volume, rel=tolerance)
    assert sum(atlas.closed_vertices.values()) == 0
    residuals = [np.abs(atlas.system.evaluate_residual(x)).max(initial=0.0) for x in atlas.centers]
    assert max(residuals) < 1e-9
    report = check_atlas(atlas)
    assert report.passed, str(report)


def test_euler_characteristic(sphere):
    torus = ga.build_atlas(Torus(0.8, 0.5), [1.3, 0, 0], radius=0.1, epsilon=0.1)
    flat = ga.build_atlas(Angles(2), [0, 0], radius=0.2, epsilon=0.5)
    assert sphere.euler_characteristic() == 2
    assert torus.euler_characteristic() == 0
    assert flat.euler_characteristic() == 0


def test_euler_characteristic_of_other_atlases_is_refused(sphere):
    circle = ga.build_atlas(Sphere(2), [1, 0], radius=0.1, epsilon=0.1)
    with pytest.raises(ga.GraspAtlasError, match="k = 2"):
        circle.euler_characteristic()
    part = ga.build_atlas(Sphere(3), [0, 0, 1], radius=0.1, epsilon=0.1, max_charts=50)
    with pytest.raises(ga.GraspAtlasError, match="complete"):
        part.euler_characteristic()
    half = ga.build_atlas(PythonSphere(3, lower=[-np.inf, -np.inf, 0.0]), [0, 0, 1], radius=0.1, epsilon=0.1)
    with pytest.raises(ga.GraspAtlasError, match="boundary"):
        half.euler_characteristic()


def test_rotations_are_covered_once():
    """A quaternion and its negative are one rotation: 8 pi^2, not 16 pi^2, and no two centres are the same."""
    atlas = ga.build_atlas(Rotations(), [0, 0, 0, 1], radius=0.5, epsilon=0.5)
    cosines = np.abs(atlas.centers @ atlas.centers.T)
    np.fill_diagonal(cosines, 0.0)
    nearest = 2 * np.arccos(np.clip(cosines, 0.0, 1.0)).min()
    assert nearest > 0.2 * atlas.radius
    rng = np.random.default_rng(0)
    for _ in range(50):
        q = rng.normal(size=4)
        q /= np.linalg.norm(q)
        assert atlas.locate(q)[0] == atlas.locate(-q)[0] >= 0


def test_rotations_agree_with_pinocchio():
    model = pin.Model()
    model.addJoint(0, pin.JointModelSpherical(), pin.SE3.Identity(), "ball")
    system = Rotations()
    rng = np.random.default_rng(1)
    for _ in range(100):
        q0, q1 = (q / np.linalg.norm(q) for q in rng.normal(size=(2, 4)))
        v = rng.normal(size=3)
        v *= min(1.0, 3.0 / np.linalg.norm(v))
        moved, expected = system.integrate(q0, v), pin.integrate(model, q0, v)
        assert min(np.abs(moved - expected).max(), np.abs(moved + expected).max()) < 1e-12
        np.testing.assert_allclose(system.difference(q0, q1), pin.difference(model, q0, q1), atol=1e-9)


def test_free_flyer_agrees_with_pinocchio():
    system = bare_system(TWO_JOINTS, "free_flyer", length_scale=0.02)
    model = pin.Model()
    model.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "object")
    rng = np.random.default_rng(2)
    scale = np.r_[np.full(3, 0.02), np.ones(3)]
    for _ in range(100):
        hand = np.array([np.cos(0.3), np.sin(0.3), 1.0, 0.0])
        pose0, pose1 = (np.r_[rng.normal(size=3), q / np.linalg.norm(q)] for q in rng.normal(size=(2, 4)))
        v = rng.normal(size=6) * 0.4
        moved = system.integrate(np.r_[hand, pose0], np.r_[0.0, 0.0, v])
        expected = pin.integrate(model, pose0, scale * v)
        np.testing.assert_allclose(moved[4:7], expected[:3], atol=1e-12)
        assert abs(abs(moved[7:] @ expected[3:]) - 1.0) < 1e-12
        got = system.difference(np.r_[hand, pose0], np.r_[hand, pose1])[2:]
        np.testing.assert_allclose(scale * got, pin.difference(model, pose0, pose1), atol=1e-9)


@pytest.mark.parametrize("n", [2, 3])
def test_system_in_python_gives_the_same_atlas(n):
    x0 = np.eye(n)[-1]
    options = {"radius": 0.1, "epsilon": 0.1}
    theirs, ours = ga.build_atlas(Sphere(n), x0, **options), ga.build_atlas(PythonSphere(n), x0, **options)
    assert theirs.n_charts > 50
    assert_same_atlas(theirs, ours)


@pytest.mark.parametrize("x0", [(0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.6, 0.0, 0.8)])
def test_bounds_cut_the_sphere_in_half(x0):
    """Also from a first point that lies on the bound itself."""
    system = PythonSphere(3, lower=[-np.inf, -np.inf, 0.0])
    atlas = ga.build_atlas(system, x0, radius=0.1, epsilon=0.1)
    assert atlas.complete
    assert atlas.centers[:, 2].min() >= -1e-9
    assert atlas.volumes.sum() == pytest.approx(2 * np.pi, rel=0.02)
    assert (atlas.facet_tags == -2).sum() > 20
    assert check_atlas(atlas).passed


def test_bounds_cut_a_band_and_an_arc():
    band = PythonSphere(3, lower=[-np.inf, -np.inf, -0.3], upper=[np.inf, np.inf, 0.3])
    atlas = ga.build_atlas(band, [1, 0, 0], radius=0.1, epsilon=0.1)
    assert atlas.volumes.sum() == pytest.approx(2 * np.pi * 0.6, rel=0.02)
    arc = PythonSphere(2, lower=[0.0, 0.0])
    atlas = ga.build_atlas(arc, [0.6, 0.8], radius=0.05, epsilon=0.1)
    assert atlas.volumes.sum() == pytest.approx(np.pi / 2, rel=0.02)


def test_only_the_connected_part_is_covered():
    """Two circles x^2 + y^2 = 1 and = 4: only the one with x0 is traced."""
    system = Written(
        2,
        1,
        lambda x: [(x @ x - 1.0) * (x @ x - 4.0)],
        lambda x: [2.0 * x * (2.0 * (x @ x) - 5.0)],
    )
    atlas = ga.build_atlas(system, [0.0, 2.0], radius=0.1, epsilon=0.1)
    np.testing.assert_allclose(np.linalg.norm(atlas.centers, axis=1), 2.0, atol=1e-9)
    assert atlas.volumes.sum() == pytest.approx(4 * np.pi, rel=0.01)


def test_limits_cut_the_atlas_short():
    few = ga.build_atlas(Sphere(3), [0, 0, 1], radius=0.1, epsilon=0.1, max_charts=17)
    assert few.n_charts == 17
    assert few.status is ga.Status.CHART_LIMIT
    assert not few.complete
    assert check_atlas(few).passed
    brief = ga.build_atlas(Sphere(4), [0, 0, 0, 1], radius=0.02, epsilon=0.1, max_seconds=0.15)
    assert brief.status is ga.Status.TIME_LIMIT
    assert brief.seconds < 1.0
    assert "cut short" in str(brief.status)


def test_smaller_epsilon_makes_more_charts():
    counts = [
        ga.build_atlas(Sphere(3), [0, 0, 1], radius=0.5, epsilon=epsilon).n_charts for epsilon in (0.5, 0.1, 0.02)
    ]
    assert counts[0] < counts[1] < counts[2]


ROUND = {"two angles": 4 * np.pi**2, "rotations": 8 * np.pi**2}


@pytest.mark.parametrize("radius", [1.58, 3.5, 50.0, 1e6, 1e300])
@pytest.mark.parametrize("name", ROUND)
def test_a_radius_beyond_a_quarter_turn_is_refused(name, radius):
    """Two steps of it go more than half round, and come back from the other side."""
    system, x0, *_ = TOYS[name]
    with pytest.raises(ga.GraspAtlasError, match=r"radius must be below 1\.57"):
        ga.build_atlas(system(), x0, radius=radius, epsilon=0.5, max_seconds=0.5)


@pytest.mark.parametrize("radius", [1.0, 1.3, 1.56])
@pytest.mark.parametrize("name", ROUND)
def test_the_largest_radius_that_is_allowed_does_its_work(name, radius):
    system, x0, *_ = TOYS[name]
    atlas = ga.build_atlas(system(), x0, radius=radius, epsilon=0.5)
    assert atlas.complete
    assert sum(atlas.closed_vertices.values()) == 0
    assert atlas.volumes.sum() == pytest.approx(ROUND[name], rel=0.15)
    rng = np.random.default_rng(4)
    for _ in range(100):
        x = rng.uniform(-np.pi, np.pi, 2) if name == "two angles" else rng.normal(size=4)
        chart, distance = atlas.locate(x if name == "two angles" else x / np.linalg.norm(x))
        assert chart >= 0
        assert distance < 0.1 * radius
