"""Points that are projected onto a manifold from afar."""

from __future__ import annotations

import numpy as np
import pytest
from helpers import PythonSphere, Written

import graspatlas as ga

PROBLEMS = ("planar_hand", "schunk_can", "schunk_oil_bottle")


def test_projection_from_afar():
    rng = np.random.default_rng(0)
    sphere = ga.systems.Sphere(4)
    for _ in range(20):
        x = ga.project(sphere, 5.0 * rng.normal(size=4))
        assert np.linalg.norm(x) == pytest.approx(1.0, abs=1e-8)


def test_projection_ends_within_the_bounds():
    """The nearest point of the sphere is outside; so is every point but those of a cap."""
    cap = PythonSphere(3, lower=[-np.inf, -np.inf, 0.9])
    x = ga.project(cap, [2.0, 1.0, -0.5])
    assert np.linalg.norm(x) == pytest.approx(1.0, abs=1e-8)
    assert x[2] > 0.9


@pytest.mark.parametrize(
    "system",
    [
        Written(2, 1, lambda x: np.array([x @ x + 1.0]), lambda x: 2.0 * x[None]),
        Written(2, 1, lambda x: np.array([np.nan]), lambda x: np.ones((1, 2))),
        PythonSphere(2, lower=[1.5, -np.inf]),
    ],
    ids=["no solution", "NaN", "none within the bounds"],
)
def test_projection_gives_up(system):
    assert ga.project(system, [0.3, 0.4]) is None


@pytest.mark.parametrize(
    ("x", "words"),
    [([1.0, 2.0], "3 numbers"), ([[1.0, 2.0, 3.0]], "3 numbers"), ([1.0, np.nan, 0.0], "finite"), ("here", "numbers")],
)
def test_points_are_checked(sphere, x, words):
    with pytest.raises(ga.GraspAtlasError, match=words):
        ga.project(sphere.system, x)
    with pytest.raises(ga.GraspAtlasError, match=words):
        sphere.locate(x)
