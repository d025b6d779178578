"""Ctrl-C while the package is imported: the program graspatlas ends at once, without a traceback.

It is imported first; everything else takes a second. Programs that import the package keep their own handling.
"""

from __future__ import annotations

import os
import signal
import sys
import threading

__all__ = ["hear_interrupts", "is_command", "started_as_program"]

_PROGRAM = "graspatlas"


def started_as_program() -> bool:
    """True in ``graspatlas`` and ``python -m graspatlas``, false in programs that import the package."""
    words: list[str] = getattr(sys, "argv", None) or [""]
    if words[0] == "-m":  # Python is looking for the module
        after = [word for flag, word in zip(sys.orig_argv, sys.orig_argv[1:], strict=False) if flag == "-m"]
        return after[:1] == [_PROGRAM] or after[:1] == [f"{_PROGRAM}.cli"]
    return os.path.splitext(os.path.basename(words[0]))[0] == _PROGRAM


def is_command(name: str) -> bool:
    """True when this is the program and was started for one of its commands."""
    return started_as_program() and list(getattr(sys, "argv", None) or [])[1:2] == [name]


def _end_at_once() -> bool:
    """Let Ctrl-C end the process, as it ends those that do not handle it: shells then report status 130.

    Returns:
        Whether that was changed.
    """
    ours = threading.current_thread() is threading.main_thread() and started_as_program()
    if not ours or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        return False
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return True


def hear_interrupts() -> None:
    """Let Ctrl-C raise KeyboardInterrupt again, as soon as somebody waits for it."""
    if _CHANGED and signal.getsignal(signal.SIGINT) is signal.SIG_DFL:
        signal.signal(signal.SIGINT, signal.default_int_handler)


#: Python names another program once the module of ``python -m`` is found, so this is asked once.
_CHANGED = _end_at_once()
