"""Patches: surfaces, their frames and derivatives, and their plain data."""

from __future__ import annotations

import json

import numpy as np
import pytest
from helpers import AXIS
from hypothesis import given, settings
from hypothesis import strategies as st

from graspatlas import GraspAtlasError
from graspatlas.patches import (
    Bezier,
    BSpline,
    Cone,
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
from graspatlas.testing import check_patch


def wavy(p: int, q: int) -> np.ndarray:
    """Control points [p, q, 3] of a sheet with hills, in no special direction."""
    u, v = np.meshgrid(np.linspace(0.0, 0.05, p), np.linspace(0.0, 0.04, q), indexing="ij")
    height = 0.01 * np.sin(150.0 * u) * np.cos(110.0 * v)
    return np.stack([u + 0.2 * height, 0.3 * u + height, v - 0.1 * u], axis=-1) - 0.01


PATCHES: list[Patch] = [
    Point((0.1, 0.2, 0.3), (0.0, 3.0, 4.0)),
    Plane((0.1, 0.2, 0.3), (1.0, 2.0, -2.0), (0.0, 1.0, 1.0), (-0.1, 0.2), (-0.3, 0.3)),
    Plane((0.0, 0.0, 0.0), (1.0, 0.0, 0.0)),
    Cylinder(radius=0.02),
    Cylinder(radius=0.02, v_interval=(-0.05, 0.05), u_interval=(-1.0, 2.0), **AXIS),
    Cone(heights=(0.1, 0.0), radii=(0.01, 0.05), **AXIS),
    Cone(heights=(-0.02, 0.02), radii=(0.03, 0.01), v_interval=(-0.01, 0.01)),
    Revolution(heights=(-0.05, -0.02, 0.0, 0.03, 0.05), radii=(0.03, 0.02, 0.025, 0.04, 0.03), **AXIS),
    Revolution(heights=(-0.05, 0.05), radii=(0.03, 0.02)),
    Cylinder(radius=0.02, flipped=True, **AXIS),
    Sphere(radius=0.02, **AXIS),
    Sphere(radius=0.02, u_interval=(-0.5, 2.0), v_interval=(-0.3, 1.0), flipped=True),
    Torus(ring_radius=0.03, tube_radius=0.01, **AXIS),
    Torus(ring_radius=0.01, tube_radius=0.02, u_interval=(3.0, 5.0), v_interval=(-1.5, 1.5), flipped=True),
    Ellipsoid(semi_axes=(0.02, 0.05, 0.03), **AXIS),
    Ellipsoid(semi_axes=(0.04, 0.02, 0.03), u_interval=(2.0, 4.0), v_interval=(-0.5, 1.2), flipped=True),
    Bezier(control_points=wavy(4, 3)),
    Bezier(control_points=wavy(2, 2), flipped=True),
    BSpline(control_points=wavy(7, 6)),
    BSpline(
        control_points=wavy(6, 5),
        degrees=(4, 3),
        u_knots=(-0.3, -0.2, -0.2, 0.0, 0.01, 0.02, 0.05, 0.3, 0.4, 0.4, 0.5),
        v_knots=(-0.2, -0.2, -0.2, -0.1, 0.1, 0.2, 0.3, 0.3, 0.4),
        u_interval=(0.012, 0.019),
        unit="m",
        flipped=True,
    ),
    Curve(Sphere(radius=0.02, **AXIS), ((-1.0, -0.5), (0.5, 1.0))),
    Curve(Torus(ring_radius=0.03, tube_radius=0.01, flipped=True), ((-3.0, 0.0), (0.0, 1.0), (2.0, 3.0), (3.0, 2.5))),
    Curve(BSpline(control_points=wavy(5, 5)), ((0.1, 0.2), (0.5, 0.7), (0.9, 0.3))),
]
every_patch = pytest.mark.parametrize("patch", PATCHES, ids=lambda p: f"{p.kind}{PATCHES.index(p)}")
surfaces = pytest.mark.parametrize(
    "patch", [p for p in PATCHES if p.parameters], ids=lambda p: f"{p.kind}{PATCHES.index(p)}"
)
unit = st.floats(0.02, 0.98)


def parameters(patch: Patch, a: float, b: float) -> tuple[float, float]:
    """A point (u, v) inside the patch's intervals; 0 for a parameter that it does not have."""
    values = []
    for name, share in zip("uv", (a, b), strict=True):
        low, high = (patch.interval(name) or (-np.pi, np.pi)) if name in patch.parameters else (0.0, 0.0)
        low, high = (low, high) if np.isfinite(high - low) else (-0.3, 0.3)
        values.append(low + share * (high - low))
    return values[0], values[1]


@every_patch
def test_identities(patch):
    # The second derivative of an outline or of a spline has kinks, so its differences are less exact.
    check_patch(patch, count=100, tolerance=1e-6 if patch.kind in ("revolution", "bspline", "curve") else 1e-7)


@every_patch
def test_frames_are_orthonormal_to_the_ends_of_the_intervals(patch):
    core = patch.core()
    for a, b in np.ndindex(9, 9):
        p = core.evaluate(*parameters(patch, a / 8, b / 8))
        frame = np.array([p["a"], p["b"], p["m"]])
        np.testing.assert_allclose(frame @ frame.T, np.eye(3), atol=1e-12)
        assert abs(p["o_u"] @ p["m"]) < 1e-12
        assert abs(p["o_v"] @ p["m"]) < 1e-12


@surfaces
@settings(max_examples=15)
@given(a=unit, b=unit)
def test_locate_finds_the_parameters_of_a_point(patch, a, b):
    u, v = parameters(patch, a, b)
    point = patch.point(u, v)
    found = patch.locate(point)
    assert found[1] == pytest.approx(v, abs=1e-7)
    turn = found[0] - u if patch.kind == "plane" else np.angle(np.exp(1j * (found[0] - u)))
    assert abs(turn) < 1e-7
    np.testing.assert_allclose(patch.point(*found), point, atol=1e-7)


def test_locate_respects_an_interval_beyond_pi():
    """Angles from 3 to 4 are stated; the point at 3.5 is found at 3.5, not at 3.5 - 2 pi, which lies outside."""
    patch = Cylinder(radius=0.02, u_interval=(3.0, 4.0))
    assert patch.locate(patch.point(3.5, 0.01))[0] == pytest.approx(3.5)
    assert patch.locate(patch.point(3.1, 0.01))[0] == pytest.approx(3.1)


def test_surfaces_are_where_they_should_be():
    assert Point((0.1, 0.2, 0.3), (0, 3, 4)).normal_at() == pytest.approx([0.0, 0.6, 0.8])
    assert Point((0.1, 0.2, 0.3), (0, 3, 4)).point() == pytest.approx([0.1, 0.2, 0.3])
    plane = Plane((1, 0, 0), (0, 0, 2), (1, 0, 0.5))
    assert plane.point(0.2, 0.3) == pytest.approx([1.2, -0.3, 0.0])  # e_v = e_u x normal
    assert plane.normal_at(5, 5) == pytest.approx([0, 0, 1])
    cylinder = Cylinder(radius=0.5)
    for u, v in ((0.0, 0.0), (1.2, 3.0), (-2.5, -0.7)):
        assert cylinder.point(u, v) == pytest.approx([0.5 * np.cos(u), v, 0.5 * np.sin(u)])
        assert cylinder.normal_at(u, v) == pytest.approx([np.cos(u), 0.0, np.sin(u)])
    cone = Cone(heights=(-0.1, 0.0), radii=(0.05, 0.01))
    assert cone.point(0.0, -0.05) == pytest.approx([0.03, -0.05, 0.0])
    assert cone.normal_at(0.0, -0.05) == pytest.approx(np.array([1.0, 0.4, 0.0]) / np.hypot(1.0, 0.4))


def test_a_revolution_passes_through_its_outline():
    heights, radii = (-0.05, -0.02, 0.0, 0.03, 0.05), (0.03, 0.02, 0.025, 0.04, 0.03)
    patch = Revolution(heights=heights, radii=radii)
    for height, radius in zip(heights, radii, strict=True):
        assert patch.point(0.0, height) == pytest.approx([radius, height, 0.0])
        assert patch.radius_at(height) == pytest.approx(radius)


def test_a_moved_surface_is_the_same_surface():
    """Origin and axis place the surface: distance from the axis and height along it stay."""
    patch = Cone(heights=(0.0, 0.1), radii=(0.02, 0.05), **AXIS)
    axis = np.array(AXIS["axis"]) / np.linalg.norm(AXIS["axis"])
    for u, v in ((0.3, 0.02), (-2.0, 0.07)):
        arm = patch.point(u, v) - AXIS["origin"]
        assert arm @ axis == pytest.approx(v)
        assert np.linalg.norm(arm - (arm @ axis) * axis) == pytest.approx(0.02 + 0.3 * v)
    start = patch.point(0.0, 0.0) - AXIS["origin"]
    u_axis = np.array(AXIS["u_axis"]) - (np.array(AXIS["u_axis"]) @ axis) * axis
    assert start / np.linalg.norm(start) == pytest.approx(u_axis / np.linalg.norm(u_axis))


@every_patch
def test_round_trip_of_plain_data(patch):
    data = json.loads(json.dumps(patch.to_dict()))
    again = patch_from_dict(data)
    assert again.to_dict() == patch.to_dict()
    np.testing.assert_array_equal(again.point(0.3, 0.01), patch.point(0.3, 0.01))
    np.testing.assert_array_equal(again.normal_at(0.3, 0.01), patch.normal_at(0.3, 0.01))


WRONG = {
    "no table": ([1, 2], "table"),
    "no type": ({"radius": 1.0}, "patch type 'None'"),
    "unknown type": ({"type": "cylindre", "radius": 1.0}, "did you mean 'cylinder'"),
    "unknown attribute": ({"type": "cylinder", "radus": 1.0}, "did you mean 'radius'"),
    "missing attribute": ({"type": "point", "position": [0, 0, 0]}, "normal"),
    "two coordinates": ({"type": "point", "position": [0, 0], "normal": [0, 0, 1]}, "position"),
    "text": ({"type": "point", "position": "abc", "normal": [0, 0, 1]}, "position"),
    "NaN": ({"type": "point", "position": [0, 0, float("nan")], "normal": [0, 0, 1]}, "position"),
    "zero normal": ({"type": "plane", "origin": [0, 0, 0], "normal": [0, 0, 0]}, "normal must not be zero"),
    "zero axis": ({"type": "cylinder", "radius": 1.0, "axis": [0, 0, 0]}, "axis must not be zero"),
    "zero radius": ({"type": "cylinder"}, "radius"),
    "negative radius": ({"type": "cylinder", "radius": -1.0}, "radius"),
    "NaN radius": ({"type": "cylinder", "radius": float("nan")}, "radius"),
    "text radius": ({"type": "cylinder", "radius": "wide"}, "cylinder"),
    "interval upside down": ({"type": "cylinder", "radius": 1.0, "v_interval": [1, 0]}, "v_interval"),
    "interval of one": ({"type": "cylinder", "radius": 1.0, "u_interval": [1]}, "u_interval"),
    "interval of NaN": ({"type": "cylinder", "radius": 1.0, "u_interval": [float("nan"), 1]}, "u_interval"),
    "interval of text": ({"type": "cylinder", "radius": 1.0, "u_interval": ["a", "b"]}, "interval"),
    "flat cone": ({"type": "cone", "heights": [1, 1], "radii": [1, 2]}, "two heights"),
    "pointless cone": ({"type": "cone", "heights": [0, 1], "radii": [0, 0]}, "radii"),
    "negative cone": ({"type": "cone", "heights": [0, 1], "radii": [-1, 1]}, "radii"),
    "cone of three": ({"type": "cone", "heights": [0, 1, 2], "radii": [1, 1, 1]}, "cone"),
    "beyond the apex": ({"type": "cone", "heights": [0, 1], "radii": [1, 0], "v_interval": [0, 3]}, "v_interval"),
    "outline of one": ({"type": "revolution", "heights": [0], "radii": [1]}, "two heights"),
    "uneven outline": ({"type": "revolution", "heights": [0, 1], "radii": [1]}, "radii"),
    "falling outline": ({"type": "revolution", "heights": [1, 0], "radii": [1, 1]}, "ascending"),
    "outline of NaN": ({"type": "revolution", "heights": [0, float("nan"), 1], "radii": [1, 1, 1]}, "ascending"),
    "outline with a hole": ({"type": "revolution", "heights": [0, 1], "radii": [1, 0]}, "positive radii"),
}


@pytest.mark.parametrize("name", WRONG)
def test_wrong_patches_are_refused(name):
    data, words = WRONG[name]
    with pytest.raises(GraspAtlasError, match=words):
        patch_from_dict(data)


def test_a_point_has_no_parameter():
    point = Point((0, 0, 0), (0, 0, 1))
    assert point.parameters == ()
    assert point.locate([1.0, 2.0, 3.0]) == (0.0, 0.0)
    with pytest.raises(GraspAtlasError, match="parameter"):
        point.interval("u")


def test_intervals():
    assert Cylinder(radius=1.0).interval("u") is None
    assert Cylinder(radius=1.0).interval("v") == (-np.inf, np.inf)
    assert Cone(heights=(0.2, 0.1), radii=(1.0, 2.0)).interval("v") == (0.1, 0.2)
    assert Plane((0, 0, 0), (0, 0, 1), u_interval=(-1, 2)).interval("u") == (-1.0, 2.0)
