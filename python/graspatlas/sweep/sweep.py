"""Many problems with many options, on all cores or a cluster: one row of a Parquet file for each run.

A run is one problem with one choice of options. Dask distributes the runs: on this machine's cores, or on any
scheduler whose address is given (docs/sweeps.md shows a Slurm cluster). Finished runs are written as they come and
skipped when the sweep is started again; a run that fails becomes a row with its error, which the next start tries
again.
"""

from __future__ import annotations

import hashlib
import itertools
import json
import os
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

from graspatlas.errors import GraspAtlasError
from graspatlas.optimizer.optimize import optimize
from graspatlas.problem.problem import Problem
from graspatlas.problems import load_problem
from graspatlas.quality.evaluation import find_index
from graspatlas.requirements.screening import parse_requirement
from graspatlas.result.refinement import PeakStatus
from graspatlas.result.result import Result
from graspatlas.support.files import opened, replaced, writable_folder
from graspatlas.support.interrupts import stoppable
from graspatlas.support.progress import progress_bar
from graspatlas.version import __version__

__all__ = ["ROWS", "Run", "Sweep", "run_sweep"]

#: Name of the file of rows in the folder of a sweep.
ROWS = "runs.parquet"
#: Rows reach the disk at least this often while runs finish [s].
WRITE_SECONDS = 5.0
#: Whether PYTHONSAFEPATH keeps the current folder off the path of modules; older ones than 3.11 do not know it.
KNOWS_SAFE_PATH = sys.version_info >= (3, 11)

_TEXT, _NUMBER, _WHOLE, _FLAG, _NUMBERS, _TEXTS = "string", "float64", "int64", "bool_", "floats", "strings"
#: Columns of a row and their types.
COLUMNS = {
    "run": _TEXT,
    "problem": _TEXT,
    "file": _TEXT,
    "dimension": _WHOLE,
    "radius": _NUMBER,
    "epsilon": _NUMBER,
    "quality": _TEXT,
    "require": _TEXTS,
    "refine": _FLAG,
    "max_charts": _WHOLE,
    "max_seconds": _NUMBER,
    "status": _TEXT,
    "error": _TEXT,
    "is_global": _FLAG,
    "n_charts": _WHOLE,
    "n_feasible": _WHOLE,
    "seconds": _NUMBER,
    "seconds_atlas": _NUMBER,
    "seconds_quality": _NUMBER,
    "max_residual": _NUMBER,
    "quality_best": _NUMBER,
    "refined_status": _TEXT,
    "quality_worst": _NUMBER,
    "quality_at_x1": _NUMBER,
    "best_chart": _WHOLE,
    "best_joints": _TEXTS,
    "best_q": _NUMBERS,
    "best_object_xyz": _NUMBERS,
    "best_object_quat_xyzw": _NUMBERS,
    "version": _TEXT,
}


@dataclass(frozen=True)
class Run:
    """One problem with one choice of options.

    Attributes:
        file: Name or path of the problem, as the user gave it.
        problem: The problem as plain data; None when it could not be loaded.
        error: Why it could not be loaded; empty otherwise.
        dimension, radius, epsilon, quality, require, refine, max_charts, max_seconds: See :func:`graspatlas.optimize`.
    """

    file: str
    problem: dict[str, Any] | None
    error: str = ""
    dimension: int | None = None
    radius: float | None = None
    epsilon: float | None = None
    quality: str | None = None
    require: tuple[str, ...] = ()
    refine: bool = False
    max_charts: int | None = None
    max_seconds: float | None = None

    @property
    def key(self) -> str:
        """Digest of the problem and the options, by which a finished run is known again."""
        content = {**asdict(self), "file": self.file if self.problem is None else ""}
        return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()[:16]

    def row(self, **values: Any) -> dict[str, Any]:
        """A row of the table: what was asked for, and what is known."""
        asked = {name: getattr(self, name) for name in COLUMNS if name in self.__dataclass_fields__}
        name = self.problem["name"] if self.problem else ""
        known = {"run": self.key, "problem": name, "require": list(self.require), "version": __version__}
        return {**dict.fromkeys(COLUMNS), **asked, **known, **values}


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
    rows: list[dict[str, Any]] = field(repr=False)
    skipped: int
    missing: int

    @property
    def failed(self) -> list[dict[str, Any]]:
        """Rows of the runs that failed."""
        return [row for row in self.rows if row["error"]]

    def best(self) -> dict[str, dict[str, Any]]:
        """For each quality index, the row with the best grasp over all problems and options.

        Rows whose refined best is none, since the index grows without bound there, do not count.
        """
        out: dict[str, dict[str, Any]] = {}
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
    _need_dask()
    for quality in qualities:
        find_index(quality)
    for text in require:
        parse_requirement(text)
    fixed = Run("", None, require=tuple(require), refine=refine, max_charts=max_charts, max_seconds=max_seconds)
    values: list[Sequence[Any]] = [dimensions, radii, epsilons, qualities]
    choices = list(itertools.product(*(value or [None] for value in values)))
    runs = {run.key: run for file in problems for run in _runs_of(str(file), fixed, choices)}
    if not runs:
        raise GraspAtlasError("a sweep needs at least one problem; 'graspatlas list' names those that are bundled")
    path = folder / ROWS
    finished = _read(path)
    left = [run for key, run in runs.items() if key not in finished or finished[key]["error"]]
    skipped = len(runs) - len(left)
    rows = dict(finished)
    bar = progress_bar("sweep", "runs", len(left), progress)
    written = time.monotonic()
    try:
        for row in _rows_as_they_come(left, scheduler, workers):
            rows[row["run"]] = row
            bar.update()
            if time.monotonic() - written > WRITE_SECONDS:
                _write(path, rows)
                written = time.monotonic()
    except KeyboardInterrupt:
        pass
    finally:
        bar.close()
        if left:
            _write(path, rows)
    ended = [rows[key] for key in runs if key in rows]
    return Sweep(path, ended, skipped, len(runs) - len(ended))


def _need_dask() -> None:
    try:
        import dask.distributed  # noqa: F401
        import pyarrow.parquet  # noqa: F401
    except ImportError as error:
        raise GraspAtlasError(f"a sweep needs {error.name}: pip install 'graspatlas[sweep]'") from None


def _runs_of(file: str, fixed: Run, choices: Sequence[Sequence[Any]]) -> Iterator[Run]:
    """The runs of one problem; a problem that cannot be loaded has one, which says so."""
    try:
        problem = load_problem(file)
    except GraspAtlasError as error:
        yield replace(fixed, file=file, error=str(error))
        return
    data = problem.to_dict()
    for choice in choices:
        names = ("dimension", "radius", "epsilon", "quality")
        options: dict[str, Any] = {
            name: problem.defaults.get(name) if value is None else value
            for name, value in zip(names, choice, strict=True)
        }
        yield replace(fixed, file=file, problem=data, **options)


def _rows_as_they_come(runs: Sequence[Run], scheduler: str | None, workers: int | None) -> Iterator[dict[str, Any]]:
    """Rows of the runs in the order in which they end; a worker that dies fails its run only."""
    broken = [run for run in runs if run.problem is None]
    yield from (run.row(error=run.error) for run in broken)
    sound = [run for run in runs if run.problem is not None]
    if not sound:
        return
    with _safe_path():
        yield from _solved(sound, scheduler, workers)


@contextmanager
def _safe_path() -> Iterator[None]:
    """Let workers start without looking for modules of the standard library in the current folder.

    They start as ``python -c``, for which that folder comes first.
    """
    before = os.environ.get("PYTHONSAFEPATH")
    os.environ["PYTHONSAFEPATH"] = "1"
    try:
        yield
    finally:
        if before is None:
            del os.environ["PYTHONSAFEPATH"]
        else:
            os.environ["PYTHONSAFEPATH"] = before


@contextmanager
def _empty_folder() -> Iterator[None]:
    """The same for versions of Python that know no safe path: an empty folder is the current one meanwhile."""
    here = os.getcwd()
    with tempfile.TemporaryDirectory() as empty:
        os.chdir(empty)
        try:
            yield
        finally:
            os.chdir(here)


def _local_cluster(workers: int) -> Any:
    """Workers on this machine, in the current folder."""
    import dask.distributed as dask

    with nullcontext() if KNOWS_SAFE_PATH else _empty_folder():
        cluster = dask.LocalCluster(
            n_workers=workers, threads_per_worker=1, dashboard_address=None, silence_logs="ERROR"
        )
    if not KNOWS_SAFE_PATH:
        with dask.Client(cluster, set_as_default=False) as client:
            client.run(os.chdir, os.getcwd())
    return cluster


def _solved(sound: Sequence[Run], scheduler: str | None, workers: int | None) -> Iterator[dict[str, Any]]:
    """Rows of runs whose problem could be loaded."""
    import dask.distributed as dask

    count = min(workers or len(os.sched_getaffinity(0)), len(sound))
    place: Any = _local_cluster(count) if scheduler is None else scheduler
    try:
        client = dask.Client(place, timeout="20s")
    except (OSError, ValueError) as error:
        raise GraspAtlasError(
            f"no Dask scheduler answers at '{scheduler}' ({error}); start one with: dask scheduler"
        ) from None
    try:
        futures = {client.submit(_solve, run, key=f"{run.key}-{time.time_ns()}", retries=0): run for run in sound}
        for future in dask.as_completed(futures):
            failure = future.exception()
            run = futures[future]
            yield run.row(error=f"{type(failure).__name__}: {failure}") if failure is not None else future.result()
    finally:
        client.close()
        if scheduler is None:
            place.close()


def _solve(run: Run) -> dict[str, Any]:
    """The row of a run; on a worker."""
    start = time.perf_counter()
    try:
        assert run.problem is not None
        result = optimize(
            Problem.from_dict(run.problem),
            dimension=run.dimension,
            radius=run.radius,
            epsilon=run.epsilon,
            quality=run.quality,
            require=[parse_requirement(text) for text in run.require] if run.require else None,
            refine=run.refine,
            max_charts=run.max_charts,
            max_seconds=run.max_seconds,
            progress=False,
        )
    except GraspAtlasError as error:
        return run.row(error=str(error), seconds=time.perf_counter() - start)
    return run.row(**_values(result), seconds=time.perf_counter() - start)


def _values(result: Result) -> dict[str, Any]:
    """What a row says about a result."""
    values = {
        "status": str(result.status),
        "error": "",
        "is_global": result.is_global,
        "n_charts": result.atlas.n_charts,
        "n_accepted": int(result.accepted.sum()),
        "seconds_atlas": result.atlas.seconds,
        "seconds_quality": result.quality_seconds,
        "max_residual": float(result.atlas.residuals.max()),
        "quality_at_x1": float(result.qualities[0]),
    }
    if not result.accepted.any():
        return values
    best = result.refined_best if result.refinement else result.best
    return {
        **values,
        "quality_best": best.quality,
        "refined_status": str(result.refinement.statuses[0]) if result.refinement else None,
        "quality_worst": result.worst.quality,
        "best_chart": best.chart,
        "best_joints": list(best.joints),
        "best_q": best.q.tolist(),
        "best_object_xyz": best.object_xyz.tolist(),
        "best_object_quat_xyzw": best.object_quat_xyzw.tolist(),
    }


def _schema() -> Any:
    import pyarrow as pa

    types = {_NUMBERS: pa.list_(pa.float64()), _TEXTS: pa.list_(pa.string())}
    return pa.schema([(name, types.get(kind) or getattr(pa, kind)()) for name, kind in COLUMNS.items()])


def _read(path: Path) -> dict[str, dict[str, Any]]:
    """Rows that earlier starts have written, by run."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    if not os.path.lexists(path):
        return {}
    try:
        with opened(path) as stream:
            table = pq.read_table(stream, schema=_schema())
    except (OSError, pa.ArrowException) as error:
        raise GraspAtlasError(
            f"'{path}' is no file of a sweep ({error}); move it away or choose another folder"
        ) from None
    return {row["run"]: row for row in table.to_pylist()}


def _write(path: Path, rows: dict[str, dict[str, Any]]) -> None:
    """Replace the file of rows, at once or not at all."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    table = pa.Table.from_pylist(list(rows.values()), schema=_schema())
    with replaced(path) as stream:
        pq.write_table(table, stream)
