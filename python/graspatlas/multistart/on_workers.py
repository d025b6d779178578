"""Rounds of a search on workers of Dask, on this machine or many, counted in the order of their numbers.

A round is a function of plan and number, so the search finds the same on any workers as in one process, also where some
of them die on the way.
"""

from __future__ import annotations

import pickle
from collections.abc import Generator
from dataclasses import dataclass, replace
from functools import lru_cache, partial

from graspatlas.cluster import sealing
from graspatlas.cluster.client import connected
from graspatlas.cluster.numbered_tasks import NumberedTasks
from graspatlas.cluster.sealing import check_version
from graspatlas.multistart.rounds import Plan, Round, run_round
from graspatlas.multistart.search import MOST_ROUNDS
from graspatlas.quality.batched import quality_name
from graspatlas.requirements.base import requirement_name
from graspatlas.support.machine import available_threads
from graspatlas.version import __version__

__all__ = ["OnWorkers", "sealed"]

#: Plans that a worker keeps, with what it has read and computed for them.
KEPT_PLANS = 2


@dataclass(frozen=True)
class OnWorkers:
    """Where rounds are done; a :data:`graspatlas.multistart.search.Source`.

    Attributes:
        workers: Processes on this machine, all cores by default; they end with the search.
        scheduler: Address of a scheduler whose workers are used instead.
    """

    workers: int | None = None
    scheduler: str | None = None

    def __call__(self, plan: Plan, first: int, deadline: float) -> Generator[Round, None, None]:
        """The rounds from a number on; those that have not ended when the deadline passes are none.

        Raises:
            GraspAtlasError: If the plan holds a function that cannot be pickled, there is no scheduler, or a round
                fails.
        """
        function = partial(_round_on_worker, __version__, sealed(plan))
        with connected(self.scheduler, self.workers or available_threads()) as client:
            tasks: NumberedTasks[Round] = NumberedTasks(client, function, "round")
            yield from tasks.results(range(first, MOST_ROUNDS + 1), deadline)


def sealed(plan: Plan) -> bytes:
    """A plan for other processes: what it is made of, and functions of the user by cloudpickle.

    Raises:
        GraspAtlasError: If a function cannot be pickled.
    """
    functions: dict[str, object] = {f"the index {quality_name(plan.quality)}": plan.quality}
    functions.update({f"the requirement {requirement_name(each)}": each for each in plan.requirements})
    return sealing.sealed(plan, functions, "search without workers")


def _round_on_worker(version: str, plan: bytes, number: int, max_seconds: float | None) -> Round:
    """A round; a worker has many threads where it is to do many at a time, so each takes one."""
    check_version(version)
    return run_round(_opened(plan), number, max_seconds)


@lru_cache(maxsize=KEPT_PLANS)
def _opened(plan: bytes) -> Plan:
    """The plan, which keeps its objective from round to round: to read a hand and its meshes takes long."""
    opened: Plan = pickle.loads(plan)
    return replace(opened, threads=1)
