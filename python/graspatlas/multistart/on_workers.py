"""Rounds of a search on workers of Dask, on this machine or many, counted in the order of their numbers.

A round is a function of plan and number, so the search finds the same on any workers as in one process, also where some
of them die on the way.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import replace

from graspatlas.cluster import sealing
from graspatlas.cluster.workers import Workers
from graspatlas.multistart.rounds import Plan, Round, run_round
from graspatlas.multistart.search import MOST_ROUNDS
from graspatlas.requirements.base import users_functions

__all__ = ["OnWorkers", "sealed"]


class OnWorkers(Workers):
    """Where rounds are done; a :data:`graspatlas.multistart.search.Source`."""

    def __call__(self, plan: Plan, first: int, deadline: float) -> Generator[Round, None, None]:
        """The rounds from a number on; those that have not ended when the deadline passes are none.

        Raises:
            GraspAtlasError: If the plan holds a function that cannot be pickled, there is no scheduler, or a round
                fails.
        """
        yield from self.results(_round, sealed(plan), "round", range(first, MOST_ROUNDS + 1), deadline)


def sealed(plan: Plan) -> bytes:
    """A plan for other processes, in which a round takes one thread: a worker has others for other rounds.

    Raises:
        GraspAtlasError: If a function cannot be pickled.
    """
    functions = users_functions(plan.quality, plan.requirements)
    return sealing.sealed(replace(plan, threads=1), functions, "search without workers")


def _round(plan: Plan, number: int, max_seconds: float | None) -> Round:
    return run_round(plan, number, max_seconds)
