"""Workers of a sweep, on this machine or a Dask cluster: what each does."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence

from graspatlas.cluster.client import connected
from graspatlas.errors import GraspAtlasError
from graspatlas.optimizer.optimize import optimize
from graspatlas.problem.problem import Problem
from graspatlas.requirements.named import parse_requirement
from graspatlas.result.result import Result
from graspatlas.support.machine import available_threads
from graspatlas.sweep.rows import Row
from graspatlas.sweep.runs import Run

__all__ = ["rows_as_they_come"]


def rows_as_they_come(runs: Sequence[Run], scheduler: str | None, workers: int | None) -> Iterator[Row]:
    """Rows of the runs in the order in which they end; a worker that dies fails its run only."""
    broken = [run for run in runs if run.problem is None]
    yield from (run.row(error=run.error) for run in broken)
    sound = [run for run in runs if run.problem is not None]
    if sound:
        yield from _solved(sound, scheduler, workers)


def _solved(sound: Sequence[Run], scheduler: str | None, workers: int | None) -> Iterator[Row]:
    """Rows of runs whose problem could be loaded."""
    import dask.distributed as dask

    with connected(scheduler, min(workers or available_threads(), len(sound))) as client:
        futures = {client.submit(_solve, run, key=f"{run.key}-{time.time_ns()}", retries=0): run for run in sound}
        for future in dask.as_completed(futures):
            failure = future.exception()
            run = futures[future]
            yield run.row(error=f"{type(failure).__name__}: {failure}") if failure is not None else future.result()


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
