"""The progress bar: on standard error, where that is a terminal or it was asked for, after a second of work."""

from __future__ import annotations

import sys
import threading
from collections.abc import Collection, Iterator
from typing import TypeVar

from tqdm import tqdm

__all__ = ["QUIET_SECONDS", "counted", "is_shown", "progress_bar"]

T = TypeVar("T")

#: Work that ends within this shows no progress bar [s].
QUIET_SECONDS = 1.0
#: Time between two states of the bar on a terminal, and in a file, where each makes a line [s].
TERMINAL_INTERVAL, FILE_INTERVAL = 0.1, 10.0


class _Bar(tqdm):  # type: ignore[misc]
    """A bar of this process alone: tqdm's lock is one among processes, which a worker that is killed leaves behind."""


_Bar.set_lock(threading.RLock())


def is_shown(progress: bool | None) -> bool:
    """Whether progress is shown: as it was asked for, or by default when standard error is a terminal."""
    return sys.stderr.isatty() if progress is None else progress


def progress_bar(
    what: str, unit: str = "it", total: int | None = None, progress: bool | None = None, initial: int = 0
) -> tqdm[None]:
    """A progress bar.

    Args:
        what: What is done, before the bar.
        unit: What is counted.
        total: How many of them there are; None where that is not known.
        progress: Show it; by default when standard error is a terminal.
        initial: How many are done.
    """
    return _Bar(
        total=total,
        desc=what,
        unit=unit if unit == "it" else f" {unit}",
        initial=initial,
        disable=not is_shown(progress),
        delay=QUIET_SECONDS,
        file=sys.stderr,
        mininterval=TERMINAL_INTERVAL if sys.stderr.isatty() else FILE_INTERVAL,
    )


def counted(items: Collection[T], what: str, unit: str = "it", progress: bool | None = None) -> Iterator[T]:
    """Items one by one, with a progress bar over them."""
    with progress_bar(what, unit, len(items), progress) as bar:
        for item in items:
            yield item
            bar.update()
