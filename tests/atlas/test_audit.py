"""Complete means covered: atlases of manifolds whose points are known, and what an audit says of them."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import pytest
from helpers import slow_but
from oracles.manifolds import Cone, Crossing, Ellipsoid, Helicoid, Neck, Rooms, Shells, Spiral, share_missing, traced

import graspatlas as ga
from graspatlas import _core
from graspatlas.atlas.coverage import measure_coverage
from graspatlas.systems import Sphere

# What the manifold is, and the radius of the charts.
HARD = {
    "ellipsoid 0.15": (lambda: Ellipsoid(1, 1, 0.15), 0.2),
    "ellipsoid 0.12": (lambda: Ellipsoid(1, 1, 0.12), 0.2),
    "ellipsoid 0.1": (lambda: Ellipsoid(1, 1, 0.1), 0.15),
    "ellipsoid 0.1, smaller charts": (lambda: Ellipsoid(1, 1, 0.1), 0.1),
    "ellipsoid 0.05": (lambda: Ellipsoid(1, 1, 0.05), 0.2),
    "needle": (lambda: Ellipsoid(1, 0.15, 0.15), 0.15),
    "ellipse 0.1": (lambda: Ellipsoid(1, 0.1), 0.2),
    "ellipse 0.03": (lambda: Ellipsoid(1, 0.03), 0.1),
    "3-ellipsoid 0.15": (lambda: Ellipsoid(1, 1, 1, 0.15), 0.35),
    "4-ellipsoid 0.3": (lambda: Ellipsoid(1, 1, 1, 1, 0.3), 0.75),
    "neck 0.1": (lambda: Neck(0.1), 0.2),
    "neck 0.03": (lambda: Neck(0.03), 0.2),
    "neck of a curve": (lambda: Neck(0.02, 1), 0.1),
    "neck in three dimensions": (lambda: Neck(0.15, 3), 0.3),
    "shells 0.02": (lambda: Shells(0.02), 0.2),
    "spiral": (lambda: Spiral(0.05), 0.2),
    "spiral in three dimensions": (lambda: Spiral(0.07, 3), 0.3),
    "helicoid": (lambda: Helicoid(0.05), 0.2),
    "helicoid in three dimensions": (lambda: Helicoid(0.1, 3), 0.3),
    "corridor as wide as a chart": (lambda: Rooms(0.2), 0.2),
    "corridor half as wide": (lambda: Rooms(0.1), 0.2),
}


@pytest.mark.parametrize("name", slow_but(HARD, "ellipsoid 0.12", "ellipse 0.1", "ellipse 0.03", "neck of a curve"))
def test_complete_means_covered(name):
    """Less than 0.5 % of points drawn without the atlas are missing, or it does not say complete."""
    make, radius = HARD[name]
    system = make()
    atlas = traced(system, radius)
    missing = share_missing(atlas, system.points(1500, np.random.default_rng(1)))
    assert missing < 0.005 or not atlas.complete, (missing, atlas)
    assert missing < 0.005, "not even found, though the result says so"


@pytest.mark.parametrize("width", slow_but([0.05, 0.02, 0.005], 0.005))
def test_a_corridor_too_narrow_to_be_found_is_not_hidden(width):
    """A quarter of a chart and less: what lies behind it is found, or the atlas does not say complete."""
    system = Rooms(width)
    atlas = traced(system, 0.2)
    missing = share_missing(atlas, system.points(1000, np.random.default_rng(2)))
    assert missing < 0.005 or not atlas.complete or atlas.audit.share_missing() > 0.005


@pytest.mark.parametrize("gap", slow_but([0.3, 0.05, 0.02], 0.3))
def test_only_the_shell_of_the_first_point_is_covered(gap):
    system = Shells(gap)
    atlas = traced(system, 0.2)
    assert atlas.complete
    np.testing.assert_allclose(np.linalg.norm(atlas.centers, axis=1), 1.0, atol=1e-9)
    assert share_missing(atlas, system.points(500, np.random.default_rng(3))) < 0.005
    assert atlas.volumes.sum() == pytest.approx(4 * np.pi, rel=0.03)


@pytest.mark.parametrize("factor", [1e12, 1e-12, 1e150, 1e-150])
def test_the_scale_of_an_equation_does_not_matter(factor):
    plain, scaled = (traced(Ellipsoid(1, 1, 1, factor=f), 0.2, 0.1) for f in (1.0, factor))
    assert scaled.complete
    assert scaled.n_charts == pytest.approx(plain.n_charts, rel=0.03)
    assert scaled.volumes.sum() == pytest.approx(4 * np.pi, rel=0.03)
    np.testing.assert_allclose(np.linalg.norm(scaled.centers, axis=1), 1.0, atol=1e-10)
    assert ga.build_atlas(scaled.system, scaled.centers[5], radius=0.2, epsilon=0.1).complete


def test_charts_that_no_step_can_leave_are_not_complete():
    """With so small an epsilon every step bends too much."""
    atlas = ga.build_atlas(Sphere(3), [0, 0, 1], radius=0.1, epsilon=1e-12)
    assert atlas.n_charts < 10
    assert not atlas.complete
    assert atlas.status is ga.Status.BLOCKED
    assert "cut short" in str(atlas.status)
    assert any("no step succeeds" in doubt for doubt in atlas.doubts)


def test_status_and_vertices_tell_the_same_truth(sphere):
    """A stored atlas may say complete; its blocked vertices say no."""
    closed = np.array(sphere.vertex_closed)
    closed[3] = ga.atlas.Closed.CURVATURE
    assert sphere.complete
    assert not replace(sphere, vertex_closed=closed).complete
    assert replace(sphere, vertex_closed=closed).blocked == 1


def test_what_an_audit_says(sphere):
    audit = sphere.audit
    assert audit.points >= 290
    assert audit.holes == 0
    assert audit.share_missing() == pytest.approx(1 - 0.05 ** (1 / audit.points))
    assert audit.share_missing(0.5) < audit.share_missing(0.99)
    assert sphere.doubts == ()
    short = ga.build_atlas(Sphere(3), [0, 0, 1], radius=0.1, epsilon=0.1, max_charts=50)
    assert short.audit.points == 0
    assert short.audit.share_missing() == 1.0
    assert any("limit of charts" in doubt for doubt in short.doubts)
    for confidence in (0.0, 1.0, -1.0, float("nan")):
        with pytest.raises(ga.GraspAtlasError, match="between 0 and 1"):
            audit.share_missing(confidence)


def test_holes_are_where_growth_goes_on():
    """From one chart of a flat ellipse no step succeeds; small steps round its ends do."""
    system = Ellipsoid(1, 0.03)
    builder = _core.AtlasBuilder(system, system.x0, 0.1, 0.5, 1)
    builder.expand(10**6, 1e3)
    assert builder.complete
    assert builder.n_charts < 5
    while not builder.audited:
        builder.audit(300, 1e3) if builder.complete else builder.expand(10**6, 1e3)
    assert builder.audit_holes > 0
    assert builder.n_charts > 40


@pytest.mark.slow
def test_an_audit_in_slices_and_pieces_is_the_same():
    """Cut by time, and resumed from a checkpoint in its middle."""
    system = Ellipsoid(1, 1, 0.05)

    def finished(seconds: float, resume: bool) -> dict[str, np.ndarray]:
        builder = _core.AtlasBuilder(system, system.x0, 0.2, 0.5, 1)
        for _ in range(100_000):
            if builder.audited:
                return {**builder.arrays(), "counts": np.array([builder.audit_points, builder.audit_holes])}
            if resume:
                builder = _core.AtlasBuilder.resume(system, builder.save(), 0.2, 0.5, 1)
            builder.audit(300, 1e3 if resume else seconds) if builder.complete else builder.expand(10**6, seconds)
        raise AssertionError("it never ends")

    whole = finished(1e3, False)
    for other in (finished(1e-4, False), finished(0.02, True)):
        for name in whole:
            np.testing.assert_array_equal(whole[name], other[name], err_msg=name)


def test_the_other_half_of_a_cone_is_not_called_covered():
    """Both halves meet in a point where the Jacobian vanishes: no chart can pass it."""
    atlas = traced(Cone(), 0.1, 0.3)
    assert (atlas.centers[:, 2] > -0.1).all() or (atlas.centers[:, 2] < -0.9).any()
    assert atlas.doubts


def test_where_the_jacobian_loses_rank_the_result_says_so():
    atlas = traced(Crossing(), 0.1)
    assert 5 <= atlas.nearly_singular.sum() <= 0.3 * atlas.n_charts
    near = np.abs(atlas.centers[atlas.nearly_singular, 0])
    assert near.max() < 0.25
    assert any("loses rank" in doubt for doubt in atlas.doubts)
    for regular in (traced(Ellipsoid(1, 1, 0.15), 0.2), traced(Neck(0.1), 0.2)):
        assert not regular.nearly_singular.any()


def test_regularity_is_about_the_smallest_singular_value(can_result):
    atlas = can_result.atlas
    rng = np.random.default_rng(4)
    scales = np.abs(atlas.system.evaluate_jacobian(atlas.centers[0])).max(axis=1, keepdims=True)
    ratios = []
    for chart in rng.integers(atlas.n_charts, size=200):
        J = atlas.system.evaluate_jacobian(atlas.centers[chart])
        smallest = np.linalg.svd(J / scales, compute_uv=False)[-1]
        ratios.append(atlas.regularities[chart] / smallest)
    assert np.median(ratios) == pytest.approx(1.0, abs=0.5)
    assert min(ratios) > 0.3
    assert not atlas.nearly_singular.any()


@pytest.mark.parametrize("threads", [1, 2])
def test_limits_of_time_are_kept_in_seven_dimensions(threads):
    start = time.perf_counter()
    atlas = ga.build_atlas(Sphere(8), np.eye(8)[0], radius=0.5, epsilon=0.3, max_seconds=1.0, threads=threads)
    assert time.perf_counter() - start < 2.5
    assert atlas.status is ga.Status.TIME_LIMIT
    assert atlas.n_charts > 1


@pytest.mark.slow
def test_a_component_whose_jacobian_nearly_loses_rank_is_covered_and_not_called_global():
    """The large component of the cup: walks in NumPy found points a chart's radius off, and it was called global."""
    found = ga.find_components(ga.load_problem("three_finger_cup"), covered=4, progress=False)
    atlas = max((result.atlas for result in found.results), key=lambda atlas: atlas.n_charts)
    assert atlas.n_charts > 50_000
    coverage = measure_coverage(atlas, atlas.system, points=1000, seed=11)
    assert coverage.farthest <= 0.15
    assert atlas.nearly_singular.sum() > 100
    assert not next(result for result in found.results if result.atlas is atlas).is_global


@pytest.mark.parametrize("room", [1e-4, 1e-9])
def test_a_strip_as_narrow_as_its_limits_is_followed(can, room):
    """No step can be taken inside it but along its bounds; what it covers is as long as the wider strip."""
    angle = can.x1.joints["thumb_pip"]
    strips = []
    for half in (1e-2, room):
        hand = replace(can.hand, limits={"thumb_pip": (angle - half, angle + half)})
        strips.append(ga.optimize(replace(can, hand=hand), dimension=2, radius=0.2, require=()).atlas)
    narrow = strips[1]
    assert narrow.audit.holes > 0
    assert narrow.n_charts > 15
    # From end to end, by the farthest two charts.
    lengths = [np.linalg.norm(a.centers[:, None] - a.centers[None], axis=2).max() for a in strips]
    assert lengths[1] == pytest.approx(lengths[0], rel=0.15)
