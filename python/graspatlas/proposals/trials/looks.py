"""First looks at assignments, in this process or on workers of Dask, with those kept that were done before."""

from __future__ import annotations

import time
from collections.abc import Callable, Generator, Sequence
from typing import TypeAlias

from graspatlas.cluster.sealing import sealed
from graspatlas.cluster.workers import Workers
from graspatlas.proposals.assignments.matching import Assignment
from graspatlas.proposals.outcome import ProposalsEnd
from graspatlas.proposals.plan import Plan
from graspatlas.proposals.trials.kept_looks import KeptLooks
from graspatlas.proposals.trials.trial import Look, LookEnd, look_at
from graspatlas.requirements.base import users_functions
from graspatlas.support.progress import ProgressBar

__all__ = ["LookOnWorkers", "Looker", "look_here", "looks_at"]

#: Where looks are done: those of some numbers, in their order, as long as they come before a deadline.
Looker: TypeAlias = Callable[[Plan, Sequence[Assignment], Sequence[int], float], Generator[Look, None, None]]


def looks_at(
    plan: Plan,
    assignments: Sequence[Assignment],
    kept: KeptLooks,
    *,
    looker: Looker,
    until: float,
    deadline: float,
    bar: ProgressBar,
) -> tuple[list[Look], ProposalsEnd]:
    """Looks at the assignments in their order, as far as time goes, and why they ended.

    Args:
        plan: The plan.
        assignments: The assignments.
        kept: Those that were done before, and where the others are kept.
        looker: Where they are done.
        until: Reading of ``time.perf_counter`` after which no more are done once one has met the requirements.
        deadline: Reading after which no more are done at all.
        bar: Progress.

    Raises:
        GraspAtlasError: If a kept file is damaged or of other arguments, or workers fail.
    """
    before = [kept.look(number) for number in range(len(assignments))]
    left = [number for number, look in enumerate(before) if look is None]
    source = looker(plan, assignments, left, deadline)
    looks: list[Look] = []
    met = False
    try:
        for number, known in enumerate(before):
            if time.perf_counter() > (until if met else deadline):
                return looks, ProposalsEnd.TIME_LIMIT
            look = next(source, None) if known is None else known
            if look is None:
                return looks, ProposalsEnd.TIME_LIMIT
            looks.append(look if known is not None else kept.keep(number, look))
            met = met or look.end is LookEnd.MET
            bar.update()
    except KeyboardInterrupt:
        return looks, ProposalsEnd.INTERRUPTED
    finally:
        source.close()
    return looks, ProposalsEnd.COMPLETE


def look_here(
    plan: Plan, assignments: Sequence[Assignment], numbers: Sequence[int], deadline: float
) -> Generator[Look, None, None]:
    """Looks in this process; a :data:`Looker`."""
    for number in numbers:
        if time.perf_counter() > deadline:
            return
        yield look_at(plan, assignments[number])


class LookOnWorkers(Workers):
    """Looks on workers; a :data:`Looker`."""

    def __call__(
        self, plan: Plan, assignments: Sequence[Assignment], numbers: Sequence[int], deadline: float
    ) -> Generator[Look, None, None]:
        """The looks of some numbers; see :data:`Looker`."""
        if numbers:
            functions = users_functions(plan.quality, plan.requirements)
            whole = sealed((plan, tuple(assignments)), functions, "propose without workers")
            yield from self.results(_look, whole, "assignment", numbers, deadline)


def _look(whole: tuple[Plan, tuple[Assignment, ...]], number: int, max_seconds: float | None) -> Look:
    """A look on a worker, which takes a second or two, whatever is left."""
    plan, assignments = whole
    return look_at(plan, assignments[number])
