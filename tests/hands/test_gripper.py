"""A parallel gripper with soft pads and a skittle: from end to end."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from helpers import assert_complete_and_holding, assert_meshes_are_made_again

import graspatlas as ga


def test_the_atlas_is_complete_and_the_best_grasp_holds(gripper):
    assert_complete_and_holding(gripper)


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


def test_where_the_gripper_may_hold_the_skittle_otherwise(gripper):
    """The head is another component: no path leads there without letting go."""
    problem = gripper.problem
    found = ga.find_grasps(replace(problem, x1=None), count=30)
    widths = found[:, 0]
    assert (np.abs(widths - 0.0107) < 5e-4).any()
    assert (np.abs(widths - 0.0191) < 5e-4).any()


def test_the_meshes_are_those_of_the_script_and_of_the_patch(gripper, tmp_path):
    assert_meshes_are_made_again("parallel_gripper", gripper.problem.contacts[0].object, tmp_path)
