"""The velocity ellipsoid: it holds all velocities, and is flat where motions are lost."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from numpy.typing import NDArray

import graspatlas as ga
from graspatlas.viewer.scene import velocity_ellipsoid as ellipsoid

Array = NDArray[np.float64]


def test_ellipsoid_holds_all_velocities_and_is_touched(result: ga.Result) -> None:
    random = np.random.default_rng(0)
    for grasp in (result.best, result.worst, result.at_x1):
        axes, semi_axes = ellipsoid.velocity_ellipsoid(grasp)
        assert np.linalg.det(axes) == pytest.approx(1.0)
        twists, joints = ellipsoid.coordinated_motions(grasp)
        # Coordinated: the contact points of the fingers move with those of the object.
        assert_allclose(grasp.J @ joints, grasp.G.T @ twists, atol=1e-6 * np.abs(twists).max())
        z = random.normal(size=(twists.shape[1], 20000))
        z /= np.linalg.norm(z, axis=0)
        assert_allclose(np.linalg.norm(joints @ z, axis=0), 1.0)
        reach = np.linalg.norm((axes.T @ (twists @ z)[:3]) / semi_axes[:, None], axis=0)
        assert reach.max() <= 1.0 + 1e-6
        for axis, length in zip(axes.T, semi_axes, strict=True):
            furthest = axis @ twists[:3]
            assert np.linalg.norm(furthest) == pytest.approx(length, rel=1e-6)


def test_ellipsoid_agrees_with_the_formula_of_full_rank(result: ga.Result) -> None:
    grasp = result.at_x1
    M = grasp.G @ np.linalg.inv(grasp.J @ grasp.J.T) @ grasp.G.T
    expected = np.sqrt(np.linalg.eigvalsh(np.linalg.inv(M)[:3, :3]))[::-1]
    assert_allclose(ellipsoid.velocity_ellipsoid(grasp)[1], expected, rtol=1e-5)


def test_ellipsoid_agrees_with_the_semi_axes_of_the_index(result: ga.Result) -> None:
    grasp = result.at_x1
    twists = ellipsoid.coordinated_motions(grasp)[0]
    twists[:3] *= 1000.0
    lengths = np.linalg.svd(twists, compute_uv=False)
    assert_allclose(np.sort(lengths), grasp.semi_axes, rtol=1e-5)


@pytest.mark.parametrize("loss", ["no joints", "one contact", "locked finger", "one joint"])
def test_ellipsoid_of_a_deficient_grasp_is_finite(can_result: ga.Result, loss: str) -> None:
    grasp = can_result.best
    J, G = grasp.J.copy(), grasp.G
    if loss == "no joints":
        J[:] = 0.0
    elif loss == "one contact":
        J, G = J[:3], G[:, :3]
    elif loss == "locked finger":
        J[:3] = 0.0
    else:
        J = J[:, :1]
    axes, semi_axes = ellipsoid.velocity_ellipsoid(replace(grasp, J=J, G=G))
    assert np.isfinite(axes).all()
    assert np.isfinite(semi_axes).all()
    assert (semi_axes >= 0.0).all()
    if loss == "no joints":
        assert not semi_axes.any()
