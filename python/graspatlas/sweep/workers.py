"""Workers of a sweep, on this machine or a Dask cluster: what they are started with, and what each does."""

from __future__ import annotations

import os
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, nullcontext
from typing import TYPE_CHECKING

from graspatlas.errors import GraspAtlasError
from graspatlas.optimizer.optimize import optimize
from graspatlas.problem.problem import Problem
from graspatlas.requirements.named import parse_requirement
from graspatlas.result.result import Result
from graspatlas.support.machine import available_threads
from graspatlas.sweep.rows import Row
from graspatlas.sweep.runs import Run

if TYPE_CHECKING:
    import dask.distributed as dask

__all__ = ["rows_as_they_come"]

#: Time in which a scheduler must answer [s].
ANSWER_SECONDS = 20.0
#: Whether PYTHONSAFEPATH keeps the current folder off the path of modules; older ones than 3.11 do not know it.
KNOWS_SAFE_PATH = sys.version_info >= (3, 11)


def rows_as_they_come(runs: Sequence[Run], scheduler: str | None, workers: int | None) -> Iterator[Row]:
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


def _local_cluster(workers: int) -> dask.LocalCluster:
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


def _solved(sound: Sequence[Run], scheduler: str | None, workers: int | None) -> Iterator[Row]:
    """Rows of runs whose problem could be loaded."""
    import dask.distributed as dask

    count = min(workers or available_threads(), len(sound))
    cluster = _local_cluster(count) if scheduler is None else None
    try:
        client = dask.Client(scheduler if cluster is None else cluster, timeout=ANSWER_SECONDS)
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
        if cluster is not None:
            cluster.close()


def _solve(run: Run) -> Row:
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


def _values(result: Result) -> Row:
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
