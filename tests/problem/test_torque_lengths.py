"""Torques are measured by one length for one problem, whatever x1, the seed or the component is."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import graspatlas as ga
from graspatlas import patches, quality
from graspatlas.problem.object_joint import FREE_FLYER, PLANAR
from graspatlas.problem.torque_lengths import largest_arm
from graspatlas.problem_files import read_problem
from graspatlas.problems import problem_text

Array = NDArray[np.float64]
TIP = patches.Point((0, 0, 0), (0, 0, 1))
#: Indices that weigh torques against forces.
WEIGHING = ("ferrari_canny_epsilon", "soft_finger_epsilon", "ferrari_canny_volume", "grasp_isotropy")


def arm(patch: patches.Patch, *, planar: bool = False, **frozen: float) -> float:
    return largest_arm([ga.Contact("tip", TIP, patch, frozen=frozen)], PLANAR if planar else FREE_FLYER)


@pytest.mark.parametrize("name", ga.bundled_problems())
def test_no_grasp_plays_a_part(name: str) -> None:
    problem = ga.load_problem(name)
    atlas = ga.optimize(problem, max_charts=60, require=[]).atlas
    last = ga.Grasps(problem, atlas.centers[-1:], atlas.system)
    others = [problem.at(x) for x in atlas.centers[[20, 59]]]
    assert {p.torque_arm for p in (problem, replace(problem, x1=None), *others)} == {problem.torque_arm}
    for index in WEIGHING:
        values = [quality.evaluate(index, ga.Grasps(p, last.x, last.system))[0] for p in (problem, *others)]
        assert values[0] == values[1] == values[2]
    arms = np.linalg.norm(ga.Grasps(problem, atlas.centers).contact_points_in_object, axis=2)
    assert arms.max() <= problem.torque_arm * (1.0 + 1e-9)


@pytest.mark.slow
def test_components_of_one_optimum_are_ranked_alike() -> None:
    """The cup's two components mirror one another; which of them has x1 is left to chance."""
    first = ga.load_problem("three_finger_cup")
    found = ga.find_components(first, radius=0.2, refine=True, covered=20)
    (home,) = [r for r in found.results if r.problem.x1 is first.x1]
    (away,) = [r for r in found.results if r is not home]
    turned = ga.find_components(first.at(away.atlas.centers[7]), radius=0.2, refine=True, covered=20, seed=3)
    assert len(turned) == 2
    results = (*found.results, *turned.results)
    assert {r.problem.torque_arm for r in results} == {found.summary()["torque_length"]}
    np.testing.assert_allclose([r.refined_best.quality for r in results], home.refined_best.quality, rtol=1e-4)


@pytest.mark.parametrize(
    ("patch", "frozen", "expected"),
    [
        (patches.Point((0.03, 0.04, 0.0), (1, 0, 0)), {}, 0.05),
        (patches.Sphere(radius=0.02), {}, 0.02),
        (patches.Sphere(radius=0.02, origin=(0.03, 0.0, 0.04)), {}, 0.07),
        (patches.Sphere(radius=0.02, origin=(0.01, 0.0, 0.0)), {"u": np.pi, "v": 0.0}, 0.01),
        (patches.Cylinder(radius=0.03, v_interval=(-0.04, 0.01)), {}, 0.05),
        (patches.Cylinder(radius=0.03, v_interval=(-0.04, 0.01)), {"v": 0.0}, 0.03),
        (patches.Cylinder(radius=0.03), {}, 0.03),  # v has no bounds
        (patches.Ellipsoid(semi_axes=(0.01, 0.02, 0.03)), {}, 0.03),
    ],
    ids=str,
)
def test_the_largest_arm_of_known_patches(patch: patches.Patch, frozen: dict[str, float], expected: float) -> None:
    assert arm(patch, **frozen) == pytest.approx(expected, rel=1e-6)


def test_in_the_plane_height_does_not_count() -> None:
    patch = patches.Cylinder(radius=0.03, axis=(0, 0, 1), v_interval=(-0.4, 0.4))
    assert arm(patch, planar=True) == pytest.approx(0.03)
    assert arm(patch) == pytest.approx(np.hypot(0.03, 0.4))


def test_a_stated_length_is_used_and_kept(tmp_path: Path) -> None:
    text, _, folder = problem_text("three_finger_cup")
    problem = read_problem(text.replace("length_scale: 0.01", "length_scale: 0.01\ntorque_length: 0.02"), "c", folder)
    assert problem.torque_arm == 0.02
    x = ga.Grasps(problem, problem.x1_array)
    assert quality.ferrari_canny_epsilon(x)[0] == quality.ferrari_canny_epsilon(x, length_unit=0.02)[0]
    assert ga.Problem.from_dict(problem.to_dict()).torque_arm == 0.02
    result = ga.optimize(problem, radius=0.3)
    assert result.summary()["torque_length"] == 0.02
    result.save(tmp_path / "cup.npz")
    assert ga.load_result(tmp_path / "cup.npz").check().passed
    for wrong in (0.0, -1.0, np.nan, np.inf, "long"):
        with pytest.raises(ga.GraspAtlasError, match="torque_length"):
            replace(problem, torque_length=wrong)


def test_a_file_is_checked_with_the_length_that_it_was_made_with(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    result = ga.optimize(ga.load_problem("three_finger_cup"), radius=0.3)
    result.save(tmp_path / "cup.npz")
    monkeypatch.setattr("graspatlas.problem.problem.largest_arm", lambda *_: 1.0)  # another rule, some day
    again = ga.load_result(tmp_path / "cup.npz")
    assert again.problem.torque_arm == result.problem.torque_arm != 1.0
    assert again.check().passed
