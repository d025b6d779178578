"""The progress bar: shown where it was asked for, and of no concern to other processes."""

from __future__ import annotations

import subprocess
import sys

import pytest

from graspatlas.support.progress import counted, progress_bar

#: A process that shows a bar, as workers of Dask may, and is killed before it can clean up.
KILLED = """
import multiprocessing, os, signal
from graspatlas.support.progress import progress_bar
multiprocessing.set_start_method("spawn")
progress_bar("work", progress=True).update()
os.kill(os.getpid(), signal.SIGKILL)
"""


def test_a_killed_process_leaves_no_semaphore_behind() -> None:
    """Python would warn of one on standard error, once the process is gone."""
    ran = subprocess.run([sys.executable, "-c", KILLED], capture_output=True, text=True, timeout=60, check=False)
    assert "semaphore" not in ran.stderr


def test_it_counts_what_passes(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr("graspatlas.support.progress.QUIET_SECONDS", 0.0)
    assert list(counted([3, 1, 2], "work", "pieces", progress=True)) == [3, 1, 2]
    assert "work: 100%" in capsys.readouterr().err
    with progress_bar("work", progress=False) as bar:
        bar.update()
    assert capsys.readouterr().err == ""
