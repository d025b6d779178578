"""Meshes of primitive shapes: closed, outwards, where they should be."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from numpy.typing import NDArray
from screens import volume

from graspatlas.viewer.scene import meshes

Array = NDArray[np.float64]


@pytest.mark.parametrize(
    ("mesh", "expected"),
    [
        (meshes.box([0.1, 0.2, 0.3]), 0.006),
        (meshes.ellipsoid([0.1, 0.2, 0.3]), 4.0 / 3.0 * np.pi * 0.006),
        (meshes.lathe([[0, -0.5], [0.2, -0.5], [0.2, 0.5], [0, 0.5]]), np.pi * 0.04),
        (meshes.capsule(0.1, 0.2), np.pi * 0.01 * (0.4 + 4.0 / 30.0)),
        (meshes.arrow(np.zeros(3), np.array([0.0, 0.6, 0.8]), 0.04, 0.001), None),
    ],
    ids=["box", "ellipsoid", "cylinder", "capsule", "arrow"],
)
def test_shapes_are_closed_and_face_outwards(mesh: meshes.Mesh, expected: float | None) -> None:
    assert volume(mesh) > 0.0
    if expected is not None:
        assert volume(mesh) == pytest.approx(expected, rel=0.02)
    assert_allclose(np.linalg.norm(mesh.normals, axis=1), 1.0, atol=1e-9)
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    flat = np.cross(b - a, c - a)
    assert (np.sum(flat[:, None] * mesh.normals[mesh.faces], axis=2) > 0.0).all()


def test_smooth_keeps_edges_sharp_and_rounds_the_rest() -> None:
    assert len(meshes.box([1.0, 1.0, 1.0]).vertices) == 24
    ball = meshes.ellipsoid([1.0, 1.0, 1.0])
    rounded = meshes.smooth(ball.vertices, ball.faces)
    assert_allclose(rounded.normals, rounded.vertices, atol=0.02)


def test_arrow_starts_and_ends_where_it_should() -> None:
    start, direction = np.array([0.1, 0.2, 0.3]), np.array([0.0, -1.0, 0.0])
    along = (meshes.arrow(start, direction, 0.04, 0.001).vertices - start) @ direction
    assert along.min() == pytest.approx(0.0, abs=1e-12)
    assert along.max() == pytest.approx(0.04)
