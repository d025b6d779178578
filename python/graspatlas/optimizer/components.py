"""Best grasps over all connected components of the relevant grasps that a random search finds.

The paper's procedure "operates in the connected component including an initial grasp", and leaves open how to find one
starting point in each component. Here feasible grasps are found at random, see :mod:`graspatlas.search`; one that no
atlas covers belongs to another component, or to a part that an atlas cut short has not reached, and an atlas grows from
it.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TypedDict

import numpy as np
from typing_extensions import Unpack

from graspatlas.atlas.atlas import Atlas
from graspatlas.atlas.status import Status
from graspatlas.errors import GraspAtlasError
from graspatlas.grasps.grasp import Grasp
from graspatlas.optimizer.optimize import optimize
from graspatlas.optimizer.options import OptimizeOptions, with_defaults
from graspatlas.problem.problem import Problem
from graspatlas.result.result import Result
from graspatlas.result.summary import ResultSummary
from graspatlas.search.grasp_search import MAX_SINGULAR, GraspSearch
from graspatlas.support.arrays import Array
from graspatlas.support.deadlines import deadline_after, seconds_until
from graspatlas.support.interrupts import stoppable
from graspatlas.support.notebooks import Displayed
from graspatlas.support.progress import progress_bar
from graspatlas.support.validation import check_keywords, whole
from graspatlas.support.words import Word

__all__ = ["Components", "SearchStatus", "find_components"]


#: How far from the nearest polytope a covered grasp may lie, as a share of the radius: atlases have slivers.
COVERED = 0.5
#: Time that an atlas is given where none is left [s].
SHORTEST = 1e-3
#: Charts of an older atlas that are looked up in a new one to see whether it grew in the same component.
SAMPLES = 50


class SearchStatus(Word):
    """Why a search for components ended."""

    COVERED = "the last grasps found were all covered"
    NO_GRASP = "no grasp in many tries"
    TIME_LIMIT = "limit of time"
    INTERRUPTED = "interrupted"


class ComponentSummary(ResultSummary):
    """The result of one component, and how many of the grasps found lie in it."""

    hits: int


class ComponentsSummary(TypedDict):
    """The components in plain data."""

    status: str
    torque_length: float
    seconds: float
    tries: int
    grasps_found: int
    covered_in_a_row: int
    holes: int
    share_not_found: float
    components: list[ComponentSummary]


@dataclass(frozen=True, eq=False)
class Components(Displayed):
    """The connected components of R that were found, the best first.

    Their qualities can be compared: torques are divided by one length, ``problem.torque_arm``, in all of them.

    Parts of one component count as several where atlases that were cut short, or whose charts are too large to follow a
    narrow place, do not meet: see the status and the size of each.

    Attributes:
        results: Result of each component; those without a grasp that meets the requirements come last.
        hits: How many grasps that were found lie in each; one that is seldom hit has small siblings that are not found.
        found: Grasps found.
        covered: How many of them, the last ones, were all covered when they were found.
        holes: Grasps in a component that had an atlas, but not covered by it: it was cut short or has a hole. The atlas
            with more charts was kept.
        tries: Random starts.
        status: Why the search ended.
        seconds: Time that all took.
    """

    results: tuple[Result, ...]
    hits: tuple[int, ...]
    found: int
    covered: int
    holes: int
    tries: int
    status: SearchStatus
    seconds: float

    def __repr__(self) -> str:
        parts = ", ".join(f"{result.problem.name!r}, {result.atlas.n_charts} charts" for result in self.results[:1])
        return f"<Components: {len(self)}, the first of {parts or 'nothing'}; {self.status}>"

    def __len__(self) -> int:
        return len(self.results)

    @property
    def best_result(self) -> Result:
        """Result of the component that holds the best grasp."""
        return self.results[0]

    @property
    def best(self) -> Grasp:
        """The best grasp over all components that meets the requirements, refined if that was asked for.

        Raises:
            GraspAtlasError: If none does.
        """
        result = self.best_result
        return result.refined_best if result.refinement else result.best

    def share_not_found(self, confidence: float = 0.95) -> float:
        """Largest share of finds that components not found yet would get all together, at this confidence.

        If they got more, the last ``covered`` grasps would all have been covered with a chance below 1 - confidence. It
        is a share of random finds, not of the manifold: a component may be large and still hard to hit.

        Args:
            confidence: Between 0 and 1.
        """
        if not 0.0 < confidence < 1.0:
            raise GraspAtlasError(f"confidence must lie between 0 and 1, got {confidence!r}")
        return float(1.0 - (1.0 - confidence) ** (1.0 / self.covered)) if self.covered else 1.0

    def summary(self) -> ComponentsSummary:
        """The components in plain data, as the command line prints them."""
        return {
            "status": str(self.status),
            "torque_length": self.best_result.problem.torque_arm,
            "seconds": self.seconds,
            "tries": self.tries,
            "grasps_found": self.found,
            "covered_in_a_row": self.covered,
            "holes": self.holes,
            "share_not_found": self.share_not_found(),
            "components": [
                {**result.summary(), "hits": hits} for result, hits in zip(self.results, self.hits, strict=True)
            ],
        }


@stoppable()
def find_components(
    problem: Problem,
    *,
    covered: int = 300,
    seed: int = 0,
    progress: bool | None = None,
    **options: Unpack[OptimizeOptions],
) -> Components:
    """Find the best grasp over all connected components of the relevant grasps that a random search finds.

    The component of x1 comes first when the problem has one. Ctrl-C ends the search and returns what there is.

    Args:
        problem: The problem, with or without x1.
        covered: The search ends when as many grasps in a row were covered: by default 300, after which components not
            found yet get at most 1 % of the finds with 95 % confidence.
        seed: Of the random numbers.
        progress: Show a progress bar on standard error; by default when it is a terminal.
        **options: What :func:`graspatlas.optimize` is told for every component: ``dimension``, ``radius``, ``epsilon``,
            ``quality``, ``require``, ``refine``, ``refine_steps``, ``max_charts``, ``max_bytes`` and ``threads``; and
            ``max_seconds``, time after which the search ends: an atlas that is growing then is cut short.

    Returns:
        The components found, at least one.

    Raises:
        GraspAtlasError: If an argument makes no sense, or no feasible grasp is found.

    Source: "Global Optimization of Robotic Grasps", Section VI, where it is future work.
    """
    whole(covered, "covered")
    check_keywords(options, OptimizeOptions.__annotations__, "find_components")
    chosen = with_defaults(
        problem,
        dimension=options.get("dimension"),
        radius=options.get("radius"),
        epsilon=options.get("epsilon"),
        quality=options.get("quality"),
    )
    traced = _Tracer({**options, **chosen}, deadline_after(options.get("max_seconds")), progress)
    start = time.perf_counter()
    search = GraspSearch(problem, chosen["dimension"], seed)
    try:
        status = _trace_all(problem, search, traced, covered, progress)
    except KeyboardInterrupt:
        if not traced.results:
            raise
        status = SearchStatus.INTERRUPTED
    if not traced.results:
        raise search.failure()
    order = sorted(range(len(traced.results)), key=lambda i: -_best_quality(traced.results[i]))
    return Components(
        results=tuple(traced.results[i] for i in order),
        hits=tuple(traced.hits[i] for i in order),
        found=search.found,
        covered=traced.covered,
        holes=traced.holes,
        tries=search.tries,
        status=status,
        seconds=time.perf_counter() - start,
    )


def _trace_all(
    problem: Problem, search: GraspSearch, traced: _Tracer, covered: int, progress: bool | None
) -> SearchStatus:
    """Find grasps and trace their components until enough in a row were covered."""
    if problem.x1 is not None:
        traced.trace(problem)
    with progress_bar("tries", progress=progress) as bar:
        while traced.covered < covered:
            if traced.interrupted:
                return SearchStatus.INTERRUPTED
            x = search.next_grasp(traced.deadline, bar)
            if x is None:
                late = time.perf_counter() > traced.deadline
                return SearchStatus.TIME_LIMIT if late else SearchStatus.NO_GRASP
            if not traced.take(search, x) and traced.singular >= MAX_SINGULAR:
                if traced.results:
                    return SearchStatus.NO_GRASP
                traced.trace(search.problem.at(x))  # says why no atlas can grow
            bar.note(f"grasps={search.found}, components={len(traced.results)}")
    return SearchStatus.COVERED


class _Tracer:
    """The components so far, and what has been found in them."""

    def __init__(self, options: OptimizeOptions, deadline: float, progress: bool | None) -> None:
        self.options, self.deadline, self.progress = options, deadline, progress
        self.results: list[Result] = []
        self.hits: list[int] = []
        self.covered = self.holes = self.singular = 0
        self.interrupted = False

    def take(self, search: GraspSearch, x: Array) -> bool:
        """Count a grasp that was found to the component that covers it, or trace its component.

        False for a singular grasp that none covers: no atlas can grow from it.
        """
        for i, result in enumerate(self.results):
            if _covers(result.atlas, x):
                self.hits[i] += 1
                self.covered += 1
                self.singular = 0
                return True
        if not search.is_regular(x):
            self.singular += 1
            return False
        self.covered = self.singular = 0
        self.hits[self.trace(search.problem.at(x))] += 1
        return True

    def trace(self, problem: Problem) -> int:
        """Trace the component of a problem's x1; its number."""
        seconds = seconds_until(self.deadline, SHORTEST)
        options: OptimizeOptions = {**self.options, "max_seconds": seconds}
        new = optimize(problem, **options, progress=self.progress)
        self.interrupted = new.status is Status.INTERRUPTED
        for i, old in enumerate(self.results):
            if _same_component(new.atlas, old.atlas):
                self.holes += 1
                self.results[i] = max(old, new, key=lambda result: result.atlas.n_charts)
                return i
        self.results.append(new)
        self.hits.append(0)
        return len(self.results) - 1


def _covers(atlas: Atlas, x: Array) -> bool:
    return atlas.locate(x)[1] <= COVERED * atlas.radius


def _same_component(new: Atlas, old: Atlas) -> bool:
    """True when charts of one atlas are covered by the other: then both grew in one component."""

    def covered(a: Atlas, b: Atlas) -> bool:
        rows = np.unique(np.linspace(0, b.n_charts - 1, SAMPLES).astype(int))
        return any(_covers(a, b.centers[row]) for row in rows)

    return covered(new, old) or covered(old, new)


def _best_quality(result: Result) -> float:
    """The best quality of a component; minus infinity when no grasp meets the requirements."""
    if result.refinement:
        return result.refined_best.quality
    return result.best.quality if result.accepted.any() else -np.inf
