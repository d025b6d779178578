"""Checkpoints: runs that were cut short, or killed, go on to the same atlas, to the bit."""

from __future__ import annotations

import io
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from helpers import assert_same_atlas

import graspatlas as ga
from graspatlas import _core
from graspatlas.atlas.checkpoints import CheckpointFolder, run_digest
from graspatlas.cli import main


@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize(
    ("name", "dimension", "radius"),
    [("planar_hand", 2, 0.125), ("schunk_can", 2, 0.25), ("schunk_oil_bottle", 3, 0.2), ("schunk_oil_bottle", 4, 0.6)],
)
def test_a_run_in_pieces_is_the_same(tmp_path: Path, name: str, dimension: int, radius: float, threads: int) -> None:
    problem = ga.load_problem(name)
    system, options = problem.system(dimension), {"radius": radius, "epsilon": 0.5}
    whole = ga.build_atlas(system, problem.x1_array, **options)
    pieces = 0
    for limit in range(whole.n_charts // 5, 2 * whole.n_charts, whole.n_charts // 5):
        part = ga.build_atlas(
            system, problem.x1_array, **options, max_charts=limit, threads=threads, checkpoint=tmp_path / "c"
        )
        pieces += 1
        if part.complete:
            break
        assert part.status is ga.Status.CHART_LIMIT
    assert pieces > 3
    assert_same_atlas(whole, part)


@pytest.mark.parametrize("dimension", [2, 3, 4])
def test_a_run_in_many_pieces_is_the_same(dimension: int) -> None:
    """Every piece goes on from the arrays alone."""
    system, x0 = ga.systems.Sphere(dimension + 1), np.eye(dimension + 1)[0]
    options = ({2: 0.2, 3: 0.3, 4: 0.6}[dimension], 0.5)
    whole = _core.AtlasBuilder(system, x0, *options)
    whole.expand(10**9, 1e3)
    builder = _core.AtlasBuilder(system, x0, *options)
    while not builder.complete:
        builder.expand(builder.n_charts + 17, 1e3)
        builder = _core.AtlasBuilder.resume(system, builder.save(), *options)
    first, second = whole.arrays(), builder.arrays()
    for name in first:
        np.testing.assert_array_equal(first[name], second[name], err_msg=name)


def test_a_killed_run_goes_on(tmp_path: Path) -> None:
    """kill -9 in the middle of a run that keeps checkpoints often."""
    program = (
        "import sys, graspatlas as ga, graspatlas.atlas.growth as growth\n"
        "growth._CHECKPOINT_SECONDS = growth._SLICE_SECONDS = 0.02\n"
        "problem = ga.load_problem('schunk_can')\n"
        "print('ready', flush=True)\n"
        "ga.build_atlas(problem.system(2), problem.x1_array, radius=0.02, epsilon=0.5, checkpoint=sys.argv[1])\n"
    )
    folder = tmp_path / "checkpoint"
    process = subprocess.Popen([sys.executable, "-c", program, str(folder)], stdout=subprocess.PIPE)
    deadline = time.monotonic() + 60.0
    while len(list(folder.glob("*.npz"))) < 3 and time.monotonic() < deadline:
        time.sleep(0.005)
    os.kill(process.pid, signal.SIGKILL)
    process.communicate(timeout=30)
    problem = ga.load_problem("schunk_can")
    system, options = problem.system(2), {"radius": 0.02, "epsilon": 0.5}
    saved = CheckpointFolder(folder, run_digest(system, problem.x1_array, **options)).load()
    assert saved is not None
    limit = len(saved["keys"]) + 5000
    on = ga.build_atlas(system, problem.x1_array, **options, max_charts=limit, checkpoint=folder)
    whole = ga.build_atlas(system, problem.x1_array, **options, max_charts=limit)
    assert_same_atlas(whole, on)


def test_the_command_line_goes_on(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out"
    words = ["optimize", "planar_hand", "--output", str(out)]
    assert main([*words, "--max-charts", "300"]) == 0
    said = capsys.readouterr()
    assert "run the same command again" in said.out
    assert (out / "checkpoint").is_dir()
    assert main(words) == 0
    said = capsys.readouterr()
    assert "going on from the 300 charts" in said.err
    assert not (out / "checkpoint").exists()
    problem = ga.load_problem("planar_hand")
    assert_same_atlas(ga.optimize(problem).atlas, ga.load_result(out).atlas)


def test_a_checkpoint_of_another_run_is_refused(tmp_path: Path) -> None:
    problem = ga.load_problem("planar_hand")
    folder = tmp_path / "c"
    ga.optimize(problem, max_charts=100, checkpoint=folder)
    for options in ({"radius": 0.2}, {"epsilon": 0.3}, {"dimension": 1}):
        with pytest.raises(ga.GraspAtlasError, match="another problem, of other options"):
            ga.optimize(problem, **options, checkpoint=folder)
    with pytest.raises(ga.GraspAtlasError, match="another problem"):
        ga.optimize(ga.load_problem("schunk_can"), checkpoint=folder)


def test_a_damaged_checkpoint_is_refused(tmp_path: Path) -> None:
    problem = ga.load_problem("planar_hand")
    folder = tmp_path / "c"
    ga.optimize(problem, max_charts=100, checkpoint=folder)
    (path,) = folder.glob("*.npz")
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) // 2])
    with pytest.raises(ga.GraspAtlasError, match="damaged or no checkpoint"):
        ga.optimize(problem, checkpoint=folder)
    with np.load(io.BytesIO(whole)) as file:
        arrays = dict(file)
    for name, value in (
        ("keys", arrays["keys"][::-1]),
        ("closed_charts", np.array([10**6], np.int32)),
        ("counts", np.array([-1, 0, 0, 0, 0, 0, 0])),
        ("counts", np.zeros(3, np.int64)),
        ("paused", np.array([[1, 10**6, 0]])),
        ("centers", arrays["centers"][:-1]),
    ):
        with path.open("wb") as stream:
            np.savez(stream, **{**arrays, name: value})
        with pytest.raises(ga.GraspAtlasError, match="checkpoint is damaged"):
            ga.optimize(problem, checkpoint=folder)


def test_a_checkpoint_that_cannot_be_written_is_an_error(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(ga.GraspAtlasError, match="cannot make folder"):
        ga.optimize(ga.load_problem("planar_hand"), max_charts=100, checkpoint=tmp_path / "file")


@pytest.mark.slow
def test_no_vertex_of_a_complete_atlas_is_left() -> None:
    """A cut beside a closed vertex makes new vertices on charts that were done: they are expanded after all."""
    can = ga.load_problem("schunk_can")
    contacts = list(can.contacts)
    i = next(i for i, contact in enumerate(contacts) if contact.frame == "thumb_distal")
    tip = contacts[i].hand
    dome = ga.patches.Sphere.cap(tip.position, tip.normal, 0.008, 0.5)
    contacts[i] = replace(contacts[i], hand=dome, hand_frozen={"v": 0.0})
    problem = replace(can, contacts=tuple(contacts))
    atlas = ga.build_atlas(problem.system(3), problem.x1_array, radius=0.4, epsilon=0.5)
    assert atlas.complete
    assert atlas.closed_vertices["covered"] > 10, "nothing was closed: the test says nothing"
    outside = np.linalg.norm(atlas.vertices, axis=1) > atlas.radius
    assert not (outside & (atlas.vertex_closed == ga.Closed.OPEN.value)).any()
