"""Sweeps: one row a run, finished runs skipped, failures as rows, nothing lost."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import pyarrow.parquet as pq
import pytest
import trimesh

import graspatlas as ga
from graspatlas.cli import main
from graspatlas.sweep import ROWS, Run, run_sweep
from graspatlas.sweep.runs import runs_of

# Dask's own start and end on a busy machine.
pytestmark = pytest.mark.filterwarnings("ignore")

RADII = (0.3, 0.25)


def options(**more: object) -> dict:
    return {"radii": RADII, "qualities": ["smallest_semi_axis", "inverse_condition_number"], "workers": 2, **more}


@pytest.fixture(scope="module")
def swept(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of a finished sweep with a problem that does not exist."""
    folder = tmp_path_factory.mktemp("sweep")
    sweep = run_sweep(["planar_hand", "no_such_problem"], folder, **options())
    assert len(sweep.rows) == 5
    assert sweep.skipped == sweep.missing == 0
    return folder


def test_rows_hold_what_optimize_finds(swept: Path) -> None:
    rows = [row for row in pq.read_table(swept / ROWS).to_pylist() if not row["error"]]
    assert {(row["radius"], row["quality"]) for row in rows} == {
        (radius, quality) for radius in RADII for quality in ("smallest_semi_axis", "inverse_condition_number")
    }
    for row in rows:
        result = ga.optimize(ga.load_problem("planar_hand"), radius=row["radius"], quality=row["quality"])
        assert row["n_charts"] == result.atlas.n_charts
        assert row["quality_best"] == result.best.quality
        assert row["best_q"] == result.best.q.tolist()
        assert row["status"] == "complete"
        assert row["is_global"]


def test_a_failing_problem_is_a_row(swept: Path) -> None:
    (row,) = [row for row in pq.read_table(swept / ROWS).to_pylist() if row["error"]]
    assert row["file"] == "no_such_problem"
    assert "is unknown" in row["error"]
    assert row["quality_best"] is None


@pytest.mark.slow
def test_finished_runs_are_skipped_and_new_ones_added(swept: Path) -> None:
    before = {row["run"]: row["seconds"] for row in pq.read_table(swept / ROWS).to_pylist()}
    sweep = run_sweep(["planar_hand"], swept, **options(radii=(*RADII, 0.2)))
    assert sweep.skipped == 4
    assert len(sweep.rows) == 6
    after = {row["run"]: row["seconds"] for row in pq.read_table(swept / ROWS).to_pylist()}
    assert len(after) == 7
    assert all(after[key] == seconds for key, seconds in before.items())
    best = sweep.best()["smallest_semi_axis"]
    assert best["quality_best"] == max(r["quality_best"] for r in sweep.rows if r["quality"] == "smallest_semi_axis")


def test_a_run_is_known_by_its_content() -> None:
    problem = ga.load_problem("planar_hand").to_dict()
    run = Run("planar_hand", problem, radius=0.2)
    assert run.key == Run("copy.json", json.loads(json.dumps(problem)), radius=0.2).key
    assert run.key != Run("planar_hand", problem, radius=0.21).key
    assert run.key != Run("planar_hand", {**problem, "length_scale": 0.2}, radius=0.2).key


def test_a_mesh_that_was_saved_anew_makes_a_run_new(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    stone, file = tmp_path / "stone.stl", tmp_path / "problem.json"
    trimesh.creation.box((0.02, 0.02, 0.02)).export(stone)
    problem = replace(ga.load_problem("planar_hand"), obstacles=(ga.Obstacle.mesh("stone", stone),))
    file.write_text(json.dumps(problem.to_dict()))
    choices = [(1, 0.2, 0.5, None)]
    (before,), (same,) = (runs_of(str(file), Run("", None), choices) for _ in range(2))
    assert same.key == before.key
    trimesh.creation.box((0.02, 0.02, 0.03)).export(stone)
    (after,) = runs_of(str(file), Run("", None), choices)
    assert after.problem == before.problem
    assert after.key != before.key

    def denied(path: Path) -> bytes:
        raise PermissionError(13, "Permission denied", str(path))

    monkeypatch.setattr(Path, "read_bytes", denied)
    (unread,) = runs_of(str(file), Run("", None), choices)
    assert "cannot be read: [Errno 13] Permission denied" in unread.error


@pytest.mark.slow
def test_a_run_that_cannot_be_solved_is_a_row(tmp_path: Path) -> None:
    sweep = run_sweep(["planar_hand"], tmp_path, dimensions=[9], workers=1)
    (row,) = sweep.failed
    assert "dimension must be" in row["error"]
    again = run_sweep(["planar_hand"], tmp_path, dimensions=[9], workers=1)
    assert again.skipped == 0, "a failed run is tried again"


@pytest.mark.slow
def test_an_interrupted_sweep_keeps_their_rows(tmp_path: Path) -> None:
    words = [
        sys.executable,
        "-m",
        "graspatlas.cli",
        "sweep",
        "planar_hand",
        "--output",
        str(tmp_path),
        "--workers",
        "1",
    ]
    radii = [f"{0.3 - 0.0005 * i:.4f}" for i in range(400)]
    process = subprocess.Popen(
        [*words, "--radius", *radii], stdout=subprocess.PIPE, stderr=subprocess.PIPE, start_new_session=True
    )
    deadline = time.monotonic() + 60.0
    while not (tmp_path / ROWS).exists() and time.monotonic() < deadline:
        time.sleep(0.1)
    os.kill(process.pid, signal.SIGINT)
    _, err = process.communicate(timeout=60)
    assert process.returncode == 130, err.decode()
    assert "runs are left" in err.decode()
    kept = pq.read_table(tmp_path / ROWS).num_rows
    assert 0 < kept < 400
    sweep = run_sweep(["planar_hand"], tmp_path, radii=[float(r) for r in radii[: kept + 2]], workers=1)
    assert sweep.skipped >= min(kept, 1)
    assert sweep.missing == 0


@pytest.mark.slow
def test_the_command_line_sweeps(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["sweep", "planar_hand", "--radius", "0.3", "--workers", "1", "--refine", "--output", str(tmp_path)]
    assert main(words) == 0
    said = capsys.readouterr().out
    assert "1 runs" in said
    assert "best inverse_condition_number: 0.0373" in said
    assert main([*words, "--json"]) == 0
    summary = json.loads(capsys.readouterr().out)
    assert summary["skipped"] == 1
    assert main(["sweep", "nothing.json", "--workers", "1", "--output", str(tmp_path)]) == 1


def test_wrong_input_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("graspatlas.cluster.client.ANSWER_SECONDS", 1.0)
    with pytest.raises(ga.GraspAtlasError, match="quality index 'beauty'"):
        run_sweep(["planar_hand"], tmp_path, qualities=["beauty"])
    with pytest.raises(ga.GraspAtlasError, match="at least one problem"):
        run_sweep([], tmp_path)
    for workers in (0, -1):
        with pytest.raises(ga.GraspAtlasError, match=f"workers must be .* got {workers}"):
            run_sweep(["planar_hand"], tmp_path, workers=workers)
    with pytest.raises(ga.GraspAtlasError, match="workers of this machine or the address of a scheduler, not both"):
        run_sweep(["planar_hand"], tmp_path, workers=1, scheduler="tcp://127.0.0.1:1")
    with pytest.raises(ga.GraspAtlasError, match="no Dask scheduler answers"):
        run_sweep(["planar_hand"], tmp_path, scheduler="tcp://127.0.0.1:1")
    (tmp_path / ROWS).write_bytes(b"not a table")
    with pytest.raises(ga.GraspAtlasError, match="is not the file of a sweep"):
        run_sweep(["planar_hand"], tmp_path)
