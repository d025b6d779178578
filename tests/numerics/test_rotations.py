"""Rotations as those of SciPy."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from graspatlas.numerics.rotations import (
    matrix_from_rotvec,
    matrix_from_rpy,
    quaternions_from_matrices,
    rpy_from_matrix,
)


def test_quaternions() -> None:
    turns = Rotation.random(500, rng=3)
    half_turns = Rotation.from_rotvec(np.pi * np.eye(3))
    R = np.concatenate([turns.as_matrix(), half_turns.as_matrix(), np.eye(3)[None]])
    assert_allclose(quaternions_from_matrices(R), Rotation.from_matrix(R).as_quat(), atol=1e-14)
    assert quaternions_from_matrices(np.zeros((0, 3, 3))).shape == (0, 4)


def test_roll_pitch_yaw() -> None:
    rng = np.random.default_rng(1)
    for rpy in [*rng.uniform(-3.0, 3.0, (100, 3)), np.zeros(3)]:
        R = matrix_from_rpy(rpy)
        assert_allclose(R, Rotation.from_euler("xyz", rpy).as_matrix(), atol=1e-14)
        assert_allclose(matrix_from_rpy(rpy_from_matrix(R)), R, atol=1e-14)


@pytest.mark.parametrize("pitch", [np.pi / 2.0, -np.pi / 2.0])
def test_roll_and_yaw_about_one_axis(pitch: float) -> None:
    R = matrix_from_rpy([0.3, pitch, -0.9])
    found = rpy_from_matrix(R)
    assert found[2] == 0.0
    assert_allclose(matrix_from_rpy(found), R, atol=1e-7)


@pytest.mark.parametrize("angle", [0.0, 1e-12, 1e-3, 1.0, 3.0, 10.0])
def test_rotation_vectors(angle: float) -> None:
    vector = angle * np.array([0.6, 0.0, -0.8])
    assert_allclose(matrix_from_rotvec(vector), Rotation.from_rotvec(vector).as_matrix(), atol=1e-14)
