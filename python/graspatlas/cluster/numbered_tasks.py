"""Numbered tasks on workers that come and go, and their results in the order of their numbers."""

from __future__ import annotations

import time
import uuid
from collections import deque
from collections.abc import Callable, Generator, Iterable
from dataclasses import dataclass
from itertools import islice
from typing import TYPE_CHECKING, Generic, TypeVar

from graspatlas.errors import GraspAtlasError

if TYPE_CHECKING:
    import dask.distributed as dask

__all__ = ["NumberedTasks"]

T = TypeVar("T")

#: Tasks that are submitted and have not ended, for each thread of a worker, and at least so many in all.
AHEAD, LEAST_AHEAD = 2, 2
#: Time between two questions how many workers there are [s].
ASK_SECONDS = 1.0


@dataclass
class NumberedTasks(Generic[T]):
    """Tasks that are functions of a number, whatever worker runs them and whenever.

    A task whose worker dies is given to another by Dask, until so many have died of it as the scheduler allows
    (``distributed.scheduler.allowed-failures``, 3).

    Attributes:
        client: Of the scheduler.
        function: What a worker calls with the number and the seconds that are left, None for any; Dask must be able to
            pickle it.
        what: What a task is, for messages.
    """

    client: dask.Client
    function: Callable[[int, float | None], T]
    what: str

    def results(self, numbers: Iterable[int], deadline: float) -> Generator[T, None, None]:
        """Results in the order of their numbers, as long as they come before a deadline.

        Tasks are submitted ahead, as many as there are workers to do them. Those that have not ended when the generator
        is closed are cancelled.

        Args:
            numbers: The numbers; they may be without end.
            deadline: Reading of ``time.perf_counter`` after which no task is waited for [s].

        Raises:
            GraspAtlasError: If a task fails, takes worker after worker with it, or the scheduler goes away.
        """
        left = iter(numbers)
        batch = uuid.uuid4().hex
        tasks: deque[tuple[int, dask.Future]] = deque()
        wanted, asked = 0, float("-inf")
        try:
            while True:
                if time.monotonic() >= asked + ASK_SECONDS:
                    wanted, asked = self._wanted(), time.monotonic()
                running = [future for _, future in tasks if not future.done()]
                for number in islice(left, max(wanted - len(running), 0)):
                    tasks.append((number, self._submit(number, batch, deadline)))
                    running.append(tasks[-1][1])
                if not tasks:
                    return
                if tasks[0][1].done():
                    yield self._result(*tasks.popleft())
                elif time.perf_counter() < deadline:
                    self._wait(running, deadline)
                else:
                    return
        finally:
            self._cancel([future for _, future in tasks])

    def _wanted(self) -> int:
        """How many tasks to keep submitted."""
        try:
            threads: int = sum(self.client.nthreads().values())
        except OSError:
            raise self._lost() from None
        return max(AHEAD * threads, LEAST_AHEAD)

    def _submit(self, number: int, batch: str, deadline: float) -> dask.Future:
        seconds = None if deadline == float("inf") else max(deadline - time.perf_counter(), 1e-3)
        key = f"{self.what}-{batch}-{number}"
        return self.client.submit(self.function, number, seconds, key=key, priority=-number)

    def _wait(self, running: list[dask.Future], deadline: float) -> None:
        """Until a task has ended, or it is time to look for other workers."""
        import dask.distributed as dask

        seconds = min(ASK_SECONDS, max(deadline - time.perf_counter(), 0.0))
        try:
            with self.client.as_current():  # of several clients, it would ask another for what this one submitted
                dask.wait(running, timeout=seconds, return_when="FIRST_COMPLETED")
        except dask.TimeoutError:
            pass
        except dask.CancelledError:
            raise self._lost() from None

    def _result(self, number: int, future: dask.Future) -> T:
        import dask.distributed as dask

        try:
            found: T = future.result()
        except GraspAtlasError:
            raise
        except dask.CancelledError:
            raise self._lost() from None
        except dask.KilledWorker as error:
            raise GraspAtlasError(
                f"{self.what} {number} was given up after {error.allowed_failures + 1} workers died one after another "
                f"while they computed it, the last {error.last_worker.address}; look for the reason in their logs, "
                "perhaps they have too little memory"
            ) from None
        except Exception as error:
            raise GraspAtlasError(
                f"{self.what} {number} failed on a worker ({type(error).__name__}: {error}); scheduler and workers "
                "need the versions of graspatlas, Python and Dask that this machine has, and the modules of functions "
                "of yours"
            ) from None
        return found

    def _cancel(self, futures: list[dask.Future]) -> None:
        if futures and self.client.status == "running":
            self.client.cancel(futures)

    def _lost(self) -> GraspAtlasError:
        return GraspAtlasError(
            f"the Dask scheduler went away, or somebody cancelled the {self.what}s; start it again, and then this"
        )
