"""The gap: which charts could hold a better grasp than the best, and how rarely the estimate is wrong."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import graspatlas as ga
from graspatlas.analysis.densify import densify
from graspatlas.cli import main
from graspatlas.commands.shared.report import result_lines
from graspatlas.result.gap import Gap, estimate_gap

HOLDS = (ga.ForceClosure(0.5, 0.02), ga.CollisionFree())
#: Problems with the indices and the radius at which the estimate is measured; the paper's three among them.
MEASURED = [
    ("planar_hand", "manipulability_volume", 0.125),
    ("schunk_can", "smallest_semi_axis", 0.3),
    ("schunk_can", "force_closure_margin", 0.3),
    *(
        pytest.param(*case, marks=pytest.mark.slow)
        for case in (
            ("schunk_oil_bottle", "manipulability_volume", 0.06),
            ("allegro_cylinder_4", "ferrari_canny_epsilon", 0.3),
            ("three_finger_cup", "grasp_isotropy", 0.25),
        )
    ),
]


@pytest.fixture(scope="module")
def can() -> ga.Result:
    """The can with requirements, refined."""
    return ga.optimize(ga.load_problem("schunk_can"), radius=0.25, require=HOLDS, refine=True, progress=False)


@pytest.mark.parametrize(("name", "quality", "radius"), MEASURED)
def test_samples_rarely_exceed_the_bounds_and_few_charts_stay_open(name: str, quality: str, radius: float) -> None:
    result = ga.optimize(ga.load_problem(name), radius=radius, quality=quality, require=(), progress=False)
    samples = densify(result, radius / 4.0, progress=False)
    highest = np.full(result.atlas.n_charts, -np.inf)
    np.maximum.at(highest, samples.charts, samples.qualities)
    gap = result.gap
    assert (highest > gap.bounds).mean() < 0.01
    assert len(gap.unknown) < 0.01 * result.atlas.n_charts
    assert 0 < gap.n_charts < 0.05 * result.atlas.n_charts
    # The best sample lies in a chart that was named, and does not exceed what was foretold.
    assert samples.best.chart in gap.charts
    assert samples.best.quality <= gap.bound


def test_accepted_samples_lie_in_charts_that_were_expected_to_hold_them(can: ga.Result) -> None:
    """And what beats the best lies in charts of the gap, among them some whose centres are rejected."""
    samples = densify(can, 0.06, progress=False)
    gap = replace(can, refinement=None).gap
    filled = np.unique(samples.charts[samples.accepted])
    assert np.isfinite(gap.bounds[filled]).all()
    better = np.unique(samples.charts[samples.accepted & (samples.qualities > can.best.quality)])
    assert len(better) > 0
    assert set(better) <= set(gap.charts)
    assert (~can.accepted[better]).any()


def test_refined_the_gap_is_smaller(can: ga.Result) -> None:
    before, after = replace(can, refinement=None).gap, can.gap
    assert before.best == can.best.quality
    assert after.best == can.refined_best.quality
    assert after.n_charts < before.n_charts
    assert set(after.charts) < set(before.charts)
    assert after.bound == before.bound
    assert after.share < before.share
    assert can.refined_best.quality < before.bound


def test_the_gap_by_hand(can: ga.Result) -> None:
    atlas, n = can.atlas, can.atlas.n_charts
    accepted = np.zeros(n, bool)
    accepted[[5, 6]] = True
    gap = estimate_gap(atlas, can.qualities, accepted, 0.0)
    expected = {5, 6, *atlas.neighbours[5], *atlas.neighbours[6]}
    assert set(np.flatnonzero(gap.bounds > -np.inf)) == expected
    assert set(gap.charts) | set(gap.unknown) == expected  # all of them are better than nothing
    assert gap.n_rejected == len(expected) - 2
    assert gap.share == np.inf
    assert (np.diff(gap.bounds[gap.charts]) <= 0.0).all()


def test_a_gap_in_words_and_shares() -> None:
    gap = Gap(2.0, np.array([1.0, 3.0, np.inf, 2.5, -np.inf, 2.0]), np.array([1, 1, 1, 0, 0, 1], bool))
    assert gap.charts.tolist() == [1, 3]
    assert gap.unknown.tolist() == [2]
    assert (gap.n_charts, gap.n_rejected, gap.bound, gap.share) == (2, 1, 3.0, 0.5)
    assert repr(gap) == "<Gap, estimated: 2 of 6 charts, 0.5 of the best>"
    closed = Gap(4.0, gap.bounds, gap.accepted)
    assert (closed.n_charts, closed.bound, closed.share) == (0, 4.0, 0.0)
    assert Gap(3.0 * (1.0 - 1e-12), gap.bounds, gap.accepted).n_charts == 0  # rounding is no gap
    assert Gap(np.inf, gap.bounds, gap.accepted).share == 0.0


def test_the_summary_has_it(can: ga.Result) -> None:
    gap = can.gap
    assert can.summary()["gap"] == {
        "kind": "estimated",
        "n_charts": gap.n_charts,
        "n_rejected": gap.n_rejected,
        "n_unknown": len(gap.unknown),
        "best": can.refined_best.quality,
        "bound": gap.bound,
        "share": gap.share,
    }
    nothing = replace(can, qualities=0.0 * can.qualities, refinement=None)
    assert nothing.summary()["gap"] is not None
    assert nothing.summary()["gap"]["n_charts"] == 0
    zero = replace(can, qualities=can.qualities - can.best.quality, refinement=None)
    assert zero.summary()["gap"]["n_charts"] > 0
    assert zero.summary()["gap"]["share"] is None  # of a best that is 0
    json.dumps(zero.summary(), allow_nan=False)
    (line,) = [line for line in result_lines(zero, None) if "gap" in line]
    assert f"up to {zero.gap.bound:.6g};" in line


def test_without_a_best_there_is_no_gap(can: ga.Result) -> None:
    none = replace(can, accepted=np.zeros_like(can.accepted), refinement=None)
    assert none.summary()["gap"] is None
    with pytest.raises(ga.GraspAtlasError, match="meets the requirements"):
        _ = none.gap
    refinement = can.refinement
    assert refinement is not None
    runs = replace(refinement, unbounded=np.ones_like(refinement.unbounded))
    away = replace(can, refinement=runs)
    assert away.summary()["gap"] is None
    assert away.gap.best == can.best.quality


def test_the_command_line_prints_it(can: ga.Result, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["optimize", "planar_hand", "--radius", "0.2"]
    assert main([*words, "--output", str(tmp_path)]) == 0
    (line,) = [line for line in capsys.readouterr().out.splitlines() if "gap" in line]
    data = json.loads((tmp_path / "summary.json").read_text(encoding="utf-8"))
    gap, n = data["gap"], data["n_charts"]
    assert gap["kind"] == "estimated"
    assert line.startswith(f"  gap (estimated): {gap['n_charts']} of {n} charts could hold a better grasp, up to ")
    assert f"{gap['bound']:.6g} ({100.0 * gap['share']:+.3g} %)" in line
    assert main([*words, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["gap"] == gap
