"""The bundled hands with mimic joints: a parallel gripper with soft pads, and three fingers moved by four motors."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from helpers import load_script
from scipy.spatial import ConvexHull

import graspatlas as ga
from graspatlas import quality
from graspatlas.quality import wrenches
from graspatlas.requirements import parse_requirement, requirement_from_dict

FRICTION, TORSIONAL = 0.5, 0.005


@pytest.fixture(scope="module")
def gripper() -> ga.Result:
    return ga.optimize(ga.load_problem("gripper_skittle"), refine=True)


@pytest.fixture(scope="module")
def hand() -> ga.Result:
    return ga.optimize(ga.load_problem("three_finger_cup"), refine="feasible")


@pytest.mark.parametrize("name", ["gripper", "hand"])
def test_the_atlas_is_complete_and_the_best_grasp_holds(name, request):
    result = request.getfixturevalue(name)
    assert result.atlas.complete
    assert result.dimension == 2
    report = result.check()
    assert report, report
    assert {type(r) for r in result.requirements} == {ga.ForceClosure, ga.CollisionFree}
    assert 0.02 < result.accepted.mean() < 0.98
    best = result.refined_best
    assert best.quality >= result.best.quality > 1.5 * result.worst.quality
    assert result.best.quality > 1.2 * result.qualities[0]  # x1 is not the answer


def test_the_jaws_move_as_one(gripper):
    assert gripper.problem.full_dimension == 2
    assert gripper.problem.hand.mechanism.actuated == ("left_slide",)
    q = gripper.atlas.centers[:, :2]
    assert np.abs(q[:, 0] - q[:, 1]).max() < 1e-9
    assert np.ptp(q[:, 0]) > 3e-4
    # The best grasp is square across the belly, the thickest place.
    best = gripper.refined_best
    assert best.joint_positions["left_slide"] == pytest.approx(0.0191, abs=5e-5)
    across = best.contact_points[0] - best.contact_points[1]
    assert abs(across @ best.contact_normals[0]) > np.cos(1e-3) * np.linalg.norm(across)


def test_the_fingers_bend_and_spread_by_their_mimics(hand):
    problem = hand.problem
    assert problem.full_dimension == 3
    assert problem.hand.mechanism.actuated == ("left_spread", "left_proximal", "right_proximal", "thumb_proximal")
    X = np.vstack([hand.atlas.centers, hand.refinement.x])
    q = {name: X[:, i] for i, name in enumerate(problem.hand.joints)}
    assert np.abs(q["right_spread"] + q["left_spread"]).max() < 1e-9
    for finger in ("thumb", "left", "right"):
        assert np.abs(q[f"{finger}_distal"] - 0.6 * q[f"{finger}_proximal"] - 1.2).max() < 1e-9
    assert np.ptp(q["left_spread"]) > 0.5
    lead = q["thumb_proximal"] - 0.5 * (q["left_proximal"] + q["right_proximal"])
    assert np.abs(lead[: hand.atlas.n_charts] - lead[0]).max() < 1e-9  # the coupling of the problem file


def test_two_hard_fingers_never_close_a_grasp(gripper):
    hard = quality.force_closure_margin(ga.Grasps(gripper.problem, gripper.atlas.centers, gripper.atlas.system))
    assert (hard == 0.0).all()
    assert (quality.ferrari_canny_epsilon(ga.Grasps(gripper.problem, gripper.best.x)) == 0.0).all()


def test_the_margin_of_two_soft_fingers_is_that_of_the_line_between_them(gripper):
    """Both forces lie on that line, each with half the normal force, and no torque is needed about it."""
    grasps = ga.Grasps(gripper.problem, gripper.atlas.centers[::50], gripper.atlas.system)
    across = grasps.contact_points[:, 1] - grasps.contact_points[:, 0]
    along = -np.einsum("nc,nc->n", across, grasps.contact_normals[:, 0])
    tangent = np.sqrt(np.maximum((across**2).sum(axis=1) - along**2, 0.0)) / along
    for friction in (0.2, FRICTION):
        expected = 0.5 * (friction - tangent) / np.sqrt(1.0 + friction**2)
        assert (expected < 0.0).any() == (friction == 0.2)
        for torsional in (0.001, TORSIONAL):
            margins = quality.force_closure_margin(grasps, friction, torsional)
            np.testing.assert_allclose(margins, np.maximum(expected, 0.0), atol=1e-8)
            slacks = quality.force_closure_slack(grasps, friction, torsional)
            np.testing.assert_allclose(slacks, expected, atol=1e-8)


def test_soft_fingers_hold_at_least_as_well_as_hard_ones(can):
    grasps = ga.Grasps(can, ga.find_grasps(can, count=12))
    hard, soft, softer = (quality.force_closure_slack(grasps, 0.8, torsional) for torsional in (0.0, 0.002, 0.02))
    assert (soft >= hard - 1e-9).all()
    assert (softer >= soft - 1e-9).all()
    assert (softer > hard + 1e-3).any()
    tiny = quality.force_closure_slack(grasps, 0.8, 1e-9)
    np.testing.assert_allclose(tiny, hard, atol=1e-5)


def test_the_soft_finger_epsilon_by_a_second_route(gripper):
    grasps = ga.Grasps(gripper.problem, gripper.atlas.centers[::300], gripper.atlas.system)
    length, expected = 0.02, []
    for grasp in grasps:
        R, origin = grasp.T_palm_object[:3, :3], grasp.object_xyz
        points = []
        for p, outward in zip((grasp.contact_points - origin) @ R, grasp.contact_normals @ R, strict=True):
            (axes,) = wrenches.contact_axes(p[None, None], outward[None, None], length)[0]
            angles = 2.0 * np.pi * np.arange(8) / 8
            points += [axes[0] + FRICTION * (np.cos(a) * axes[1] + np.sin(a) * axes[2]) for a in angles]
            points += [axes[0] + np.r_[0, 0, 0, -side * TORSIONAL / length * outward] for side in (1, -1)]
        expected.append(max(0.0, -ConvexHull(np.array(points)).equations[:, -1].max()))
    assert max(expected) > 0.1
    np.testing.assert_allclose(
        quality.soft_finger_epsilon(grasps, FRICTION, TORSIONAL, length), expected, rtol=1e-7, atol=1e-9
    )
    wider = quality.soft_finger_epsilon(grasps, FRICTION, 2 * TORSIONAL, length)
    assert (wider > np.array(expected) + 1e-6).any()


def test_soft_fingers_do_not_matter_in_the_plane():
    problem = ga.load_problem("planar_hand")
    grasps = ga.Grasps(problem, problem.x1_array)
    assert quality.force_closure_margin(grasps, 0.5, 0.01) == quality.force_closure_margin(grasps, 0.5)
    assert quality.soft_finger_epsilon(grasps) == quality.ferrari_canny_epsilon(grasps)


def test_the_requirement_with_soft_fingers_as_text_and_data():
    hard, soft = ga.ForceClosure(0.5, 0.02), ga.ForceClosure(0.5, 0.02, TORSIONAL)
    assert (str(hard), str(soft)) == ("force_closure:0.5:0.02", "force_closure:0.5:0.02:0.005")
    for requirement in (hard, soft):
        assert parse_requirement(str(requirement)) == requirement
        assert requirement_from_dict(requirement.to_dict()) == requirement
    for wrong in (-0.001, float("nan"), "a"):
        with pytest.raises(ga.GraspAtlasError, match="torsional"):
            ga.ForceClosure(torsional=wrong)


@pytest.mark.parametrize("torsional", [-1.0, float("inf"), float("nan")])
@pytest.mark.parametrize("index", [quality.force_closure_margin, quality.soft_finger_epsilon])
def test_torsional_friction_that_makes_no_sense(index, torsional, gripper):
    with pytest.raises(ga.GraspAtlasError, match="torsional"):
        index(ga.Grasps(gripper.problem, gripper.best.x), torsional=torsional)


def test_where_the_gripper_may_hold_the_skittle_otherwise(gripper):
    """The head is another component: no path leads there without letting go."""
    problem = gripper.problem
    found = ga.find_grasps(replace(problem, x1=None), count=30)
    widths = found[:, 0]
    assert (np.abs(widths - 0.0107) < 5e-4).any()
    assert (np.abs(widths - 0.0191) < 5e-4).any()


@pytest.mark.parametrize(
    ("folder", "problem"), [("parallel_gripper", "gripper_skittle"), ("three_finger_hand", "three_finger_cup")]
)
def test_the_meshes_are_those_of_the_scripts_and_of_the_patches(folder, problem, tmp_path):
    script = load_script(folder)
    patch = ga.load_problem(problem).contacts[0].object
    np.testing.assert_allclose((patch.heights, patch.radii), (script.HEIGHTS, script.RADII), atol=1e-12)
    kept = script.FOLDER
    script.FOLDER = tmp_path
    script.main()
    for path in tmp_path.iterdir():
        assert path.read_text() == (kept / path.name).read_text(), path.name
    assert len(list(tmp_path.iterdir())) == len(list(kept.glob("*.obj")))
