"""Principal hand motions against NumPy."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from graspatlas import GraspAtlasError, HandMotions

JOINTS = ("a", "b", "c", "d", "e")


def samples(seed: int, z: int = 40, h: int = 5) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return rng.normal(size=(z, h)) @ rng.normal(size=(h, h)) + rng.normal(size=h)


seeds = st.integers(0, 10**6)


@given(seeds)
def test_from_samples(seed):
    X = samples(seed)
    motions = HandMotions.from_samples(X, JOINTS)
    np.testing.assert_allclose(motions.mean, X.mean(axis=0), atol=1e-12)
    np.testing.assert_allclose(motions.covariance, np.cov(X.T), atol=1e-12)
    assert motions.joints == JOINTS


@given(seeds)
def test_principal_components(seed):
    X = samples(seed)
    motions = HandMotions.from_samples(X, JOINTS)
    _, s, Vt = np.linalg.svd(X - X.mean(axis=0))
    np.testing.assert_allclose(motions.variances, s**2 / (len(X) - 1), rtol=1e-9, atol=1e-12)
    assert (np.diff(motions.variances) <= 0.0).all()
    E = motions.E
    np.testing.assert_allclose(E.T @ E, np.eye(5), atol=1e-12)
    np.testing.assert_allclose(np.abs(np.sum(E * Vt.T, axis=0)), 1.0, atol=1e-6)
    np.testing.assert_allclose(E @ np.diag(motions.variances) @ E.T, motions.covariance, atol=1e-9)
    assert (E[np.abs(E).argmax(axis=0), np.arange(5)] > 0.0).all()


@given(seeds, st.integers(0, 5))
def test_kept_and_frozen_split_the_motions(seed, s):
    motions = HandMotions.from_samples(samples(seed), JOINTS)
    kept, frozen = motions.kept(s), motions.frozen(s)
    assert kept.shape == (5, 5 - s)
    assert frozen.shape == (5, s)
    np.testing.assert_array_equal(np.hstack([kept, frozen]), motions.E)
    np.testing.assert_allclose(kept.T @ frozen, 0.0, atol=1e-12)
    share = motions.variances[: 5 - s].sum() / motions.variances.sum()
    assert motions.variance_kept(s) == pytest.approx(share)


@given(seeds, st.permutations(JOINTS))
def test_reordered_joints(seed, order):
    X = samples(seed)
    motions = HandMotions.from_samples(X, JOINTS)
    at = [JOINTS.index(name) for name in order]
    again, expected = motions.reordered(order), HandMotions.from_samples(X[:, at], order)
    assert again.joints == tuple(order)
    np.testing.assert_array_equal(again.mean, motions.mean[at])
    np.testing.assert_allclose(again.covariance, expected.covariance, atol=1e-12)
    np.testing.assert_allclose(again.variances, motions.variances, atol=1e-9)
    s = 2
    before, after = motions.frozen(s)[at], again.frozen(s)
    np.testing.assert_allclose(before @ before.T, after @ after.T, atol=1e-6)


@pytest.mark.parametrize("s", [-1, 6])
def test_more_motions_than_there_are_cannot_be_frozen(s):
    motions = HandMotions.from_samples(samples(0), JOINTS)
    for method in (motions.kept, motions.frozen, motions.variance_kept):
        with pytest.raises(GraspAtlasError, match="motions"):
            method(s)


def test_motions_of_the_hand(can):
    motions = can.motions
    assert len(motions.joints) == 13
    assert motions.variance_kept(0) == 1.0
    assert motions.variance_kept(6) == pytest.approx(0.9970866482, abs=1e-9)
    assert motions.variance_kept(7) == pytest.approx(0.9904247117, abs=1e-9)
    assert (motions.variances > 1e-8).sum() == 9
    np.testing.assert_allclose(motions.variances[9:], 0.0, atol=1e-8)


def test_nothing_varies():
    motions = HandMotions(("a", "b"), [0.0, 0.0], np.zeros((2, 2)))
    assert motions.variance_kept(1) == 1.0
    np.testing.assert_allclose(motions.E.T @ motions.E, np.eye(2))


def test_round_trip_of_plain_data():
    motions = HandMotions.from_samples(samples(3), JOINTS)
    again = HandMotions.from_dict(json.loads(json.dumps(motions.to_dict())))
    assert again.joints == motions.joints
    assert again.mean.tobytes() == motions.mean.tobytes()
    assert again.covariance.tobytes() == motions.covariance.tobytes()
    assert again.E.tobytes() == motions.E.tobytes()


WRONG = {
    "mean of another size": (("a", "b"), [0.0], np.eye(2)),
    "covariance of another size": (("a", "b"), [0.0, 0.0], np.eye(3)),
    "covariance flat": (("a", "b"), [0.0, 0.0], [1.0, 0.0]),
    "NaN in the mean": (("a", "b"), [0.0, np.nan], np.eye(2)),
    "NaN in the covariance": (("a", "b"), [0.0, 0.0], [[1.0, np.nan], [np.nan, 1.0]]),
    "infinite": (("a", "b"), [0.0, np.inf], np.eye(2)),
    "not symmetric": (("a", "b"), [0.0, 0.0], [[1.0, 0.5], [0.0, 1.0]]),
    "twice the same joint": (("a", "a"), [0.0, 0.0], np.eye(2)),
    "text": (("a", "b"), ["x", "y"], np.eye(2)),
}


@pytest.mark.parametrize("name", WRONG)
def test_wrong_motions_are_refused(name):
    with pytest.raises(GraspAtlasError):
        HandMotions(*WRONG[name])


@pytest.mark.parametrize(
    "wrong",
    [np.zeros((1, 5)), np.zeros((0, 5)), np.zeros(5), np.zeros((4, 4)), np.full((4, 5), np.nan), [["x"] * 5] * 3],
    ids=["one row", "no row", "flat", "four columns", "NaN", "text"],
)
def test_wrong_samples_are_refused(wrong):
    with pytest.raises(GraspAtlasError):
        HandMotions.from_samples(wrong, JOINTS)


def test_wrong_plain_data_and_wrong_orders_are_refused():
    with pytest.raises(GraspAtlasError, match="covariance"):
        HandMotions.from_dict({"joints": ["a"], "mean": [0.0]})
    with pytest.raises(GraspAtlasError):
        HandMotions.from_dict({"joints": 3, "mean": [0.0], "covariance": [[1.0]]})
    motions = HandMotions.from_samples(samples(0), JOINTS)
    with pytest.raises(GraspAtlasError, match="'x'"):
        motions.reordered(("a", "b", "c", "d", "x"))


def test_a_problem_without_motions_has_one_dimension_only(can):
    free = replace(can, motions=None)
    assert free.frozen_motions(8) == 0
    assert free.system(8).dimension == 8
    with pytest.raises(GraspAtlasError, match="dimension=8"):
        free.system(2)


def test_motions_of_other_joints_are_refused(can):
    names = ("little_dip", *can.motions.joints[1:])
    with pytest.raises(GraspAtlasError, match=r"little_dip|middle_abduction"):
        replace(can, motions=HandMotions(names, can.motions.mean, can.motions.covariance))


def test_the_order_of_the_joints_in_the_motions_does_not_matter(can):
    other = replace(can, motions=can.motions.reordered(can.motions.joints[::-1]))
    x = can.x1_array
    ours, theirs = can.system(2), other.system(2)
    J, K = ours.evaluate_jacobian(x), theirs.evaluate_jacobian(x)
    np.testing.assert_allclose(np.linalg.svd(J)[1], np.linalg.svd(K)[1], rtol=1e-6)
