"""Spheres, tori, ellipsoids, splines and curves against closed forms and against SciPy."""

from __future__ import annotations

import json
from dataclasses import replace
from math import comb

import numpy as np
import pytest
from helpers import AXIS
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import NdBSpline

import graspatlas as ga
from graspatlas import GraspAtlasError
from graspatlas.patches import (
    Bezier,
    BSpline,
    Curve,
    Cylinder,
    Ellipsoid,
    Patch,
    Plane,
    Point,
    Revolution,
    Sphere,
    Torus,
    patch_from_dict,
)

angles = st.floats(-3.0, 3.0)
latitudes = st.floats(-1.4, 1.4)
shares = st.floats(0.0, 1.0)
ARRAYS = ("o", "m", "a", "b", "o_u", "m_u", "a_u", "b_u", "o_v", "m_v", "a_v", "b_v")


def sheet(p: int, q: int, seed: int = 0) -> np.ndarray:
    """Control points [p, q, 3] of a crumpled sheet."""
    points = np.random.default_rng(seed).normal(0.0, 0.002, (p, q, 3))
    points[..., 0] += np.linspace(0.0, 0.04, p)[:, None]
    points[..., 1] += np.linspace(0.0, 0.03, q)
    return points


def assert_same(first: Patch, second: Patch, u: float, v: float, *, atol: float = 1e-13) -> None:
    one, two = first.core().evaluate(u, v), second.core().evaluate(u, v)
    for name in ARRAYS:
        np.testing.assert_allclose(one[name], two[name], atol=atol, err_msg=name)


@given(u=angles, v=latitudes)
def test_every_point_of_a_sphere_is_as_far_from_its_centre(u, v):
    patch = Sphere(radius=0.02, **AXIS)
    arm = patch.point(u, v) - AXIS["origin"]
    np.testing.assert_allclose(arm, 0.02 * patch.normal_at(u, v), atol=1e-15)
    assert np.linalg.norm(arm) == pytest.approx(0.02)
    axis = np.array(AXIS["axis"]) / np.linalg.norm(AXIS["axis"])
    assert arm @ axis == pytest.approx(0.02 * np.sin(v), abs=1e-15)


@given(u=angles, v=latitudes)
def test_an_ellipsoid_of_equal_axes_is_a_sphere(u, v):
    assert_same(Ellipsoid(semi_axes=(0.02, 0.02, 0.02), **AXIS), Sphere(radius=0.02, **AXIS), u, v)


@given(u=angles, v=latitudes)
def test_an_ellipsoid_fulfils_its_equation_and_its_normal_is_the_gradient(u, v):
    axes = np.array([0.02, 0.05, 0.03])
    patch = Ellipsoid(semi_axes=tuple(axes))
    point = patch.point(u, v)
    assert ((point / axes) ** 2).sum() == pytest.approx(1.0)
    gradient = point / axes**2
    np.testing.assert_allclose(patch.normal_at(u, v), gradient / np.linalg.norm(gradient), atol=1e-12)


@given(u=angles, v=st.floats(-3.1, 3.1))
def test_a_torus_is_as_far_from_its_ring_everywhere(u, v):
    patch = Torus(ring_radius=0.03, tube_radius=0.01)
    ring = 0.03 * np.array([np.cos(u), 0.0, np.sin(u)])
    np.testing.assert_allclose(patch.point(u, v) - ring, 0.01 * patch.normal_at(u, v), atol=1e-15)
    assert patch.point(0.0, np.pi / 2) == pytest.approx([0.03, 0.01, 0.0])


@given(u=angles, v=st.floats(-0.012, 0.012))
def test_the_outside_of_a_torus_is_nearly_a_revolution_with_that_outline(u, v):
    """The same surface by another route, in other parameters."""
    heights = np.linspace(-0.02, 0.02, 81)
    turned = Revolution(heights=tuple(heights), radii=tuple(0.03 + np.sqrt(0.03**2 - heights**2)))
    torus = Torus(ring_radius=0.03, tube_radius=0.03, v_interval=(-1.0, 1.0))
    at = torus.locate(turned.point(u, v))
    np.testing.assert_allclose(torus.point(*at), turned.point(u, v), atol=1e-8)
    np.testing.assert_allclose(torus.normal_at(*at), turned.normal_at(u, v), atol=1e-5)


@given(u=shares, v=shares, degrees=st.tuples(st.integers(2, 5), st.integers(2, 5)))
def test_a_b_spline_and_its_derivatives_are_those_of_scipy(u, v, degrees):
    P = sheet(8, 7)
    patch = BSpline(control_points=P, degrees=degrees)
    scipy = NdBSpline((np.array(patch.u_knots), np.array(patch.v_knots)), P, k=degrees)

    def derivative(i: int, j: int) -> np.ndarray:
        return scipy(np.array([u, v]), nu=(i, j))

    p = patch.core().evaluate(u, v)
    o_u, o_v, o_uu, o_uv, o_vv = (derivative(*nu) for nu in ((1, 0), (0, 1), (2, 0), (1, 1), (0, 2)))
    np.testing.assert_allclose(p["o"], derivative(0, 0), atol=1e-14)
    np.testing.assert_allclose(p["o_u"], o_u, atol=1e-12)
    np.testing.assert_allclose(p["o_v"], o_v, atol=1e-12)
    normal = np.cross(o_u, o_v)
    np.testing.assert_allclose(p["m"], normal / np.linalg.norm(normal), atol=1e-9)
    # The second fundamental form, from second derivatives and from those of the normal.
    np.testing.assert_allclose(-p["m_u"] @ o_u, o_uu @ p["m"], atol=1e-10)
    np.testing.assert_allclose(-p["m_u"] @ o_v, o_uv @ p["m"], atol=1e-10)
    np.testing.assert_allclose(-p["m_v"] @ o_u, o_uv @ p["m"], atol=1e-10)
    np.testing.assert_allclose(-p["m_v"] @ o_v, o_vv @ p["m"], atol=1e-10)


@given(u=shares, v=shares)
def test_a_bezier_patch_is_the_sum_of_bernstein_polynomials(u, v):
    P = sheet(4, 6)
    total = np.zeros(3)
    for i in range(4):
        for j in range(6):
            weight = comb(3, i) * u**i * (1 - u) ** (3 - i) * comb(5, j) * v**j * (1 - v) ** (5 - j)
            total += weight * P[i, j]
    np.testing.assert_allclose(Bezier(control_points=P).point(u, v), total, atol=1e-15)


def test_a_b_spline_without_inner_knots_is_a_bezier_patch():
    P = sheet(4, 4)
    for u, v in ((0.0, 0.0), (0.3, 0.9), (1.0, 1.0)):
        assert_same(BSpline(control_points=P), Bezier(control_points=P), u, v)


def test_a_flat_spline_is_a_plane():
    u, v = np.meshgrid(np.linspace(0.0, 1.0, 5), np.linspace(0.0, 1.0, 5), indexing="ij")
    flat = Bezier(control_points=np.stack([0.03 * u, 0.02 * v, 0.0 * u], axis=-1))
    np.testing.assert_allclose(flat.point(0.3, 0.6), (0.009, 0.012, 0.0), atol=1e-15)
    np.testing.assert_allclose(flat.normal_at(0.3, 0.6), (0.0, 0.0, 1.0), atol=1e-12)


@given(u=angles, v=latitudes)
def test_a_flipped_patch_has_the_opposite_normal(u, v):
    for patch in (Sphere(radius=0.02), Torus(ring_radius=0.03, tube_radius=0.01), Cylinder(radius=0.02)):
        other = patch_from_dict({**patch.to_dict(), "flipped": True})
        np.testing.assert_array_equal(other.point(u, v), patch.point(u, v))
        np.testing.assert_array_equal(other.normal_at(u, v), -patch.normal_at(u, v))


@given(st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda n: np.linalg.norm(n) > 0.1))
def test_a_cap_touches_its_point_with_its_normal(normal):
    cap = Sphere.cap((0.01, 0.02, -0.03), normal, radius=0.008, half_angle=0.4)
    np.testing.assert_allclose(cap.point(), (0.01, 0.02, -0.03), atol=1e-15)
    np.testing.assert_allclose(cap.normal_at(), np.array(normal) / np.linalg.norm(normal), atol=1e-12)
    assert cap.interval("u") == cap.interval("v") == (-0.4, 0.4)


def test_a_curve_runs_through_its_points_and_has_the_normals_of_its_patch():
    sphere = Sphere(radius=0.02, **AXIS)
    points = ((-1.0, -0.5), (0.2, 0.7), (1.5, 0.1))
    curve = Curve(sphere, points)
    for u, v in points:
        s, _ = curve.locate(sphere.point(u, v))
        np.testing.assert_allclose(curve.point(s), sphere.point(u, v), atol=1e-9)
        np.testing.assert_allclose(curve.normal_at(s), sphere.normal_at(u, v), atol=1e-6)


@given(share=shares)
def test_a_meridian_and_a_straight_line_are_measured_in_metres(share):
    """On these curves the parameter is the length itself."""
    meridian = Curve(Sphere(radius=0.02), ((0.3, -1.0), (0.3, 1.0)))
    assert meridian.interval("u") == pytest.approx((0.0, 0.04), rel=1e-3)
    assert np.linalg.norm(meridian.core().evaluate(0.04 * share, 0.0)["o_u"]) == pytest.approx(1.0, rel=1e-3)
    line = Curve(Plane((0, 0, 0), (0, 0, 1)), ((0.01, 0.02), (0.04, 0.06)))
    assert line.interval("u") == pytest.approx((0.0, 0.05))
    np.testing.assert_allclose(line.point(0.05 * share), Plane((0, 0, 0), (0, 0, 1)).point(
        0.01 + 0.03 * share, 0.02 + 0.04 * share), atol=1e-15)  # fmt: skip


def test_a_curve_of_a_frozen_parameter_is_that_curve():
    cylinder = Cylinder(radius=0.02)
    curve = Curve(cylinder, ((-1.0, 0.01), (1.0, 0.01)))
    for s in (0.0, 0.013, 0.04):
        np.testing.assert_allclose(curve.point(s), cylinder.point(-1.0 + s / 0.02, 0.01), atol=1e-5)
    assert curve.parameters == ("u",)
    again = patch_from_dict(json.loads(json.dumps(curve.to_dict())))
    assert again == curve


FLAT = [[[0.0, 0.0, 0.0]] * 4] * 4
SPREAD = sheet(4, 4).tolist()
NAN = [[[float("nan")] * 3] * 4] * 4
TWISTED = np.array(SPREAD)
TWISTED[0] = TWISTED[0, 0]  # one edge is a point
BALL = {"type": "sphere", "radius": 0.02}
WRONG = {
    "sphere without radius": ({"type": "sphere"}, "radius must be positive"),
    "sphere of NaN": ({"type": "sphere", "radius": float("nan")}, "radius must be positive"),
    "sphere of text": ({"type": "sphere", "radius": "wide"}, "radius must be a number"),
    "sphere to the pole": ({**BALL, "v_interval": [0.0, np.pi / 2]}, "pole"),
    "sphere past the pole": ({**BALL, "v_interval": [1.0, 5.0]}, "pole"),
    "sphere more than round": ({**BALL, "u_interval": [0.0, 7.0]}, "wider than a turn"),
    "sphere flipped by text": ({**BALL, "flipped": "yes"}, "flipped must be True or False"),
    "ellipsoid with a zero axis": ({"type": "ellipsoid", "semi_axes": [1, 0, 1]}, "semi_axes must be positive"),
    "ellipsoid of two axes": ({"type": "ellipsoid", "semi_axes": [1, 1]}, "three finite numbers"),
    "ellipsoid to the pole": ({"type": "ellipsoid", "semi_axes": [1, 1, 1], "v_interval": [-2, 0]}, "pole"),
    "torus without ring": ({"type": "torus", "tube_radius": 0.01}, "ring_radius must be positive"),
    "torus without tube": ({"type": "torus", "ring_radius": 0.01}, "tube_radius must be positive"),
    "torus through its axis": ({"type": "torus", "ring_radius": 0.01, "tube_radius": 0.02}, "meets its axis"),
    "bezier without points": ({"type": "bezier"}, r"shape \[p, q, 3\]"),
    "bezier of a row": ({"type": "bezier", "control_points": SPREAD[0]}, r"shape \[p, q, 3\]"),
    "bezier of one row": ({"type": "bezier", "control_points": SPREAD[:1]}, r"shape \[p, q, 3\]"),
    "ragged bezier": ({"type": "bezier", "control_points": [SPREAD[0], SPREAD[1][:2]]}, "array of numbers"),
    "bezier of NaN": ({"type": "bezier", "control_points": NAN}, "not finite"),
    "bezier in one point": ({"type": "bezier", "control_points": FLAT}, "no normal"),
    "bezier with a collapsed edge": ({"type": "bezier", "control_points": TWISTED.tolist()}, "no normal at u = 0,"),
    "bezier of too many": ({"type": "bezier", "control_points": sheet(11, 4).tolist()}, "use a B-spline"),
    "bezier beyond its end": ({"type": "bezier", "control_points": SPREAD, "v_interval": [0.5, 1.5]}, "domain"),
    "b-spline of few": ({"type": "bspline", "control_points": sheet(3, 4).tolist()}, "at least 4 control points"),
    "b-spline of degree 0": ({"type": "bspline", "control_points": SPREAD, "degrees": [0, 3]}, "degrees must be"),
    "b-spline of degree 2.5": ({"type": "bspline", "control_points": SPREAD, "degrees": [2.5, 3]}, "degrees must be"),
    "b-spline of few knots": ({"type": "bspline", "control_points": SPREAD, "u_knots": [0, 1]}, "must be 8 numbers"),
    "falling knots": (
        {"type": "bspline", "control_points": SPREAD, "u_knots": [0, 0, 0, 0, 1, 1, 1, 0.5]},
        "must not descend",
    ),
    "knots of NaN": (
        {"type": "bspline", "control_points": SPREAD, "u_knots": [0, 0, 0, 0, 1, 1, 1, float("nan")]},
        "finite",
    ),
    "knots without a span": ({"type": "bspline", "control_points": SPREAD, "u_knots": [0] * 8}, "not be empty"),
    "a kink": (
        {"type": "bspline", "control_points": sheet(7, 4).tolist(), "u_knots": [0, 0, 0, 0, 1, 1, 1, 2, 2, 2, 2]},
        "comes too often",
    ),
    "unit of feet": ({"type": "bspline", "control_points": SPREAD, "unit": "ft"}, "'number' or 'm'"),
    "curve on nothing": ({"type": "curve", "points": [[0, 0], [1, 1]]}, "patch"),
    "curve on a number": ({"type": "curve", "patch": 3, "points": [[0, 0], [1, 1]]}, "two parameters"),
    "curve on a wrong patch": ({"type": "curve", "patch": {"type": "sphere"}, "points": [[0, 0], [1, 1]]}, "radius"),
    "curve of one point": ({"type": "curve", "patch": BALL, "points": [[0, 0]]}, "at least two pairs"),
    "curve of NaN": ({"type": "curve", "patch": BALL, "points": [[0, 0], [0, float("nan")]]}, "finite"),
    "curve that stands still": ({"type": "curve", "patch": BALL, "points": [[0, 0], [1, 1], [1, 1]]}, "are the same"),
    "curve past the pole": ({"type": "curve", "patch": BALL, "points": [[0, 0], [0, 1.5]]}, "leaves the patch"),
}


@pytest.mark.parametrize("name", WRONG)
def test_wrong_patches_are_refused(name):
    data, words = WRONG[name]
    with pytest.raises(GraspAtlasError, match=words) as caught:
        patch_from_dict(data)
    assert "\n" not in str(caught.value)


def test_a_collapsed_edge_may_be_kept_out():
    patch = Bezier(control_points=TWISTED, u_interval=(0.1, 1.0))
    assert patch.interval("u") == (0.1, 1.0)


def test_curves_lie_on_surfaces_only():
    for patch in (Point((0, 0, 0), (0, 0, 1)), Curve(Sphere(radius=0.02), ((0, 0), (1, 1)))):
        with pytest.raises(GraspAtlasError, match="two parameters"):
            Curve(patch, ((0, 0), (1, 1)))


def test_a_cap_is_refused_where_it_reaches_its_poles():
    with pytest.raises(GraspAtlasError, match="pole"):
        Sphere.cap((0, 0, 0), (0, 0, 1), 0.01, half_angle=1.6)


def test_grasps_on_a_curve_are_those_of_the_frozen_parameter(can):
    """The index finger slides round the can at one height: as a curve on it, and with the height frozen."""
    u, v = map(float, can.x1_array[-4:-2])
    cylinder = can.contacts[1].object
    arc = Cylinder(radius=cylinder.radius, u_interval=(u - 1.0, u + 1.0))
    bests = []
    for surface, frozen in ((arc, {"v": v}), (Curve(arc, ((u - 1.0, v), (u + 1.0, v))), {})):
        contacts = [*can.contacts]
        contacts[1] = replace(contacts[1], object=surface, frozen=frozen)
        problem = replace(can, contacts=tuple(contacts))
        assert problem.full_dimension == can.full_dimension - 1
        result = ga.optimize(problem, dimension=2, radius=0.1, epsilon=0.5, quality="smallest_semi_axis")
        assert result.is_global
        bests.append(ga.climb(result, result.best.chart).quality)
    assert bests[1] == pytest.approx(bests[0], rel=1e-3)
