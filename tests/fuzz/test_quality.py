"""Fuzzing of indices, requirements, grasps and pictures."""

from __future__ import annotations

from dataclasses import astuple

import numpy as np
from drawn import anything, few, no_numbers, odd_numbers, tried, vectors
from hypothesis import given
from hypothesis import strategies as st

import graspatlas as ga
from graspatlas import quality, requirements


@given(value=odd_numbers | no_numbers)
@few(80)
def test_quality_options(tripod, value):
    grasps = ga.Grasps(tripod, tripod.x1_array, tripod.system(6))
    for index in (quality.inverse_condition_number, quality.manipulability_volume, quality.smallest_semi_axis):
        result = tried(lambda i=index: i(grasps, value), TypeError)
        assert result is None or (result >= 0.0).all()
    margin = tried(lambda: quality.force_closure_margin(grasps, value), TypeError)
    assert margin is None or 0.0 <= margin[0] <= 1.0


@given(returned=anything, batched=st.booleans())
@few(100)
def test_indices_and_predicates_that_return_anything(tripod, returned, batched):
    def index(_):
        return returned

    index.batched = batched
    grasps = ga.Grasps(tripod, [tripod.x1_array] * 2, tripod.system(6))
    values = tried(lambda: quality.evaluate(index, grasps))
    if values is not None:
        np.testing.assert_array_equal(values, np.broadcast_to(np.asarray(returned, float), 2))
        assert np.isfinite(values).all()
    elif isinstance(returned, float) and not batched:
        assert not np.isfinite(returned)
    assert str(returned) in quality.INDICES or tried(lambda: quality.evaluate(returned, grasps), TypeError) is None
    flags = tried(lambda: requirements.screen([index], grasps))
    assert (flags is None) == (not isinstance(returned, bool) or batched)
    assert flags is None or flags[0].tolist() == [returned] * 2
    assert tried(lambda: requirements.screen([returned], grasps)) is None


@given(first=anything, second=anything)
@few(150)
def test_requirements(first, second):
    for make in (
        lambda: ga.ForceClosure(first, second),
        lambda: ga.CollisionFree(first, second),
        lambda: ga.JointMargin(first),
    ):
        made = tried(make)
        if made is not None:
            again = requirements.parse_requirement(str(made))
            assert type(again) is type(made)
            np.testing.assert_allclose(astuple(again), astuple(made), rtol=1e-5)
    if str(first) not in requirements.REQUIREMENTS:
        assert tried(lambda: requirements.parse_requirement(f"{first}:{second}")) is None
    read = tried(lambda: requirements.parse_requirement(f"force_closure:{first}:{second}"))
    assert read is None or (read.friction, read.margin) == (float(first), float(second or 0.0))


@given(X=anything | st.lists(st.lists(odd_numbers, min_size=22, max_size=22), max_size=2))
@few(100)
def test_grasps_of_anything(tripod, X):
    grasps = tried(lambda: ga.Grasps(tripod, X))
    if grasps is not None:
        for read in (
            lambda: grasps.semi_axes,
            lambda: quality.force_closure_margin(grasps),
            lambda: grasps.contact_points,
        ):
            values = tried(read)
            assert values is None or len(values) == len(grasps)


@given(angles=st.lists(st.floats(-3.0, 3.0), min_size=9, max_size=9), turn=st.floats(-3.0, 3.0), v=vectors)
@few(50)
def test_grasps_that_touch_nothing(tripod, angles, turn, v):
    """Any posture, any pose: rotations are rotations, and every push on the object is what the contacts push."""
    x = tripod.x1_array.copy()
    x[:9] = angles
    x[9:12] = np.clip(np.nan_to_num(v), -1.0, 1.0)
    x[12:16] = [0.0, np.sin(turn / 2.0), 0.0, np.cos(turn / 2.0)]
    one = ga.Grasps(tripod, x)[0]
    R = one.T_palm_object[:3, :3]
    np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(one.contact_normals, axis=1), 1.0, atol=1e-12)
    np.testing.assert_allclose(one.T_palm_object @ one.T_object_palm, np.eye(4), atol=1e-12)
    assert (np.diff(one.semi_axes) >= 0.0).all()
    assert one.semi_axes[0] >= 0.0
    forces = np.random.default_rng(0).normal(size=(3, 3))
    arms = one.contact_points - one.object_xyz
    wrench = np.r_[forces.sum(axis=0), np.cross(arms, forces).sum(axis=0)]
    np.testing.assert_allclose(one.G @ forces.ravel(), wrench, atol=1e-9)


@given(size=st.integers(-2, 2**40) | anything)
@few(60)
def test_picture_sizes(tripod_result, tmp_path, size):
    if not isinstance(size, int) or isinstance(size, bool) or size < 320 or size > 4000:
        assert tried(lambda: ga.save_picture(tripod_result, tmp_path / "p.png", width=size)) is None
        assert tried(lambda: ga.save_picture(tripod_result, tmp_path / "p.png", height=size)) is None
