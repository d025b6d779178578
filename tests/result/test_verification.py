"""`check_result` passes on what is right and fails on each thing that is made wrong."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from helpers import changed

import graspatlas as ga
from graspatlas.atlas import Closed
from graspatlas.cli import main
from graspatlas.result.verification import check_result


def test_a_right_result_passes(small_result):
    report = small_result.check()
    assert report.passed, str(report)
    assert len(report.checks) > 12


def test_a_wrong_result_fails(small_result):
    result = small_result
    best = result.best.chart
    q = changed(result.qualities, best, 1.001 * result.qualities[best])
    assert not replace(result, qualities=q).check().passed
    atlas = result.atlas
    moved = changed(atlas.centers, 3, atlas.centers[3] + 1e-6 * np.eye(atlas.centers.shape[1])[0])
    assert not replace(result, atlas=replace(atlas, centers=moved)).check().passed
    for reason in (Closed.CURVATURE, Closed.NOT_CONVERGED):
        closed = changed(atlas.vertex_closed, 0, reason.value)
        assert not replace(result, atlas=replace(atlas, vertex_closed=closed)).check().passed
    exchanged = changed(atlas.centers, [2, 5], atlas.centers[[5, 2]])
    assert not replace(result, atlas=replace(atlas, centers=exchanged)).check().passed


def test_grasps_that_leave_the_hand_motions_fail(bottle, small_result):
    """A grasp with right contacts that breaks eq (13) is found: centres of an atlas with other hand motions."""
    other = replace(bottle, motions=replace(bottle.motions, covariance=bottle.motions.covariance[::-1, ::-1]))
    atlas = ga.build_atlas(other.system(2), other.x1_array, radius=0.2, epsilon=0.5, max_charts=30)
    n = atlas.n_charts
    report = check_result(replace(small_result, atlas=atlas, qualities=np.zeros(n), accepted=np.ones(n, bool)))
    failed = [check.claim for check in report.checks if not check.passed]
    assert any("hand motions" in claim for claim in failed)


def test_check_result_on_the_command_line(bottle_result, tmp_path, capsys):
    bottle_result.save(tmp_path / "result.npz")
    assert main(["check-result", str(tmp_path)]) == 0
    assert "FAIL" not in capsys.readouterr().out
    moved = bottle_result.atlas.centers.copy()
    moved[7, 0] += 1e-6
    replace(bottle_result, atlas=replace(bottle_result.atlas, centers=moved)).save(tmp_path / "result.npz")
    assert main(["check-result", str(tmp_path)]) == 1
    assert "FAIL  largest residual" in capsys.readouterr().out
    assert main(["check-result", str(tmp_path / "nothing")]) == 2
