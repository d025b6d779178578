"""How far forces in friction cones are from balance, against a linear program."""

from __future__ import annotations

import numpy as np
from scipy.optimize import linprog

from graspatlas.proposals.assignments.closure import _edges, imbalance
from graspatlas.proposals.assignments.matching import BALANCED

ROUND = 2.0 * np.pi * np.arange(3) / 3.0
TRIPOD = np.stack([np.cos(ROUND), np.sin(ROUND), np.zeros(3)], axis=1)


def test_three_fingers_round_a_can_balance_and_three_on_one_side_do_not() -> None:
    beside = np.array([[0.0, 0.0, 0.0], [0.01, 0.0, 0.0], [0.0, 0.01, 0.0]])
    up = np.tile([0.0, 0.0, 1.0], (3, 1))
    around, pushed = imbalance(np.stack([0.03 * TRIPOD, beside]), np.stack([-TRIPOD, up]), 0.5)
    assert around < 0.05
    assert pushed > 0.8, "all forces point up"


def test_friction_decides_on_two_faces_that_are_not_parallel() -> None:
    points = np.array([[[0.03, 0.0, 0.0], [-0.03, 0.0, 0.0]]])
    tilt = np.radians(20.0)
    normals = np.array([[[-np.cos(tilt), np.sin(tilt), 0.0], [np.cos(tilt), np.sin(tilt), 0.0]]])
    assert imbalance(points, normals, np.tan(np.radians(30.0)))[0] < 0.02
    assert imbalance(points, normals, np.tan(np.radians(10.0)))[0] > 0.1


def test_it_is_zero_where_a_linear_program_finds_balance() -> None:
    rng = np.random.default_rng(1)
    points = rng.normal(size=(60, 3, 3))
    normals = rng.normal(size=(60, 3, 3))
    normals /= np.linalg.norm(normals, axis=2, keepdims=True)
    found = imbalance(points, normals, 0.8)
    wrenches = _edges(points, normals, 0.8)
    balanced = np.array([_balances(each) for each in wrenches])
    assert 3 < balanced.sum() < 57, "the sample has both kinds"
    # Its steps come near from above: what balances passes as such, and most of what does not is told apart.
    assert found[balanced].max() < BALANCED
    assert found[~balanced].min() > 0.0
    assert (found[~balanced] > BALANCED).mean() > 0.8


def _balances(wrenches: np.ndarray) -> bool:
    """Whether a convex combination of the wrenches is 0."""
    equal = np.vstack([wrenches.T, np.ones(len(wrenches))])
    return bool(linprog(np.zeros(len(wrenches)), A_eq=equal, b_eq=np.r_[np.zeros(6), 1.0]).status == 0)


def test_nothing_is_no_error() -> None:
    assert imbalance(np.zeros((0, 3, 3)), np.zeros((0, 3, 3)), 0.5).shape == (0,)
