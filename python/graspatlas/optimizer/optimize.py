"""Algorithm 1 of the paper: an atlas of the relevant grasps, and the best of them."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from typing_extensions import Unpack

from graspatlas.analysis.climb import MAX_STEPS
from graspatlas.analysis.refine import refine as climb_peaks
from graspatlas.atlas.atlas import Atlas
from graspatlas.atlas.build import grown
from graspatlas.atlas.limits import LimitOptions, Limits
from graspatlas.errors import GraspAtlasError
from graspatlas.multistart.search import SHARE
from graspatlas.optimizer.all_motions import check_motions, check_sharing, slice_dimension, with_best_of_all
from graspatlas.optimizer.first_grasp import with_good_first_grasp
from graspatlas.optimizer.options import several_indices, with_defaults
from graspatlas.optimizer.readings import Reading, check_atlas_of
from graspatlas.problem.problem import Problem
from graspatlas.quality.batched import Quality
from graspatlas.requirements.base import RequirementLike
from graspatlas.result.result import Result
from graspatlas.support.deadlines import seconds_until
from graspatlas.support.interrupts import keeping, stoppable, stopping
from graspatlas.support.validation import positive, whole

__all__ = ["optimize"]

#: Time that is left where none is [s].
_SHORTEST = 1e-9


@stoppable()
def optimize(
    problem: Problem,
    *,
    dimension: int | None = None,
    radius: float | None = None,
    epsilon: float | None = None,
    quality: Quality | Sequence[Quality] | None = None,
    require: Sequence[RequirementLike] | None = None,
    refine: bool | str = False,
    refine_steps: int = MAX_STEPS,
    motions: str = "relevant",
    share_missing: float = SHARE,
    seed: int = 0,
    workers: int | None = None,
    scheduler: str | None = None,
    checkpoint: str | os.PathLike[str] | None = None,
    progress: bool | None = None,
    atlas: Atlas | None = None,
    **limits: Unpack[LimitOptions],
) -> Result:
    """Find the best grasp of a problem: trace all relevant grasps, then read a quality index on them.

    What is not given comes from ``problem.defaults``. Ctrl-C ends the tracing and the refinement and returns what there
    is by then; while the index is read of a complete atlas it raises ``KeyboardInterrupt``, which carries the atlas.

    Args:
        problem: The problem; see :func:`graspatlas.load_problem`. Without x1 a first grasp is searched, and the result
            carries it: see :func:`graspatlas.find_components` for all that there is.
        dimension: k, of the set of relevant grasps: 1 to t.
        radius: r, of a chart [rad, and lengths in units of ``problem.length_scale``].
        epsilon: See :func:`build_atlas`.
        quality: Name of an index, or a callable: see :mod:`graspatlas.quality`. Of several, the first chooses the best,
            and the others are kept in ``result.others``.
        require: What a grasp must meet to be the best or the worst: see :mod:`graspatlas.requirements`. Those of the
            problem by default; ``()`` for none.
        refine: Climb from the best charts to the maximum between the charts' centres, ``result.refined_best``: in R
            with True or ``"relevant"``, then on in all dimensions of F with ``"feasible"``; see :func:`refine`.
        refine_steps: Steps after which such a climb is given up.
        motions: ``"all"`` searches the best of all feasible grasps F, no hand motion frozen but the couplings and
            whatever connected component it lies in: climbs from the best charts, from random grasps, and from charts of
            slices through these, until little can be missing; ``result.refinement`` holds the maxima, and
            ``result.refinement.search`` what the search can say. The atlas is then that of the problem's default
            dimension and radius.
        share_missing: With all motions, the largest share of climbs that may end at maxima not found; see
            :class:`graspatlas.SearchReport`.
        seed: Of the search's random numbers: the same seed finds the same, whatever the number of threads.
        workers: With all motions, share the search among so many processes on this machine; the same result. In a
            script, call it below ``if __name__ == "__main__":``.
        scheduler: With all motions, the same among the workers of a Dask scheduler at this address, such as
            ``"tcp://10.0.0.1:8786"``.
        checkpoint: See :func:`build_atlas`.
        progress: See :func:`build_atlas`.
        atlas: An atlas of the same problem and options to read instead of tracing one: that of another result, or the
            attribute ``atlas`` of the error with which an index or a requirement of yours ended an earlier call.
        **limits: ``max_charts``, ``max_bytes`` and ``threads``, see :func:`build_atlas`; and ``max_seconds``, time for
            all of it. The search for a first grasp ends in an error when it takes longer. The atlas is cut short so
            that about the time is left that reading the index and the requirements takes, which is measured at x1; and
            climbs that go on then are given up.

    Returns:
        The result: best and worst grasp, atlas, qualities and status. Only when ``result.is_global`` the best grasp is
        the best of all that are connected to x1 and meet the requirements, up to the size of a chart.

    Raises:
        GraspAtlasError: If an argument makes no sense, the index fails, or no first grasp is found. An error after the
            atlas, and ``KeyboardInterrupt``, has it as its attribute ``atlas``, and after the index ``result``.

    Source: "Global Optimization of Robotic Grasps", Algorithm 1.
    """
    limit = Limits.of(limits, "optimize")
    check_motions(motions, dimension, refine, share_missing, seed)
    check_sharing(motions, workers, scheduler)
    if motions == "all":
        dimension = slice_dimension(problem)
    options = with_defaults(problem, dimension=dimension, radius=radius, epsilon=epsilon, quality=quality)
    if refine not in (False, True, "relevant", "feasible"):
        raise GraspAtlasError(f"refine must be True, False, 'relevant' or 'feasible', got {refine!r}")
    whole(refine_steps, "refine_steps")
    reading = Reading(several_indices(options["quality"]), problem.requirements if require is None else require)
    problem = with_good_first_grasp(
        problem, options["dimension"], reading.requirements, limits.get("max_seconds"), progress
    )
    if atlas is None:
        system, x0 = problem.system(options["dimension"]), problem.start(options["dimension"])
        reading.try_out(problem, system, x0)
        if np.isfinite(limit.deadline):
            limit = replace(limit, seconds_each=reading.seconds_each(problem, system, x0))
        sizes = (positive(options["radius"], "radius"), positive(options["epsilon"], "epsilon"))
        atlas = grown(system, x0, *sizes, limit, checkpoint, progress)
    else:
        check_atlas_of(problem, options, atlas)
    with keeping(atlas=atlas):
        result = reading.at(problem, atlas)
        if motions == "all":
            with keeping(result=result):
                return with_best_of_all(
                    result,
                    share=share_missing,
                    seed=seed,
                    max_steps=refine_steps,
                    max_seconds=seconds_until(limit.deadline, _SHORTEST) if np.isfinite(limit.deadline) else None,
                    threads=limit.threads,
                    workers=workers,
                    scheduler=scheduler,
                    checkpoint=checkpoint,
                    progress=progress,
                )
        if refine and result.accepted.any() and not stopping():
            with keeping(result=result):
                found = climb_peaks(
                    result,
                    all_motions=refine == "feasible",
                    max_steps=refine_steps,
                    max_seconds=seconds_until(limit.deadline, _SHORTEST),
                    progress=progress,
                )
            result = replace(result, refinement=found)
    return result
