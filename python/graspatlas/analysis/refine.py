"""The best grasp beyond the charts' centres: climbs from the best chart of each basin, so that r no longer matters."""

from __future__ import annotations

import time
from collections.abc import Sequence

import numpy as np

from graspatlas.analysis.climb import MAX_STEPS, Climb, climbs_from
from graspatlas.analysis.objective import Objective
from graspatlas.analysis.peaks import Peak, local_maxima, peaks_of
from graspatlas.errors import GraspAtlasError
from graspatlas.result.grasp_atlas import GraspAtlas
from graspatlas.result.refinement import Refinement
from graspatlas.support.deadlines import deadline_after
from graspatlas.support.interrupts import held, stoppable, stopping
from graspatlas.support.progress import progress_bar

__all__ = ["refine"]


#: Local maxima of the atlas from which to climb, the best first.
MOST_STARTS = 40
#: Climbs that the core makes between two looks at the clock.
BATCH = 8


@stoppable()
def refine(
    result: GraspAtlas,
    *,
    all_motions: bool = False,
    max_steps: int = MAX_STEPS,
    max_seconds: float | None = None,
    progress: bool | None = None,
) -> Refinement:
    """Climb from the best chart of each basin, on the manifold and within bounds and requirements.

    A basin is what one local maximum of the index over the charts stands for. Its climb is that of
    :func:`graspatlas.climb`; climbs that end in one place count once. Ctrl-C keeps the climbs that have ended.

    What `all_motions` frees are the hand motions that k froze. What couples joints stays: the couplings of
    ``HandMotions``, and joints that mimic others by the ``<mimic>`` tags of the hand's URDF.

    Args:
        result: The result.
        all_motions: Go on from there in F, no hand motion frozen but the couplings.
        max_steps: Steps after which a climb is given up.
        max_seconds: Time after which the climbs are given up, and ``complete`` is False; none by default.
        progress: Show a progress bar on standard error; by default when it is a terminal.

    Returns:
        The local maxima that were found.

    Raises:
        GraspAtlasError: If no grasp meets the requirements, or a requirement is a function that a file did not keep.

    Source: refines the grid search of "Global Optimization of Robotic Grasps", Section IV.
    """
    deadline = deadline_after(max_seconds)
    charts = local_maxima(result)[:MOST_STARTS]
    if len(charts) == 0:
        raise GraspAtlasError("no grasp meets the requirements, so there is none to refine: relax a requirement")
    bar = progress_bar("refine", "climbs", len(charts), progress)
    ends: list[Climb] = []
    starts = np.asarray(charts)
    complete = True
    try:
        inside = Objective.of(result, all_motions=False)
        for batch in np.array_split(charts, -(-len(charts) // BATCH)):
            X = result.atlas.centers[batch]
            ends += climbs_from(inside, X, batch.tolist(), max_steps, _time_left(deadline))
            bar.update(len(batch))
        if all_motions:
            # Climbs in R that met go on as one.
            free = Objective.of(result, all_motions=True)
            tops = [_top(peak, ends) for peak in peaks_of(result, ends)]
            bar.total = len(charts) + len(tops)
            starts, ends = starts[tops], [ends[top] for top in tops]
            for first in range(0, len(ends), BATCH):
                X = np.array([end.x for end in ends[first : first + BATCH]])
                new = climbs_from(free, X, [-1] * len(X), max_steps, _time_left(deadline))
                ends[first : first + BATCH] = new
                bar.update(len(X))
        complete = time.perf_counter() < deadline
    except KeyboardInterrupt:
        complete = False
        if not ends:
            best = result.best
            ends, starts = [Climb(best.chart, best.x, np.array([best.quality]), False)], np.array([best.chart])
    finally:
        with held():
            bar.close()
    peaks = peaks_of(result, ends)
    tops = [_top(peak, ends) for peak in peaks]
    return Refinement(
        x=np.array([peak.x for peak in peaks]),
        qualities=np.array([peak.quality for peak in peaks]),
        starts=np.array([starts[top] for top in tops], np.int64),
        converged=np.array([ends[top].converged for top in tops], bool),
        stalled=np.array([ends[top].stalled for top in tops], bool),
        unbounded=np.array([ends[top].unbounded for top in tops], bool),
        kkt=np.array([ends[top].kkt for top in tops]),
        hits=np.array([len(peak.climbs) for peak in peaks], np.int64),
        steps=np.array([ends[top].n_steps for top in tops], np.int64),
        all_motions=all_motions,
        complete=complete,
    )


def _time_left(deadline: float) -> float | None:
    """Time for a climb [s]; None for no limit.

    Raises:
        KeyboardInterrupt: If there is none left, or a signal has asked for the end: both end the climbs alike.
    """
    left = deadline - time.perf_counter()
    if left <= 0.0 or stopping():
        raise KeyboardInterrupt
    return None if left == float("inf") else left


def _top(peak: Peak, ends: Sequence[Climb]) -> int:
    """Number of the climb that ended highest on a peak."""
    return int(max(peak.climbs, key=lambda c: ends[int(c)].quality))
