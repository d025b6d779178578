"""Three fingers moved by four motors, with a cup: from end to end."""

from __future__ import annotations

import numpy as np
import pytest
from helpers import assert_complete_and_holding, assert_meshes_are_made_again

import graspatlas as ga


@pytest.fixture(scope="module")
def hand() -> ga.Result:
    return ga.optimize(ga.load_problem("three_finger_cup"), refine="feasible")


def test_the_atlas_is_complete_and_the_best_grasp_holds(hand):
    assert_complete_and_holding(hand)


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


def test_the_meshes_are_those_of_the_script_and_of_the_patch(hand, tmp_path):
    assert_meshes_are_made_again("three_finger_hand", hand.problem.contacts[0].object, tmp_path)
