"""Atlases of the can and of the oil bottle: complete, right, and as large as an independent implementation's."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import cKDTree

import graspatlas as ga

# problem, k, radius, charts of an independent implementation of the same method in the same metric
COUNTS = [
    ("schunk_can", 2, 0.25, 2238),
    ("schunk_can", 2, 0.2, 3479),
    ("schunk_can", 2, 0.17, 4800),
    ("schunk_oil_bottle", 2, 0.1, 259),
    ("schunk_oil_bottle", 2, 0.06, 681),
    ("schunk_oil_bottle", 2, 0.04, 1508),
    ("schunk_oil_bottle", 3, 0.2, 2645),
    ("schunk_oil_bottle", 3, 0.1, 18952),
]
# k, radius, largest manipulability volume at a chart centre of that implementation [mm^3]
LARGEST = {(2, 0.04): 12192.0, (3, 0.1): 15465.0}


@pytest.mark.parametrize(("name", "k", "radius", "charts"), COUNTS)
def test_number_of_charts(name, k, radius, charts):
    problem = ga.load_problem(name)
    result = ga.optimize(problem, dimension=k, radius=radius, epsilon=0.5, quality="manipulability_volume", require=[])
    atlas = result.atlas
    assert result.status is ga.Status.COMPLETE
    assert result.is_global
    assert atlas.n_charts == pytest.approx(charts, rel=0.1)
    assert atlas.dimension == result.dimension == k
    residuals = [np.abs(atlas.system.evaluate_residual(x)).max() for x in atlas.centers[::5]]
    assert max(residuals) < 1e-9
    assert atlas.residuals.max() < 1e-9
    if (k, radius) in LARGEST and name == "schunk_oil_bottle":
        assert result.best.quality == pytest.approx(LARGEST[k, radius], rel=0.03)


@pytest.mark.parametrize("fixture", ["can_result", "bottle_result", "small_result"])
def test_result_passes_its_own_check(fixture, request):
    report = request.getfixturevalue(fixture).check()
    assert report.passed, str(report)


def test_the_best_grasp_is_the_best(can_result):
    result = can_result
    assert result.best.quality == result.qualities.max() == result.qualities[result.best.chart]
    assert result.worst.quality == result.qualities.min()
    assert result.at_x1.quality == result.qualities[0]
    assert result.at_x1.chart == 0
    np.testing.assert_array_equal(result.best.x, result.atlas.centers[result.best.chart])
    np.testing.assert_allclose(result.atlas.centers[0], result.problem.x1_array, atol=1e-5)


def test_centres_are_inside_the_bounds(can_result, bottle_result):
    for result in (can_result, bottle_result):
        slack = np.array([result.atlas.system.slack(x) for x in result.atlas.centers])
        assert slack.min() > -1e-9
        lower, upper = result.problem.hand.joint_limits
        q = result.atlas.centers[:, :13]
        assert (q >= lower - 1e-9).all()
        assert (q <= upper + 1e-9).all()


def test_no_grasp_is_in_two_charts(can_result):
    """Neither a quaternion's sign nor a whole turn of an angle gives two names to a grasp."""
    atlas = can_result.atlas
    images = np.array([atlas.system.embed(x) for x in atlas.centers])
    gaps = cKDTree(images).query(images, k=2)[0][:, 1]
    assert gaps.min() > 0.02 * atlas.radius
    angles = atlas.centers[:, [20, 22]]
    assert angles.min() >= -np.pi
    assert angles.max() < np.pi


def test_more_dimensions_find_better_grasps(bottle_result):
    wider = ga.optimize(bottle_result.problem, dimension=3, radius=0.2, epsilon=0.5, require=[])
    assert wider.best.quality > bottle_result.best.quality
    line = ga.optimize(bottle_result.problem, dimension=1, radius=0.02, epsilon=0.5, require=[])
    assert line.atlas.n_charts > 10
    assert line.atlas.status is ga.Status.COMPLETE
    assert line.check().passed
    assert line.best.quality <= bottle_result.best.quality * 1.01


def test_radius_hardly_changes_the_covered_volume(bottle, bottle_result):
    coarse = ga.optimize(bottle, dimension=2, radius=0.1, epsilon=0.5, require=[])
    assert coarse.atlas.volumes.sum() == pytest.approx(bottle_result.atlas.volumes.sum(), rel=0.05)
    assert coarse.best.quality == pytest.approx(bottle_result.best.quality, rel=0.02)


def test_results_are_the_same_to_the_bit(can, can_result):
    again = ga.optimize(can, dimension=2, radius=0.17, epsilon=0.5, quality="manipulability_volume", require=[])
    for name, array in can_result.atlas.to_arrays().items():
        assert array.tobytes() == again.atlas.to_arrays()[name].tobytes(), name
    assert again.qualities.tobytes() == can_result.qualities.tobytes()


@pytest.mark.parametrize("name", ["schunk_can", "schunk_oil_bottle"])
@pytest.mark.parametrize("radius", [1.6, 10.0, 1e6])
def test_a_radius_beyond_the_manifold_is_refused(name, radius):
    with pytest.raises(ga.GraspAtlasError, match=r"radius must be below 1\.57"):
        ga.optimize(ga.load_problem(name), dimension=2, radius=radius, epsilon=0.5, max_seconds=1.0, require=[])


@pytest.mark.parametrize(
    ("fine", "radius"), [("can_result", 0.5), ("can_result", 1.0), ("can_result", 1.5), ("bottle_result", 1.5)]
)
def test_charts_as_large_as_the_manifold_are_called_global_only_where_they_cover_it(fine, radius, request):
    """Two charts do, of the bottle; a hundred of the can do not, and it is the fine atlas that tells."""
    fine = request.getfixturevalue(fine)
    result = ga.optimize(fine.problem, dimension=2, radius=radius, epsilon=0.5, require=[])
    found = [result.atlas.locate(x) for x in fine.atlas.centers[::7]]
    covered = all(chart >= 0 and distance <= 0.5 * radius for chart, distance in found)
    assert covered or not result.is_global
    if radius == 0.5 or fine.problem.name == "schunk_oil_bottle":
        assert result.atlas.complete
