"""Convex hulls, as SciPy's."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial import ConvexHull

import graspatlas as ga
from graspatlas.collision.hulls import hull_of


def cloud(kind: str) -> np.ndarray:
    rng = np.random.default_rng(4)
    if kind == "cube":  # of flat faces with points in them
        return np.concatenate(
            [rng.uniform(-1.0, 1.0, (200, 3)), np.array(np.meshgrid(*[[-1.0, 0.0, 1.0]] * 3)).T.reshape(-1, 3)]
        )
    if kind == "cone":  # whose apex has more neighbours than coal takes
        angle = np.linspace(0.0, 2.0 * np.pi, 400, endpoint=False)
        return np.vstack([np.column_stack([np.cos(angle), np.sin(angle), 0.0 * angle]), [0.0, 0.0, 1.0]])
    return rng.normal(size=(150, 3))


@pytest.mark.parametrize("kind", ["cloud", "cube", "cone"])
def test_hulls_are_those_of_qhull(kind: str) -> None:
    points = cloud(kind)
    hull, other = hull_of(points), ConvexHull(points)
    assert hull.corners.tolist() == sorted(other.vertices)
    assert hull.volume == pytest.approx(other.volume, rel=1e-12)
    assert hull.area == pytest.approx(other.area, rel=1e-12)
    heights = points @ hull.planes[:, :3].T + hull.planes[:, 3]
    assert_allclose(heights.max(axis=0), 0.0, atol=1e-12)
    assert_allclose(np.linalg.norm(hull.planes[:, :3], axis=1), 1.0)


def test_of_equal_points_the_first_is_the_corner() -> None:
    corners = np.vstack([np.zeros(3), np.eye(3)])
    assert hull_of(np.vstack([corners, corners])).corners.max() < 4


@pytest.mark.parametrize("points", [np.zeros((3, 3)), np.eye(3)[[0, 1, 2, 0, 1]], np.full((5, 3), np.nan)])
def test_points_without_a_hull_are_refused(points: np.ndarray) -> None:
    with pytest.raises(ga.GraspAtlasError, match=r"no convex hull|finite numbers"):
        hull_of(points)
