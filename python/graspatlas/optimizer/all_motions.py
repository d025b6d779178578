"""The best of all feasible grasps F, from an atlas of the relevant ones and a search from many starts."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import numpy as np

from graspatlas.analysis.objective import Objective
from graspatlas.analysis.peaks import local_maxima
from graspatlas.cluster.workers import check_workers
from graspatlas.errors import GraspAtlasError
from graspatlas.multistart.on_workers import OnWorkers
from graspatlas.multistart.rounds import Plan
from graspatlas.multistart.search import Search, one_by_one
from graspatlas.multistart.search import nothing_meets as no_grasp_meets
from graspatlas.problem.problem import Problem
from graspatlas.result.result import Result
from graspatlas.support.arrays import Array
from graspatlas.support.validation import checked_instance, number, shown, whole

__all__ = ["check_motions", "check_sharing", "slice_dimension", "with_best_of_all"]

#: Dimension of the atlas where the problem has no default.
DIMENSION = 2
#: Charts from which to climb, the best first.
MOST_STARTS = 40


def check_motions(motions: object, dimension: int | None, refine: bool | str, share: float, seed: int) -> None:
    """Make sure that what was asked for goes together.

    Raises:
        GraspAtlasError: If it does not.
    """
    if motions not in ("relevant", "all"):
        raise GraspAtlasError(f"motions must be 'relevant' or 'all', got {shown(motions)}")
    if not 0.0 < number(share, "share_missing") < 1.0:
        raise GraspAtlasError(f"share_missing must lie between 0 and 1, got {shown(share)}")
    whole(seed, "seed", 0)
    if motions == "relevant":
        return
    if dimension is not None:
        raise GraspAtlasError(
            f"motions 'all' frees every hand motion, so there is no dimension to choose; got {shown(dimension)}: leave "
            "dimension out, or motions"
        )
    if refine:
        raise GraspAtlasError("motions 'all' climbs in all of F already: leave refine out")


def check_sharing(motions: str, workers: int | None, scheduler: str | None) -> None:
    """Make sure that what is asked to do the rounds of a search can.

    Raises:
        GraspAtlasError: If it cannot.
    """
    if workers is None and scheduler is None:
        return
    if motions != "all":
        raise GraspAtlasError(
            "workers and a scheduler share the search over all hand motions: add motions='all', or leave them out; for "
            "many problems or options see graspatlas sweep"
        )
    check_workers("a search on workers", workers, scheduler)


def slice_dimension(problem: Problem) -> int:
    """Dimension of the atlas from which a search over all motions starts: the problem's default, or 2.

    Raises:
        GraspAtlasError: If the problem leaves the hand no motion at all.
    """
    checked_instance(problem, Problem, "problem", "load_problem")
    if problem.largest_dimension < 1:
        raise GraspAtlasError(
            f"problem '{problem.name}' has isolated feasible grasps, from which hand and object cannot move while "
            "the contacts are kept, so there is nothing to search; give the contacts larger patches, or the hand more "
            "joints"
        )
    stated = problem.defaults.get("dimension", DIMENSION)
    return min(int(stated), problem.largest_dimension)


def with_best_of_all(
    result: Result,
    *,
    share: float,
    seed: int,
    max_steps: int,
    max_seconds: float | None,
    threads: int,
    workers: int | None,
    scheduler: str | None,
    checkpoint: str | os.PathLike[str] | None,
    progress: bool | None,
) -> Result:
    """A result with the maxima over all feasible grasps as its refinement.

    Args:
        result: Of the problem's default dimension; its best charts are the first starts.
        share: Largest share of climbs that may end at maxima not found.
        seed: Of the random numbers.
        max_steps: Steps after which a climb is given up.
        max_seconds: Time after which the search ends; none by default.
        threads: Threads of this process on which climbs run.
        workers: Processes on this machine that do the rounds; None for this one alone.
        scheduler: Address of a Dask scheduler whose workers do them.
        checkpoint: Folder of the atlas's checkpoint, in which the search keeps its own.
        progress: Show a progress bar on standard error; by default when it is a terminal.

    Raises:
        GraspAtlasError: If no climb met the requirements, the checkpoint is of another search, or workers fail; see
            :class:`graspatlas.multistart.on_workers.OnWorkers`.
    """
    plan = Plan(
        problem=result.problem,
        quality=result.quality,
        requirements=tuple(result.requirements),
        dimension=result.dimension,
        radius=result.atlas.radius,
        epsilon=result.atlas.epsilon,
        seed=seed,
        max_steps=max_steps,
        threads=threads,
    )
    folder = None if checkpoint is None else Path(checkpoint) / "rounds"
    search = Search(plan, share, folder, progress)
    alone = workers is None and scheduler is None
    found = search.run(_starts(result), max_seconds, one_by_one if alone else OnWorkers(workers, scheduler))
    if found is None:
        raise no_grasp_meets(plan, search.census)
    return replace(result, refinement=found)


def _starts(result: Result) -> Array:
    """The best charts of an atlas, or those that miss the requirements least where none meets them."""
    centers = result.atlas.centers
    charts = local_maxima(result)[:MOST_STARTS]
    if len(charts):
        return centers[charts]
    missed = Objective.of(result, all_motions=False).missed(centers)
    return centers[np.argsort(missed, kind="stable")[:MOST_STARTS]]
