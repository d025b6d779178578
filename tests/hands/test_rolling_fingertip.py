"""Rolling contact: a domed fingertip instead of a fixed point, region against region."""

from __future__ import annotations

import importlib.util
from dataclasses import replace

import numpy as np
import pytest
from helpers import ROOT

import graspatlas as ga
from graspatlas.patches import Ellipsoid, Patch, Plane, Sphere, Torus

EXAMPLE = ROOT / "examples" / "rolling_fingertip.py"


@pytest.fixture(scope="module")
def example():
    spec = importlib.util.spec_from_file_location("rolling_fingertip", EXAMPLE)
    assert spec
    assert spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def domes(point: ga.patches.Point) -> dict[str, Patch]:
    """Convex fingertips that touch where the point does, with its normal."""
    n, p = np.array(point.normal), np.array(point.position)
    across = np.cross(n, (0.0, 1.0, 0.0))
    place = {"axis": tuple(across), "u_axis": tuple(n), "u_interval": (-0.5, 0.5), "v_interval": (-0.5, 0.5)}
    return {
        "sphere": Sphere.cap(point.position, point.normal, 0.008),
        "ellipsoid": Ellipsoid(semi_axes=(0.006, 0.012, 0.009), origin=tuple(p - 0.006 * n), **place),
        "torus": Torus(ring_radius=0.004, tube_radius=0.006, origin=tuple(p - 0.01 * n), **place),
        "plane": Plane(point.position, point.normal, tuple(across), (-0.004, 0.004), (-0.004, 0.004)),
    }


def with_tip(problem: ga.Problem, finger: int, tip: Patch, **options) -> ga.Problem:
    contacts = [*problem.contacts]
    contacts[finger] = replace(contacts[finger], hand=tip, **options)
    return replace(problem, contacts=tuple(contacts))


@pytest.mark.parametrize("finger", [1, 2])
@pytest.mark.parametrize("kind", ["sphere", "ellipsoid", "torus", "plane"])
def test_a_rolling_tip_adds_its_parameters_to_the_dimension(can, finger, kind):
    tip = domes(can.contacts[finger].hand)[kind]
    for frozen in ({}, {"u": 0.0}, {"v": 0.0}, {"u": 0.0, "v": 0.0}):
        problem = with_tip(can, finger, tip, hand_frozen=frozen)
        assert problem.full_dimension == can.full_dimension + 2 - len(frozen)
        assert ga.systems.jacobian_error(problem.full_system, problem.x1_array) < 1e-7
        if kind == "plane":  # touches along a line: anywhere on it will do
            continue
        # x1 touches where it did: the parameters there are found without being given.
        touch = problem.full_system.grasp_arrays(problem.x1_array[None])["hand_points"][0, finger]
        point = can.full_system.grasp_arrays(can.x1_array[None])["hand_points"][0, finger]
        np.testing.assert_allclose(touch, point, atol=1e-5)


def test_x1_is_found_for_a_tip_that_touches_off_its_middle(can):
    """The cap's u = v = 0 is 0.3 rad away from where x1 touches."""
    point = can.contacts[2].hand
    n = np.array(point.normal)
    side = np.cross(n, (0.0, 1.0, 0.0))
    side /= np.linalg.norm(side)
    tilted = np.cos(0.3) * n + np.sin(0.3) * side
    tip = Sphere.cap(np.array(point.position) - 0.008 * n + 0.008 * tilted, tilted, 0.008)
    problem = with_tip(can, 2, tip)
    u, v = problem.x1_array[-4:-2]
    assert np.cos(u) * np.cos(v) == pytest.approx(np.cos(0.3), abs=1e-4)
    result = ga.optimize(problem, dimension=2, radius=0.25, epsilon=0.5, max_charts=30)
    assert result.check().passed


def test_a_result_with_a_rolling_tip_is_verified_and_reloaded(can, example, tmp_path):
    problem = example.with_dome(can, "thumb_distal", {"v": 0.0})
    result = ga.optimize(problem, dimension=2, radius=0.25, epsilon=0.5, quality="smallest_semi_axis")
    assert result.status is ga.Status.COMPLETE
    report = result.check()
    assert report.passed, str(report)
    assert np.ptp(result.atlas.centers[:, -3]) > 0.3  # the thumb does roll
    result.save(tmp_path / "rolled.npz")
    again = ga.load_result(tmp_path / "rolled.npz")
    assert again.problem.to_dict() == problem.to_dict()
    np.testing.assert_array_equal(again.atlas.centers, result.atlas.centers)


def test_rolling_finds_a_better_grasp_than_the_fixed_point(can, example, capsys):
    """With the same frozen hand motions and requirements, on complete atlases; the fixed point is on the dome."""
    fixed = example.search(can, dimension=2)
    rolls = example.with_dome(can, "thumb_distal", {"u": 0.0})
    assert rolls.frozen_motions(3) == can.frozen_motions(2)
    rolling = example.search(rolls, dimension=3)
    assert fixed.is_global
    assert rolling.is_global
    assert rolling.best.quality > 1.2 * fixed.best.quality
    # The best grasp of the fixed point is a grasp of the dome too.
    x = fixed.best.x
    on_dome = np.concatenate([x[:-2], [0.0], x[-2:]])
    assert np.abs(rolling.atlas.system.evaluate_residual(on_dome)).max() < 1e-9
    assert np.abs(rolls.frozen_residual(on_dome, 3)).max() < 1e-9
    angle = rolling.best.x[example.rolling_index(rolls)]
    assert 0.01 < abs(angle) < example.HALF_ANGLE
    assert "hold" in capsys.readouterr().out
