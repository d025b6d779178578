"""Many problems with many options, on all cores or a cluster: one row of a Parquet file for each run.

A run is one problem with one choice of options. Dask distributes the runs: on this machine's cores, or on any
scheduler whose address is given (docs/sweeps.md shows a Slurm cluster). Finished runs are written as they come and
skipped when the sweep is started again; a run that fails becomes a row with its error, which the next start tries
again.
"""

from __future__ import annotations

import itertools
import os
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from graspatlas.cluster.client import need
from graspatlas.cluster.workers import check_workers
from graspatlas.errors import GraspAtlasError
from graspatlas.quality.evaluation import find_index
from graspatlas.requirements.named import parse_requirement
from graspatlas.result.refinement import PeakStatus
from graspatlas.storage.files import writable_folder
from graspatlas.support.interrupts import stoppable
from graspatlas.support.progress import progress_bar
from graspatlas.sweep.rows import ROWS, Row, read_rows, write_rows
from graspatlas.sweep.runs import Run, runs_of
from graspatlas.sweep.workers import rows_as_they_come

__all__ = ["Sweep", "run_sweep"]

#: Rows reach the disk at least this often while runs finish [s].
WRITE_SECONDS = 5.0
#: Rows that a notebook shows.
MOST_SHOWN = 20


@dataclass(frozen=True)
class Sweep:
    """What came out of a sweep.

    Attributes:
        path: The file of rows.
        rows: One for each run that was asked for and has ended, in the order asked for.
        skipped: Number of runs that had been finished before.
        missing: Number of runs that have not ended, since the sweep was interrupted.
    """

    path: Path
    rows: list[Row] = field(repr=False)
    skipped: int
    missing: int

    @property
    def failed(self) -> list[Row]:
        """Rows of the runs that failed."""
        return [row for row in self.rows if row["error"]]

    def _repr_html_(self) -> str:
        from graspatlas.viewer.notebook.card import bars, card, table

        head = ("problem", "dimension", "radius", "quality", "status", "n_charts", "n_accepted", "quality_best")
        told = [[row["error"] or row[name] if name == "status" else row[name] for name in head] for row in self.rows]
        cells = [["" if value is None else value for value in row] for row in told[:MOST_SHOWN]]
        left = f", the first {MOST_SHOWN} below" if len(told) > MOST_SHOWN else ""
        ended = f"{len(self.rows)} runs ended, {len(self.failed)} of them failed, {self.missing} are missing{left}"
        quality = next(iter(self.best()), "")
        values = [row["quality_best"] for row in self.rows if row["quality"] == quality and row["quality_best"]]
        beside = bars(values, f"best {quality} of each run") if values else ""
        return card(f"Sweep: {ended}", [table(cells, head)], beside)

    def best(self) -> dict[str, Row]:
        """For each quality index, the row with the best grasp over all problems and options.

        Rows whose refined best is none, since the index grows without bound there, do not count.
        """
        out: dict[str, Row] = {}
        for row in self.rows:
            if row["refined_status"] == str(PeakStatus.UNBOUNDED):
                continue
            value, name = row["quality_best"], row["quality"]
            if value is not None and (name not in out or value > out[name]["quality_best"]):
                out[name] = row
        return out


@stoppable()
def run_sweep(
    problems: Sequence[str | Path],
    output: str | os.PathLike[str],
    *,
    dimensions: Sequence[int] = (),
    radii: Sequence[float] = (),
    epsilons: Sequence[float] = (),
    qualities: Sequence[str] = (),
    require: Sequence[str] = (),
    refine: bool = False,
    max_charts: int | None = None,
    max_seconds: float | None = None,
    scheduler: str | None = None,
    workers: int | None = None,
    progress: bool | None = None,
) -> Sweep:
    """Run every problem with every combination of options, and keep one row for each in ``output/runs.parquet``.

    Options that are not given come from each problem's defaults. Ctrl-C keeps the rows of the runs that have ended.

    Args:
        problems: Names of bundled problems, or paths of problem files.
        output: Folder of the rows; made if need be.
        dimensions: Dimensions k to combine; see :func:`graspatlas.optimize` for this and what follows.
        radii: Radii r of a chart to combine.
        epsilons: Values of epsilon to combine.
        qualities: Names of indices to combine.
        require: Requirements of every run, as texts such as ``"force_closure:0.5:0.02"``; each problem's own by
            default.
        refine: Go on from the best charts to the maximum between them; ``quality_best`` is then the refined one.
        max_charts: Limit of every run.
        max_seconds: Limit of every run.
        scheduler: Address of a Dask scheduler, such as ``"tcp://10.0.0.1:8786"``; a local cluster by default.
        workers: Processes of the local cluster; as many as there are cores by default.
        progress: Show a progress bar on standard error; by default when it is a terminal.

    Returns:
        The rows, those of earlier starts included.

    Raises:
        GraspAtlasError: If an option makes no sense, Dask is not installed, the folder cannot be written, or the
            scheduler does not answer. A problem that cannot be loaded or solved is no error but a row that says so.
    """
    folder = writable_folder(output)
    need("a sweep", "dask.distributed", "pyarrow.parquet")
    if workers is not None or scheduler is not None:
        check_workers("a sweep", workers, scheduler)
    for quality in qualities:
        find_index(quality)
    for text in require:
        parse_requirement(text)
    fixed = Run("", None, require=tuple(require), refine=refine, max_charts=max_charts, max_seconds=max_seconds)
    values: list[Sequence[int | float | str | None]] = [dimensions, radii, epsilons, qualities]
    choices = list(itertools.product(*(value or [None] for value in values)))
    runs = {run.key: run for file in problems for run in runs_of(str(file), fixed, choices)}
    if not runs:
        raise GraspAtlasError("a sweep needs at least one problem; 'graspatlas list' names those that are bundled")
    path = folder / ROWS
    finished = read_rows(path)
    left = [run for key, run in runs.items() if key not in finished or finished[key]["error"]]
    skipped = len(runs) - len(left)
    rows = dict(finished)
    bar = progress_bar("sweep", "runs", len(left), progress)
    written = time.monotonic()
    try:
        for row in rows_as_they_come(left, scheduler, workers):
            rows[row["run"]] = row
            bar.update()
            if time.monotonic() - written > WRITE_SECONDS:
                write_rows(path, rows)
                written = time.monotonic()
    except KeyboardInterrupt:
        pass
    finally:
        bar.close()
        if left:
            write_rows(path, rows)
    ended = [rows[key] for key in runs if key in rows]
    return Sweep(path, ended, skipped, len(runs) - len(ended))
