"""Ctrl-C: the first ends the work at once, and what there is then is put together and kept, whatever else is pressed.

Inside :func:`stoppable` the first signal raises ``KeyboardInterrupt``, as always in Python. Signals within
``SAME_PRESS`` of it are the same press. A later one, while what there is is put together, is answered on standard error
and does nothing else; the one after that raises again, and that work is given up.

Handlers are installed in the main thread only, only in place of Python's own, and taken away when the block ends.
"""

from __future__ import annotations

import _thread
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from types import FrameType
from typing import TypeAlias

__all__ = ["SAME_PRESS", "hear", "held", "keeping", "stoppable", "stopped_by", "stopping"]

#: What Python calls on a signal: a function, or a word for doing nothing, or the usual thing.
Handler: TypeAlias = "Callable[[int, FrameType | None], object] | int | signal.Handlers | None"

#: Signals that come so soon after one that was heard are the same press of a key [s].
SAME_PRESS = 0.4
#: A signal that came where nothing can be raised comes again after this [s].
SOON = 0.01


class _Watch:
    """The signals of one outermost block."""

    def __init__(self) -> None:
        self.presses = 0
        self.last = float("-inf")
        self.number = 0
        self.holding = 0
        self.pending = False

    def hear(self, number: int, frame: FrameType | None) -> None:
        """The handler; it runs between two steps of Python's main thread."""
        if _is_swallowing(frame):
            threading.Timer(SOON, _thread.interrupt_main, (number,)).start()
            return
        now = time.monotonic()
        if now - self.last < SAME_PRESS:
            return
        self.presses += 1
        self.last = now
        self.number = self.number or number
        if self.presses == 2:
            _say("already stopping, and keeping what there is; once more leaves without it")
        elif self.holding and self.presses == 1:
            self.pending = True
        else:
            self.pending = False
            raise self.interruption()

    def interruption(self) -> KeyboardInterrupt:
        """What is raised; its attribute ``signal`` is the number of the first signal."""
        error = KeyboardInterrupt()
        setattr(error, "signal", self.number)  # noqa: B010  (its type has no such attribute)
        return error

    def settle(self) -> None:
        """Let a second press of an impatient hand pass, so that it does not hit what comes after."""
        left = self.last + SAME_PRESS - time.monotonic()
        if left > 0.0:
            time.sleep(left)


_watch: _Watch | None = None


def stopping() -> bool:
    """True in the main thread when a signal has asked the work inside the outermost block to end."""
    return _watch is not None and _watch.presses > 0 and _in_main_thread()


def stopped_by() -> int:
    """Number of the signal that asked it; 0 for none."""
    return _watch.number if stopping() and _watch is not None else 0


@contextmanager
def stoppable(also: Sequence[signal.Signals] = ()) -> Iterator[None]:
    """A block that the first Ctrl-C stops and that a second does not keep from saving; inside another, part of that.

    Args:
        also: Signals that do what Ctrl-C does, where nobody else handles or ignores them; for programs only.
    """
    global _watch
    if _watch is not None or not _in_main_thread():
        yield
        return
    watch = _Watch()
    theirs: dict[int, Handler] = {}
    try:
        usual: dict[int, Handler] = {signal.SIGINT: signal.default_int_handler, **dict.fromkeys(also, signal.SIG_DFL)}
        for number, own in usual.items():
            if signal.getsignal(number) == own:
                theirs[number] = signal.signal(number, watch.hear)
        if theirs:
            _watch = watch
        yield
        hear()
    finally:
        watch.settle()
        _watch = None
        for number, handler in theirs.items():
            if signal.getsignal(number) == watch.hear:
                signal.signal(number, handler)


@contextmanager
def held() -> Iterator[None]:
    """A short block that a first signal does not break off; :func:`hear` it after the block."""
    watch = _watch if _in_main_thread() else None
    if watch is None:
        yield
        return
    watch.holding += 1
    try:
        yield
    finally:
        watch.holding -= 1


def hear() -> None:
    """Raise ``KeyboardInterrupt`` if a signal came in a block that held it; else the outermost block's end does."""
    if _watch is not None and _in_main_thread() and _watch.pending and not _watch.holding:
        _watch.pending = False
        raise _watch.interruption()


@contextmanager
def keeping(**kept: object) -> Iterator[None]:
    """Let an error that leaves the block carry what took long to make, as attributes of these names.

    Args:
        **kept: What to keep. With a name that the error has already, from an inner block, the inner one stays.
    """
    try:
        yield
    except (Exception, KeyboardInterrupt) as error:
        new = {name: value for name, value in kept.items() if not hasattr(error, name)}
        for name, value in new.items():
            setattr(error, name, value)
        add_note: Callable[[str], None] | None = getattr(error, "add_note", None)  # since Python 3.11
        if new and add_note:
            add_note(f"What took long to make is not lost: see this error's {' and '.join(new)}.")
        raise


def _is_swallowing(frame: FrameType | None) -> bool:
    """Whether a signal came where Python does not pass on what is raised.

    It ignores what the callback raises by which imports give locks back, and makes a ``RuntimeError`` of what a
    ``__set_name__`` raises while a class is made (before version 3.12).
    """
    code = frame.f_code if frame else None
    if code is not None and (code.co_name, code.co_filename) == ("cb", "<frozen importlib._bootstrap>"):
        return True
    while frame is not None and frame.f_code.co_name != "__set_name__":
        frame = frame.f_back
    return frame is not None


def _in_main_thread() -> bool:
    return threading.current_thread() is threading.main_thread()


def _say(text: str) -> None:
    """Write a line to standard error, past its buffer: a handler may run in the middle of another write."""
    with suppress(AttributeError, OSError, ValueError):
        os.write(sys.stderr.fileno(), f"\n{text}\n".encode())
