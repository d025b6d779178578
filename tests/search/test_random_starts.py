"""Random starts: the object is moved to where fingertips reach it."""

from __future__ import annotations

import numpy as np
import pytest
from helpers import without_x1
from scipy.spatial.transform import Rotation

from graspatlas.search.random_starts import Starts, _best_motion

PROBLEMS = ("planar_hand", "schunk_can", "schunk_oil_bottle")


@pytest.mark.parametrize("d", [2, 3])
def test_best_motion_is_found_again(d):
    rng = np.random.default_rng(1)
    for n in (d, d + 4):  # d points leave a reflection open
        R = Rotation.random(random_state=rng).as_matrix() if d == 3 else np.array([[0.6, -0.8], [0.8, 0.6]])
        t, points = rng.normal(size=d), rng.normal(size=(n, d))
        found_R, found_t = _best_motion(points, points @ R.T + t)
        np.testing.assert_allclose(found_R, R, atol=1e-12)
        np.testing.assert_allclose(found_t, t, atol=1e-12)
        assert np.linalg.det(_best_motion(points, -points)[0]) == pytest.approx(1.0)


@pytest.mark.parametrize("name", PROBLEMS)
def test_starts_lie_within_the_limits_and_in_the_slice(name):
    problem, rng = without_x1(name), np.random.default_rng(2)
    system = problem.system(2)
    starts = Starts(problem, system)
    X = np.array([starts.draw(rng) for _ in range(300)])
    assert min(system.slack(x).min() for x in X) > -1e-9
    assert all(starts.has_posture_of(x) for x in X)
    if name != "planar_hand":  # whose joints have no limits, and turn more than once with the frozen motion
        assert np.abs(problem.frozen_residual(X, 2)).max() < 1e-9
    # The walk leaves the reference: it comes near a limit on every side that it can reach.
    nq = problem.hand.model.hand_q_size
    assert (np.ptp(X[:, :nq], axis=0) > 0.1).sum() >= 5
