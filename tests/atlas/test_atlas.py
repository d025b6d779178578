"""Points and grasps that are looked up in an atlas."""

from __future__ import annotations

import numpy as np
import pytest
from helpers import Written

import graspatlas as ga

PROBLEMS = ("planar_hand", "schunk_can", "schunk_oil_bottle")


def test_locate_refuses_a_point_off_the_manifold(sphere):
    with pytest.raises(ga.GraspAtlasError, match=r"entry of 0\.\d+,.*graspatlas.project"):
        sphere.locate([0.0, 0.0, 1.1])
    assert sphere.locate(ga.project(sphere.system, [0.0, 0.0, 1.1]))[1] == 0.0


def test_locate_tells_near_sheets_apart():
    """Two planes nearer to each other than epsilon and than a chart is wide."""
    h = 0.1
    sheets = Written(3, 1, lambda x: np.array([x[2] ** 2 - h**2]), lambda x: np.array([[0.0, 0.0, 2.0 * x[2]]]))
    atlas = ga.build_atlas(sheets, [0.0, 0.0, h], radius=0.2, epsilon=0.5, max_charts=60)
    assert atlas.locate([0.05, 0.02, h])[1] == 0.0
    assert atlas.locate([0.05, 0.02, -h]) == (-1, np.inf)


def test_locate_does_not_overlook_frozen_motions(can, can_result):
    """A feasible grasp that has the kept motions and the object of a chart, and other frozen ones, is not covered."""
    x = can_result.atlas.centers[100]
    J = can.full_system.evaluate_jacobian(x)
    frozen = can.motions.reordered(can.hand.joints).frozen(6)
    tangents = np.linalg.svd(J)[2][len(J) :]
    # The feasible direction that is most along the frozen motions.
    along = np.linalg.svd(tangents[:, :13] @ frozen, full_matrices=False)[0][:, 0] @ tangents
    moved = ga.project(can.full_system, can.full_system.integrate(x, 0.1 * along))
    assert np.abs(can.frozen_residual(moved, 2)).max() > 0.02
    assert can_result.atlas.locate(x)[1] == 0.0
    assert can_result.atlas.locate(moved) == (-1, np.inf)
