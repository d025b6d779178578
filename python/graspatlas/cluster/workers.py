"""Workers, here or anywhere, that do numbered tasks of one plan."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable
from dataclasses import dataclass
from functools import partial
from typing import Any, TypeVar

from graspatlas.cluster.client import connected, need
from graspatlas.cluster.numbered_tasks import NumberedTasks
from graspatlas.cluster.sealing import opened
from graspatlas.errors import GraspAtlasError
from graspatlas.support.machine import available_threads
from graspatlas.support.validation import shown, whole
from graspatlas.version import __version__

__all__ = ["Workers", "check_workers"]

T = TypeVar("T")

#: Processes on one machine, at most.
MOST_WORKERS = 1024


@dataclass(frozen=True)
class Workers:
    """Where tasks are done.

    Attributes:
        workers: Processes on this machine, all cores by default; they end with the tasks.
        scheduler: Address of a scheduler whose workers are used instead.
    """

    workers: int | None = None
    scheduler: str | None = None

    def results(
        self,
        function: Callable[[Any, int, float | None], T],
        plan: bytes,
        what: str,
        numbers: Iterable[int],
        deadline: float,
    ) -> Generator[T, None, None]:
        """Results in the order of their numbers, as long as they come before a deadline.

        Args:
            function: What a worker calls with the plan, a number, and the seconds that are left, None for any.
            plan: What all tasks have in common, :func:`graspatlas.cluster.sealing.sealed`.
            what: What a task is, for messages.
            numbers: The numbers; they may be without end.
            deadline: Reading of ``time.perf_counter`` after which no task is waited for [s].

        Raises:
            GraspAtlasError: If there is no scheduler, or a task fails.
        """
        task = partial(_done, __version__, function, plan)
        with connected(self.scheduler, self.workers or available_threads()) as client:
            tasks: NumberedTasks[T] = NumberedTasks(client, task, what)
            yield from tasks.results(numbers, deadline)


def _done(
    version: str, function: Callable[[Any, int, float | None], T], plan: bytes, number: int, max_seconds: float | None
) -> T:
    """A task, on a worker."""
    return function(opened(version, plan), number, max_seconds)


def check_workers(what: str, workers: int | None, scheduler: str | None) -> None:
    """Make sure that what is asked to do tasks can.

    Args:
        what: What needs them, such as "a search on workers", for messages.
        workers: Processes on this machine, or None.
        scheduler: Address of a scheduler, or None.

    Raises:
        GraspAtlasError: If it cannot.
    """
    if workers is not None and scheduler is not None:
        raise GraspAtlasError("give workers of this machine or the address of a scheduler, not both")
    if workers is not None:
        whole(workers, "workers", most=MOST_WORKERS)
    elif not isinstance(scheduler, str) or not scheduler:
        raise GraspAtlasError(f"scheduler must be an address such as 'tcp://10.0.0.1:8786', got {shown(scheduler)}")
    need(what, "dask.distributed")
