"""Soft fingers, which resist a torque about their normal: closed forms, and hard fingers as their limit."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import ConvexHull

import graspatlas as ga
from graspatlas import quality
from graspatlas.quality import wrenches
from graspatlas.requirements import parse_requirement, requirement_from_dict

FRICTION, TORSIONAL = 0.5, 0.005


@pytest.mark.slow
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
