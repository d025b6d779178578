"""The ladder: rungs that are what optimize finds, refined bests that never fall, and an answer in plain words."""

from __future__ import annotations

import csv
import json
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

import graspatlas as ga
from graspatlas.cli import main
from graspatlas.optimizer.ladder_outcome import Ladder, LadderStatus
from graspatlas.optimizer.rungs import Rung, freed_motion, possible_dimensions
from graspatlas.result.refinement import PeakStatus

#: Largest entry of |R(x)|.
ON_MANIFOLD = 1e-8


@pytest.fixture(scope="module")
def planar() -> ga.Problem:
    return ga.load_problem("planar_hand")


@pytest.fixture(scope="module")
def climbed(planar: ga.Problem) -> Ladder:
    """Both rungs of the planar hand, refined."""
    return ga.ladder(planar, radius=0.25, charts=400, refine=True, max_seconds=None, progress=False)


def made(*values: float | None, cut: Sequence[int] = (), wanted: int = 0, unbounded: int = 0) -> Ladder:
    """A ladder from k = 2 on with these best values, of rungs that hold nothing else."""
    rungs = []
    for k, value in enumerate(values, start=2):
        status = PeakStatus.UNBOUNDED if k == unbounded else PeakStatus.MAXIMUM
        rungs.append(
            SimpleNamespace(dimension=k, value=value, complete=k not in cut, top=SimpleNamespace(status=status))
        )
    dimensions = tuple(range(2, 2 + max(len(values), wanted)))
    problem = cast(ga.Problem, None)
    return Ladder(problem, "index", cast(Any, tuple(rungs)), dimensions, True, LadderStatus.COMPLETE, 1.0)


def test_every_rung_is_what_optimize_finds(planar: ga.Problem, climbed: Ladder) -> None:
    assert [rung.dimension for rung in climbed.rungs] == [2, 3] == possible_dimensions(planar)[1:]
    assert climbed.status is LadderStatus.COMPLETE
    for rung in climbed.rungs:
        atlas = rung.result.atlas
        alone = ga.optimize(planar, dimension=rung.dimension, radius=atlas.radius, refine=True, progress=False)
        assert alone.atlas.n_charts == atlas.n_charts
        assert rung.best == alone.best.quality
        assert rung.refined is not None
        assert rung.refined >= alone.refined_best.quality * (1.0 - 1e-9)
        assert rung.seconds > 0.0
    assert climbed.best is climbed.rungs[1]


def test_radii_make_about_as_many_charts_as_asked(planar: ga.Problem, climbed: Ladder) -> None:
    low, high = (rung.result.atlas for rung in climbed.rungs)
    assert low.radius == 0.25
    assert high.radius == pytest.approx(low.radius * low.n_charts**0.5 / 400 ** (1.0 / 3.0))
    assert 400 / 3 < high.n_charts < 400 * 3
    stated = ga.ladder(planar, radius={2: 0.3, 3: 0.6}, max_charts=50, progress=False)
    assert [rung.result.atlas.radius for rung in stated.rungs] == [0.3, 0.6]
    assert max(rung.result.atlas.n_charts for rung in stated.rungs) == 50
    # However few charts are wanted, a step stays below a right angle; however many, none is finer than the one below.
    assert ga.ladder(planar, radius=0.3, charts=2, max_charts=200, progress=False).rungs[1].result.atlas.radius == 1.4
    fine = ga.ladder(planar, radius=0.3, charts=10**6, max_charts=20, progress=False)
    assert fine.rungs[1].result.atlas.radius == 0.3


def test_the_refined_best_never_falls(planar: ga.Problem) -> None:
    """Though the atlas of the higher rung is a few charts around x1, from which climbs end lower, or was never read."""
    found = ga.ladder(planar, radius={2: 0.2, 3: 0.3}, refine=True, max_charts=900, progress=False)
    few = ga.ladder(planar, radius={2: 0.2, 3: 0.05}, refine=True, refine_steps=1, max_charts=450, progress=False)
    for steps in (found, few):
        low, high = steps.rungs
        assert low.refined is not None
        assert high.refined is not None
        assert high.refined >= low.refined >= (low.best or 0.0)
    low, high = few.rungs
    assert high.top is not None
    assert high.top.carried
    assert (high.best or 0.0) < (low.best or 0.0)
    assert high.note == "its best chart is below that of k = 2: it was cut short"
    assert high.note in str(few)


def test_what_is_carried_over_is_a_grasp_of_the_rung(climbed: Ladder, planar: ga.Problem) -> None:
    for rung in climbed.rungs:
        best = rung.best_grasp
        assert best.quality == rung.refined
        system = planar.system(rung.dimension)
        assert np.abs(system.evaluate_residual(best.x)).max() < ON_MANIFOLD
        assert system.slack(best.x).min() > -ON_MANIFOLD
        assert rung.result.meets(best.x[None])[0]


def test_the_freed_motion_is_the_one_that_the_rung_below_froze(climbed: Ladder, planar: ga.Problem) -> None:
    low, high = climbed.rungs
    assert low.motion is None
    motion = high.motion
    assert motion is not None
    assert planar.motions is not None
    direction = planar.motions.reordered(planar.hand.joints).E[:, motion.number - 1]
    parts = dict(zip(planar.hand.joints, direction, strict=True))
    assert list(motion.joints.items()) == sorted(parts.items(), key=lambda pair: -abs(pair[1]))[:3]
    kept = [planar.motions.variance_kept(planar.frozen_motions(k)) for k in (2, 3)]
    assert motion.variance_share == pytest.approx(kept[1] - kept[0])
    # The motion moves in the higher rung, and in it alone.
    for rung, moves in ((low, False), (high, True)):
        q = rung.result.atlas.centers[:, : len(planar.hand.joints)]
        angles = np.array([list(rung.result.grasp(i).joint_positions.values()) for i in range(0, len(q), 9)])
        turned = (np.angle(np.exp(1j * (angles - list(planar.x1.joints.values())))) @ direction) if planar.x1 else 0.0
        assert (np.abs(turned).max() > 0.1) == moves


@pytest.mark.parametrize("name", ["allegro_sphere_3", "schunk_can", "gripper_skittle"])
def test_freed_motions_of_other_hands(name: str) -> None:
    """Couplings and mimics are never freed, and each motion is freed once."""
    problem = ga.load_problem(name)
    dimensions = possible_dimensions(problem)
    freed = [freed_motion(problem, k) for k in dimensions[1:]]
    numbers = [motion.number for motion in freed if motion is not None]
    assert len(numbers) == len(dimensions) - 1  # hands of which nothing but couplings is known have one rung
    assert numbers == list(range(numbers[0], numbers[0] + len(numbers))) if numbers else len(dimensions) == 1
    couplings = 0 if problem.motions is None else len(problem.motions.couplings)
    if numbers:
        assert numbers[-1] == len(problem.hand.joints) - len(problem.hand.mechanism.mimics) - couplings
    for motion in freed:
        assert motion is None or motion.variance_share is None or 0.0 <= motion.variance_share <= 1.0


@pytest.mark.parametrize(
    ("ladder", "answer"),
    [
        (made(10.0, 10.05), "k = 2 is enough: up to k = 3 nothing gains more than 1 % over it"),
        (made(10.0, 20.0, 42.0), "k = 4 gains 320 % over k = 2"),
        (made(10.0, 20.0, 42.0, 42.1, cut=[5]), "k = 4 gains 320 % over k = 2, and up to k = 5 nothing gains more than "
         "1 % over that; k = 5 was cut short"),
        (made(10.0, 20.0, wanted=5, cut=[2, 3]), "k = 3 gains 100 % over k = 2; k = 2 and 3 were cut short; k = 4 to 6 "
         "were not begun"),
        (made(None, None, 5.0), "k = 2 and 3: no grasp meets the requirements; only k = 4 tells, and reaches 5"),
        (made(None, 4.0, 5.0), "k = 2: no grasp meets the requirements; k = 4 gains 25 % over k = 3"),
        (made(None, None), "k = 2 and 3: no grasp meets the requirements"),
        (made(-10.0, -5.0), "k = 3 gains 50 % over k = 2"),
        (made(0.0, 0.5), "k = 3 reaches 0.5 and not 0 as k = 2"),
        (made(0.0, 0.0), "k = 2 is enough: up to k = 3 nothing gains more than 1 % over it"),
        (made(1.0, 9e9, unbounded=3), "from k = 3 on the index grows without bound: state requirements, or take "
         "another index"),
    ],
)  # fmt: skip
def test_answers(ladder: Ladder, answer: str) -> None:
    assert ladder.answer == answer


@pytest.mark.slow
def test_an_index_without_a_maximum_is_called_so() -> None:
    can = ga.load_problem("schunk_can")
    found = ga.ladder(can, dimensions=[2, 3], radius=0.4, charts=300, require=(), refine=True, progress=False)
    assert found.rungs[0].top is not None
    assert found.rungs[0].top.status is PeakStatus.UNBOUNDED
    assert found.rungs[1].top is not None
    assert found.rungs[1].top.status is PeakStatus.UNBOUNDED
    assert found.answer.startswith("from k = 2 on the index grows without bound")
    assert "the index grows without bound" in found.rungs[0].note


def test_rungs_share_their_time() -> None:
    can = ga.load_problem("schunk_can")
    start = time.perf_counter()
    found = ga.ladder(can, radius=0.1, max_seconds=1.0, max_charts=None, require=(), progress=False)
    took = time.perf_counter() - start
    assert took < 5.0
    assert not any(rung.complete for rung in found.rungs)
    assert len(found.rungs) + len(found.missing) == 7
    # The lowest has a seventh of the time, and not all of it.
    assert len(found.rungs) >= 3
    assert "cut short" in found.answer


def test_ctrl_c_keeps_the_rungs_that_are_done(planar: ga.Problem) -> None:
    calls = []

    @ga.batched
    def stopped(grasps: ga.Grasps) -> Any:
        calls.append(len(grasps))
        if grasps.system.dimension == 3:
            raise KeyboardInterrupt
        return grasps.semi_axes[:, 0]

    found = ga.ladder(planar, radius=0.4, quality=stopped, max_seconds=None, progress=False)
    assert [rung.dimension for rung in found.rungs] == [2]
    assert found.status is LadderStatus.INTERRUPTED
    assert found.missing == (3,)
    assert "k = 3 was not begun" in found.answer
    with pytest.raises(KeyboardInterrupt):
        ga.ladder(planar, dimensions=[3], radius=0.6, quality=stopped, max_seconds=None, progress=False)


def test_errors_carry_the_rungs(planar: ga.Problem) -> None:
    @ga.batched
    def fails(grasps: ga.Grasps) -> Any:
        if grasps.system.dimension == 3:
            raise ValueError("no")
        return grasps.semi_axes[:, 0]

    with pytest.raises(ga.GraspAtlasError, match="no") as caught:
        ga.ladder(planar, radius=0.4, quality=fails, max_seconds=None, progress=False)
    assert [rung.dimension for rung in cast(Any, caught.value).rungs] == [2]


def test_without_hand_motions_there_is_one_rung(planar: ga.Problem) -> None:
    free = replace(planar, motions=None)
    found = ga.ladder(free, radius=0.6, max_charts=40, progress=False)
    assert [rung.dimension for rung in found.rungs] == [3]
    assert found.rungs[0].motion is None


def test_misuse(planar: ga.Problem) -> None:
    for options, said in (
        ({"dimensions": [9]}, "dimension must be a whole number from 1 to 3"),
        ({"dimensions": []}, r"dimensions must be a list of whole numbers, such as \[2, 3\], got \[\]"),
        ({"dimensions": 2}, "dimensions must be a list of whole numbers"),
        ({"radius": {7: 0.1}}, r"dimension 7, which is no rung; the rungs are \[2, 3\]"),
        ({"radius": {3: -1.0}}, "radius of dimension 3 must be a positive number"),
        ({"radius": 0.0}, "radius must be a positive number|radius of dimension 2 must be a positive"),
        ({"charts": 0}, "charts must be a whole number"),
        ({"quality": "beauty"}, "beauty"),
        ({"max_seconds": -1.0}, "max_seconds must be"),
    ):
        with pytest.raises(ga.GraspAtlasError, match=said):
            ga.ladder(planar, **options)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match=r"ladder\(\) got an unexpected keyword argument 'max_chart'"):
        ga.ladder(planar, max_chart=3)  # type: ignore[call-arg]
    with pytest.raises(ga.GraspAtlasError, match=r"problem must be a graspatlas\.Problem"):
        ga.ladder("planar_hand")  # type: ignore[arg-type]
    with pytest.raises(ga.GraspAtlasError, match="none of 1 rungs holds a grasp"):
        _ = made(None).best


def test_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["ladder", "planar_hand", "--radius", "2:0.3", "3:0.6", "--refine"]
    files = ["--csv", str(tmp_path / "l.csv"), "--picture", str(tmp_path / "l.png"), "--output", str(tmp_path / "out")]
    assert main([*words, *files, "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert data == {**json.loads((tmp_path / "out" / "ladder.json").read_text(encoding="utf-8"))}
    assert [rung["radius"] for rung in data["rungs"]] == [0.3, 0.6]
    assert data["rungs"][1]["refined"] >= data["rungs"][0]["refined"]
    assert data["answer"].startswith("k = ")
    with (tmp_path / "l.csv").open(encoding="utf-8", newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert [float(row["refined"]) for row in rows] == [rung["refined"] for rung in data["rungs"]]
    assert rows[0]["variance_share"] == ""
    assert float(rows[1]["variance_share"]) == data["rungs"][1]["motion"]["variance_share"]
    assert (tmp_path / "l.png").read_bytes().startswith(b"\x89PNG")
    stored = ga.load_result(tmp_path / "out" / "3.npz")
    assert stored.best.quality == data["rungs"][1]["best"]
    assert main(words) == 0
    out = capsys.readouterr().out
    assert out.splitlines()[-1] == data["answer"]
    assert len([line for line in out.splitlines() if line.startswith((" 2", " 3"))]) == 2


def test_wrong_words(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    words = ["ladder", "planar_hand"]
    for wrong, said in (
        (["--radius", "2:x"], "--radius takes one number, or K:R"),
        (["--radius", "0.1", "0.2"], "--radius takes one number, or K:R"),
        (["--picture", str(tmp_path / "a.txt")], "must end in one of .png, .pdf, .svg"),
        (["--dimension", "8"], "dimension must be a whole number from 1 to 3"),
    ):
        assert main([*words, *wrong]) == 2
        assert said in capsys.readouterr().err
    none = ["--radius", "0.5", "--max-charts", "30", "--require", "force_closure:0.001:0.02"]
    assert main([*words, *none]) == 1
    assert "no grasp meets the requirements" in capsys.readouterr().out


def test_the_figure(climbed: Ladder) -> None:
    low, high = climbed.rungs
    figure = ga.plot_ladder(climbed)
    (axes,) = figure.axes
    texts = [label.get_text() for label in axes.get_xticklabels()]
    assert texts[0].startswith(f"k = 2\n{low.result.atlas.n_charts:,} charts\nr = 0.25")
    assert high.motion is not None
    assert f"frees motion {high.motion.number}" in texts[1]
    lines = {line.get_label(): line for line in axes.get_lines()}
    assert {"best chart", "refined"} <= set(lines)
    drawn = [tuple(line.get_ydata()) for line in axes.get_lines() if len(line.get_xdata()) == 2]
    assert (low.refined, high.refined) in drawn
    assert climbed.answer in [text.get_text() for text in figure.texts]
    # A rung that is missing has its place, and one that was cut short is hollow.
    short = replace(high, result=replace(high.result, atlas=replace(high.result.atlas, status=ga.Status.TIME_LIMIT)))
    cut = replace(climbed, rungs=(low, cast(Rung, short)), dimensions=(2, 3, 4))
    (axes,) = ga.plot_ladder(cut).axes
    assert axes.get_xticklabels()[2].get_text() == "k = 4\nnot begun"
    assert "hollow: cut short" in [line.get_label() for line in axes.get_lines()]
