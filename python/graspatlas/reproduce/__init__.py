"""The experiments of the paper, run on this machine and laid beside it on one page."""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path

from graspatlas.errors import unknown_name
from graspatlas.reproduce.folder import report_folder

__all__ = ["EXPERIMENT_NAMES", "reproduce"]

#: Names of the experiments, in the order of the paper; the last is the simulation of its Fig. 1.
EXPERIMENT_NAMES = ("sphere", "planar_hand", "schunk_can", "schunk_oil_bottle", "holds")


def reproduce(output: str | os.PathLike[str], experiment: str | None = None, progress: bool = True) -> Path:
    """Run the experiments of the paper's Section V and write a page that can be laid beside it.

    The folder gets ``index.html``, its pictures, and every number in ``numbers.csv`` and ``numbers.json``. It appears
    when everything is written; an earlier report there is replaced.

    Args:
        output: The folder: a new one, an empty one, or one that holds an earlier report.
        experiment: Name of the only experiment to run; all by default.
        progress: Say on standard error what is being done.

    Returns:
        Path of the page.

    Raises:
        GraspAtlasError: If there is no such experiment, the folder holds something else, or it cannot be written.

    Source: "Global Optimization of Robotic Grasps", Section V.
    """
    if experiment is not None and experiment not in EXPERIMENT_NAMES:
        raise unknown_name("experiment", experiment, EXPERIMENT_NAMES)
    with report_folder(output) as folder:
        _write(folder, EXPERIMENT_NAMES if experiment is None else (experiment,), progress)
    return Path(output) / "index.html"


def _write(folder: Path, names: tuple[str, ...], progress: bool) -> None:
    """Run experiments and write everything about them to a folder."""
    from graspatlas.reproduce.experiments import EXPERIMENTS  # slow to import
    from graspatlas.reproduce.machine import describe_machine
    from graspatlas.reproduce.page import page
    from graspatlas.reproduce.tables import to_csv, to_json

    sections, seconds = [], {}
    for name in names:
        start = time.perf_counter()
        section = EXPERIMENTS[name](progress)
        for plate in section.plates:
            plate.figure.savefig(folder / plate.file)
        seconds[name] = time.perf_counter() - start
        sections.append(section)
        if progress:
            print(f"{name}: figures: {len(section.plates)}, {seconds[name]:.1f} s", file=sys.stderr)
    machine = describe_machine()
    (folder / "numbers.csv").write_text(to_csv(sections), encoding="utf-8")
    (folder / "numbers.json").write_text(to_json(sections, machine), encoding="utf-8")
    (folder / "index.html").write_text(page(sections, machine, seconds), encoding="utf-8")
