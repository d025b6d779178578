"""Where the growth of an atlas is cut short, and on how many threads it runs: as users state it, and checked."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypedDict

from graspatlas.support.deadlines import deadline_after
from graspatlas.support.machine import available_bytes, available_threads
from graspatlas.support.validation import check_keywords, positive, whole

__all__ = ["LimitOptions", "Limits"]

#: Stands for no limit of charts.
NO_LIMIT = 2**62
#: Most threads that may be asked for: no machine has more cores.
MOST_THREADS = 4096
#: More than so many threads a core, and than so many in all, are not started: they would only wait for one another.
THREADS_A_CORE, ALWAYS_ALLOWED = 4, 32


class LimitOptions(TypedDict, total=False):
    """The keywords with which :func:`graspatlas.build_atlas`, `optimize` and `find_components` are limited.

    Attributes:
        max_charts: Number of charts after which an atlas is cut short; none by default.
        max_seconds: Time after which the work is cut short; none by default.
        max_bytes: Memory of an atlas, with the arrays made of it, beyond which it is cut short; by default four
            fifths of what the machine (or the container) has free.
        threads: Threads that work at the same time; all cores by default. A system written in Python has one.
    """

    max_charts: int | None
    max_seconds: float | None
    max_bytes: float | None
    threads: int | None


@dataclass(frozen=True)
class Limits:
    """Where an atlas is cut short.

    Attributes:
        charts: Number of charts.
        deadline: Time by ``time.perf_counter`` [s].
        memory: Of the atlas with the arrays made of it [bytes].
        threads: Threads to start.
        seconds_each: Time that is to be left for each chart at the deadline, to read it [s].
    """

    charts: int
    deadline: float
    memory: float
    threads: int
    seconds_each: float = 0.0

    @classmethod
    def of(cls, options: LimitOptions, function: str) -> Limits:
        """The limits that options state; the time counts from now.

        Args:
            options: The options.
            function: What they were given to, for the message.

        Raises:
            GraspAtlasError: If a limit makes no sense.
            TypeError: If there is no such option.
        """
        check_keywords(options, LimitOptions.__annotations__, function)
        charts, memory, threads = (options.get("max_charts"), options.get("max_bytes"), options.get("threads"))
        return cls(
            charts=NO_LIMIT if charts is None else min(whole(charts, "max_charts"), NO_LIMIT),
            deadline=deadline_after(options.get("max_seconds")),
            memory=available_bytes() if memory is None else positive(memory, "max_bytes"),
            threads=_threads(threads),
        )


def _threads(threads: int | None) -> int:
    if threads is None:
        return available_threads()
    return min(whole(threads, "threads", most=MOST_THREADS), max(ALWAYS_ALLOWED, THREADS_A_CORE * available_threads()))
