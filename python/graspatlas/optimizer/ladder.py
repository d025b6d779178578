r"""What each freedom of the hand is worth: the best grasp for k = 2, 3, ..., t hand motions and object freedoms.

Each rung frees the next hand motion, so its relevant grasps contain those of the rung below::

    ladder = ga.ladder(ga.load_problem("schunk_can"), refine=True, max_seconds=60)
    print(ladder)                   # one row a rung
    print(ladder.answer)            # "k = 4 gains 320 % over k = 2; k = 5 was cut short"

**The radius.** A chart covers about r^k, so n charts of radius r in k dimensions say that the manifold measures about
L = r n^(1/k) along each. In k + 1 dimensions

.. math:: r_{k+1} = \max(r, \; L / N^{1 / (k + 1)})

makes about N charts. An atlas that was cut short says that L is larger.

**What can only grow.** The best of all grasps grows from rung to rung; the best chart need not, since charts become
coarser: then a note says so. The refined best never falls: from that of the rung below the climb goes on in the next.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from typing_extensions import Unpack

from graspatlas.analysis.climb import MAX_STEPS, climb
from graspatlas.atlas.limits import LimitOptions
from graspatlas.atlas.status import Status
from graspatlas.errors import GraspAtlasError
from graspatlas.optimizer.first_grasp import with_good_first_grasp
from graspatlas.optimizer.ladder_outcome import Ladder, LadderStatus
from graspatlas.optimizer.optimize import optimize
from graspatlas.optimizer.options import with_defaults
from graspatlas.optimizer.rungs import Rung, Top, freed_motion, possible_dimensions
from graspatlas.problem.problem import Problem
from graspatlas.quality.batched import Quality, quality_name
from graspatlas.requirements.base import RequirementLike
from graspatlas.result.refinement import PeakStatus
from graspatlas.result.result import Result
from graspatlas.support.deadlines import deadline_after, seconds_until
from graspatlas.support.interrupts import keeping, stoppable, stopping
from graspatlas.support.progress import counted
from graspatlas.support.validation import check_keywords, positive, shown, whole

__all__ = ["CHARTS", "MAX_SECONDS", "ladder"]

#: About how many charts a rung is to have, and how many times as many cut its atlas short.
CHARTS, SPARE = 5000, 4
#: Time for all rungs [s].
MAX_SECONDS = 60.0
#: No radius of a rung is chosen larger [rad, and lengths / length_scale]: steps of a right angle lose the manifold.
LARGEST_RADIUS = 1.4
#: Time that a rung or a climb is given where none is left [s].
SHORTEST = 1e-3
#: The lowest rung by default.
LOWEST = 2


@stoppable()
def ladder(
    problem: Problem,
    *,
    dimensions: Sequence[int] | None = None,
    radius: float | Mapping[int, float] | None = None,
    epsilon: float | None = None,
    quality: Quality | None = None,
    require: Sequence[RequirementLike] | None = None,
    refine: bool = False,
    refine_steps: int = MAX_STEPS,
    charts: int = CHARTS,
    progress: bool | None = None,
    **limits: Unpack[LimitOptions],
) -> Ladder:
    """Find the best grasp for k = 2, 3, ..., t: what each further hand motion is worth.

    Ctrl-C keeps the rungs that are done, and what there is of the one being traced.

    Args:
        problem: The problem; without x1 a first grasp is searched, through which all rungs pass.
        dimensions: The k of the rungs; by default all that the hand motions allow from 2 on.
        radius: r of the lowest rung, or of some rungs by k; by default the problem's. The others are chosen so that
            each has about as many charts as `charts` says, and none is finer than the lowest: see the top of
            :mod:`graspatlas.optimizer.ladder`.
        epsilon: See :func:`build_atlas`; that of the problem by default.
        quality: Name of an index, or a callable; that of the problem by default.
        require: What a grasp must meet to be the best; the requirements of the problem by default.
        refine: Climb from the best charts to the maxima between the centres, and from the refined best of each rung on
            in the next, so that the refined best never falls.
        refine_steps: Steps after which a climb is given up.
        charts: About how many charts a rung is to have.
        progress: Show progress bars on standard error; by default when it is a terminal.
        **limits: ``max_seconds``, time for all rungs, 60 by default, of which each gets an equal share of what those
            before it have left; ``max_charts`` of a rung, four times `charts` by default; ``max_bytes`` and
            ``threads``, see :func:`build_atlas`.

    Returns:
        The rungs that were done.

    Raises:
        GraspAtlasError: If an argument makes no sense, an index or requirement fails, or no first grasp is found; an
            error after the first rung has those that are done as its attribute ``rungs``.
    """
    start = time.perf_counter()
    check_keywords(limits, LimitOptions.__annotations__, "ladder")
    ks = _dimensions(problem, dimensions)
    radii = dict(radius) if isinstance(radius, Mapping) else {} if radius is None else {ks[0]: radius}
    chosen = with_defaults(problem, dimension=ks[0], radius=radii.get(ks[0]), epsilon=epsilon, quality=quality)
    for k, r in radii.items():
        if k not in ks:
            raise GraspAtlasError(f"radius states one for dimension {shown(k)}, which is no rung; the rungs are {ks}")
        positive(r, f"radius of dimension {k}")
    radii.setdefault(ks[0], chosen["radius"])
    whole(charts, "charts")
    whole(refine_steps, "refine_steps")
    limits.setdefault("max_seconds", MAX_SECONDS)
    limits.setdefault("max_charts", SPARE * charts)
    deadline = deadline_after(limits["max_seconds"])
    problem = with_good_first_grasp(
        problem, ks[0], problem.requirements if require is None else require, limits["max_seconds"], progress
    )
    climber = _Climber(problem, ks, radii, charts, deadline, refine_steps if refine else 0)
    status = LadderStatus.COMPLETE
    with keeping(rungs=climber.rungs):
        try:
            for k in counted(ks, "ladder", "rungs", progress):
                if time.perf_counter() >= deadline:
                    status = LadderStatus.TIME_LIMIT
                    break
                climber.climb(k, chosen["epsilon"], chosen["quality"], require, limits, progress)
                if stopping() or climber.rungs[-1].result.status is Status.INTERRUPTED:
                    status = LadderStatus.INTERRUPTED
                    break
        except KeyboardInterrupt:
            if not climber.rungs:
                raise
            status = LadderStatus.INTERRUPTED
    return Ladder(
        problem=problem,
        quality=quality_name(climber.rungs[0].result.quality),
        rungs=tuple(climber.rungs),
        dimensions=tuple(ks),
        refined=refine,
        status=status,
        seconds=time.perf_counter() - start,
    )


def _dimensions(problem: Problem, dimensions: Sequence[int] | None) -> list[int]:
    """The rungs, ascending and each once.

    Raises:
        GraspAtlasError: If there is none, or the hand motions do not allow one.
    """
    if not isinstance(problem, Problem):
        raise GraspAtlasError(f"problem must be a graspatlas.Problem, got {type(problem).__name__}; see load_problem")
    if dimensions is None:
        possible = possible_dimensions(problem)
        return [k for k in possible if k >= LOWEST] or possible
    if isinstance(dimensions, str) or not isinstance(dimensions, Sequence) or len(dimensions) == 0:
        raise GraspAtlasError(f"dimensions must be a list of whole numbers, such as [2, 3], got {shown(dimensions)}")
    for k in dimensions:
        problem.frozen_motions(k)
    return sorted({int(k) for k in dimensions})


class _Climber:
    """The rungs so far, and what the next one takes over from them."""

    def __init__(
        self,
        problem: Problem,
        dimensions: Sequence[int],
        radii: Mapping[int, float],
        charts: int,
        deadline: float,
        refine_steps: int,
    ) -> None:
        self.problem, self.dimensions, self.radii = problem, dimensions, radii
        self.charts, self.deadline, self.refine_steps = charts, deadline, refine_steps
        self.rungs: list[Rung] = []
        self.length = 0.0

    def climb(
        self,
        k: int,
        epsilon: float,
        quality: Quality | Sequence[Quality],
        require: Sequence[RequirementLike] | None,
        limits: LimitOptions,
        progress: bool | None,
    ) -> None:
        """Trace the next rung, and climb in it."""
        start = time.perf_counter()
        left = seconds_until(self.deadline, SHORTEST)
        share = None if left is None else left / sum(other >= k for other in self.dimensions)
        mine: LimitOptions = {**limits, "max_seconds": share}
        result = optimize(
            self.problem,
            dimension=k,
            radius=self._radius(k),
            epsilon=epsilon,
            quality=quality,
            require=require,
            refine=self.refine_steps > 0,
            refine_steps=max(self.refine_steps, 1),
            progress=progress,
            **mine,
        )
        atlas = result.atlas
        length = atlas.radius * atlas.n_charts ** (1.0 / k)
        whole_atlas = result.status in (Status.COMPLETE, Status.BLOCKED)
        self.length = length if whole_atlas else max(self.length, length)  # which is larger than a part of it
        end = None if share is None else start + share
        top = self._top(result, np.inf if end is None else end) if self.refine_steps else None
        motion = freed_motion(self.problem, k) if self.rungs else None
        rung = Rung(result, time.perf_counter() - start, top, motion)
        self.rungs.append(replace(rung, note=self._note(rung)))

    def _radius(self, k: int) -> float:
        """That which was stated, or one that makes about as many charts as are wanted."""
        if k in self.radii:
            return self.radii[k]
        finest = self.rungs[-1].result.atlas.radius
        wanted: float = self.length / self.charts ** (1.0 / k)
        return max(finest, min(wanted, LARGEST_RADIUS))

    def _top(self, result: Result, end: float) -> Top | None:
        """The highest place that climbs reached, those from the rung below included."""
        found, own = result.refinement, None
        if found is not None:
            own = Top(found.x[0], float(found.qualities[0]), found.statuses[0])
        below = self.rungs[-1].top if self.rungs else None
        if below is None:
            return own
        carried = replace(below, carried=True)
        if below.status is not PeakStatus.UNBOUNDED and not stopping() and time.perf_counter() < end:
            try:
                top = climb(result, below.x, max_steps=self.refine_steps, max_seconds=seconds_until(end, SHORTEST))
            except KeyboardInterrupt:
                top = None
            if top is not None:
                status = PeakStatus.UNBOUNDED if top.unbounded else PeakStatus.GIVEN_UP
                carried = Top(top.x, top.quality, PeakStatus.MAXIMUM if top.converged else status, carried=True)
        return carried if own is None or carried.quality > own.quality else own

    def _note(self, rung: Rung) -> str:
        """What to know about a rung."""
        notes = []
        if rung.best is None:
            notes.append("no chart meets the requirements")
        higher = [other for other in self.rungs if other.best is not None and other.best > (rung.best or -np.inf)]
        if rung.best is not None and higher:
            best = max(higher, key=lambda other: other.best or -np.inf)
            why = "its charts are coarser" if rung.complete else "it was cut short"
            notes.append(f"its best chart is below that of k = {best.dimension}: {why}")
        if rung.top is not None and rung.top.status is PeakStatus.UNBOUNDED:
            notes.append("the index grows without bound")
        return "; ".join(notes)
