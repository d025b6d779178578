"""Atlases of the assignments with the best looks, in this process or on workers of Dask."""

from __future__ import annotations

import time
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from typing import TypeAlias

from graspatlas.cluster.sealing import sealed
from graspatlas.cluster.workers import Workers
from graspatlas.errors import GraspAtlasError
from graspatlas.proposals.assignments.matching import Assignment
from graspatlas.proposals.outcome import ProposalsEnd
from graspatlas.proposals.plan import Plan
from graspatlas.proposals.trials.trial import Look, LookEnd, atlas_of
from graspatlas.requirements.base import users_functions
from graspatlas.result.result import Result
from graspatlas.support.deadlines import seconds_until
from graspatlas.support.interrupts import stopping
from graspatlas.support.progress import ProgressBar

__all__ = ["GROWING", "GrowOnWorkers", "Grower", "atlases_of", "best_looks", "grow_here"]

#: Time that an atlas takes, about [s], and that which it is given where none is left.
GROWING, SHORTEST = 4.0, 1.0


@dataclass(frozen=True, eq=False)
class Grown:
    """What came of one atlas.

    Attributes:
        result: The result, where a grasp of it meets the requirements; else None.
        fault: Why there is no atlas, where there is none.
    """

    result: Result | None
    fault: str = ""


#: Where atlases grow: those of some assignments with their looks, in their order, as long as there is time.
Grower: TypeAlias = Callable[[Plan, Sequence[tuple[Assignment, Look]], float], Generator[Grown, None, None]]


def best_looks(looks: Sequence[Look], top: int) -> list[int]:
    """Numbers of the best looks that met the requirements, the best first, so many at most."""
    met = [i for i, look in enumerate(looks) if look.end is LookEnd.MET]
    return sorted(met, key=lambda i: -looks[i].value)[:top]


def atlases_of(
    plan: Plan,
    assignments: Sequence[Assignment],
    looks: Sequence[Look],
    best: Sequence[int],
    *,
    grower: Grower,
    deadline: float,
    bar: ProgressBar,
) -> tuple[dict[int, Result], list[str], ProposalsEnd]:
    """The atlases of some assignments, by number; what went wrong; and why they ended.

    Args:
        plan: The plan.
        assignments: All assignments.
        looks: Their looks.
        best: The numbers of those that get an atlas, the best first.
        grower: Where the atlases grow.
        deadline: Reading of ``time.perf_counter`` after which no more are begun, once there is one.
        bar: Progress.
    """
    results: dict[int, Result] = {}
    faults: list[str] = []
    source = grower(plan, [(assignments[i], looks[i]) for i in best], deadline)
    end = ProposalsEnd.COMPLETE
    try:
        for i in best:
            grown = next(source, None)
            if grown is None:
                end = ProposalsEnd.TIME_LIMIT
                break
            if grown.result is not None:
                results[i] = grown.result
            if grown.fault:
                faults.append(grown.fault)
            bar.update()
            if stopping():
                end = ProposalsEnd.INTERRUPTED
                break
    except KeyboardInterrupt:
        end = ProposalsEnd.INTERRUPTED
    finally:
        source.close()
    return results, faults, end


def grow_here(plan: Plan, chosen: Sequence[tuple[Assignment, Look]], deadline: float) -> Generator[Grown, None, None]:
    """Atlases in this process, which share the time that is left; a :data:`Grower`."""
    some = False
    for done, (assignment, look) in enumerate(chosen):
        if some and time.perf_counter() > deadline:
            return
        left = seconds_until(deadline, SHORTEST)
        grown = _grown(plan, assignment, look, None if left is None else left / (len(chosen) - done))
        some = some or grown.result is not None
        yield grown


class GrowOnWorkers(Workers):
    """Atlases on workers, side by side; a :data:`Grower`."""

    def __call__(
        self, plan: Plan, chosen: Sequence[tuple[Assignment, Look]], deadline: float
    ) -> Generator[Grown, None, None]:
        """The atlases of some assignments; see :data:`Grower`."""
        if chosen:
            functions = users_functions(plan.quality, plan.requirements)
            whole = sealed((plan, tuple(chosen)), functions, "propose without workers")
            until = max(deadline, time.perf_counter() + GROWING)
            yield from self.results(_on_worker, whole, "atlas", range(len(chosen)), until)


def _on_worker(
    whole: tuple[Plan, tuple[tuple[Assignment, Look], ...]], number: int, max_seconds: float | None
) -> Grown:
    plan, chosen = whole
    return _grown(plan, *chosen[number], max_seconds)


def _grown(plan: Plan, assignment: Assignment, look: Look, max_seconds: float | None) -> Grown:
    """One atlas."""
    try:
        result = atlas_of(plan, assignment, look, None if max_seconds is None else max(max_seconds, SHORTEST))
    except GraspAtlasError as error:  # singular where charts would be
        return Grown(None, f"no atlas of {assignment.name}: {error}")
    return Grown(result if result.accepted.any() or result.refinement else None)
