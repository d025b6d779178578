"""The progress bar: on standard error, where that is a terminal or it was asked for, after a second of work."""

from __future__ import annotations

import sys
import time
from collections.abc import Collection, Iterator
from types import TracebackType
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from tqdm import tqdm

__all__ = ["QUIET_SECONDS", "ProgressBar", "counted", "is_shown", "progress_bar"]

T = TypeVar("T")

#: Work that ends within this shows no progress bar [s].
QUIET_SECONDS = 1.0
#: Time between two states of the bar on a terminal, and in a file, where each makes a line [s].
TERMINAL_INTERVAL, FILE_INTERVAL = 0.1, 10.0


def is_shown(progress: bool | None) -> bool:
    """Whether progress is shown: as it was asked for, or by default when standard error is a terminal."""
    return sys.stderr.isatty() if progress is None else progress


class ProgressBar:
    """A bar of tqdm that appears, and is imported, when the work has taken a second.

    Attributes:
        total: How many there are to do; None where that is not known.
        n: How many are done.
        shown: Whether there will be a bar.
    """

    def __init__(self, what: str, unit: str, total: int | None, shown: bool, initial: int) -> None:
        self.total, self.n, self.shown = total, initial, shown
        self._what, self._unit, self._initial = what, unit if unit == "it" else f" {unit}", initial
        self._start = time.time()
        self._note = ""
        self._bar: tqdm[None] | None = None

    def __enter__(self) -> ProgressBar:
        return self

    def __exit__(self, kind: type[BaseException] | None, value: object, traceback: TracebackType | None) -> None:
        self.close()

    def update(self, count: int = 1) -> None:
        """So many more are done."""
        self.n += count
        if self._bar is None and self.shown and time.time() - self._start > QUIET_SECONDS:
            self._bar = self._open()
        elif self._bar is not None:
            self._bar.total = self.total
            self._bar.update(count)

    def note(self, text: str) -> None:
        """What stands behind the bar from its next state on."""
        self._note = text
        if self._bar is not None:
            self._bar.set_postfix_str(text, refresh=False)

    def write(self, text: str) -> None:
        """A line of its own, above the bar."""
        if self._bar is not None:
            self._bar.write(text, file=sys.stderr)
        else:
            print(text, file=sys.stderr)

    def close(self) -> None:
        """Leave the bar as it is."""
        if self._bar is not None:
            self._bar.close()

    def _open(self) -> tqdm[None]:
        from tqdm import tqdm  # slow to import

        bar = tqdm(
            total=self.total,
            desc=self._what,
            unit=self._unit,
            initial=self._initial,
            file=sys.stderr,
            mininterval=TERMINAL_INTERVAL if sys.stderr.isatty() else FILE_INTERVAL,
            delay=QUIET_SECONDS,
        )
        bar.start_t = bar.last_print_t = self._start  # as if it had been there from the start
        bar.set_postfix_str(self._note, refresh=False)
        bar.update(self.n - self._initial)
        return bar


def progress_bar(
    what: str, unit: str = "it", total: int | None = None, progress: bool | None = None, initial: int = 0
) -> ProgressBar:
    """A progress bar.

    Args:
        what: What is done, before the bar.
        unit: What is counted.
        total: How many of them there are; None where that is not known.
        progress: Show it; by default when standard error is a terminal.
        initial: How many are done.
    """
    return ProgressBar(what, unit, total, is_shown(progress), initial)


def counted(items: Collection[T], what: str, unit: str = "it", progress: bool | None = None) -> Iterator[T]:
    """Items one by one, with a progress bar over them."""
    with progress_bar(what, unit, len(items), progress) as bar:
        for item in items:
            yield item
            bar.update()
