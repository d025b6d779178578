"""Text for a terminal: names that come from files cannot steer it, and output that cannot be written is an error."""

from __future__ import annotations

import os
import re
import sys
import unicodedata
from typing import TYPE_CHECKING

from graspatlas.errors import GraspAtlasError

if TYPE_CHECKING:
    from _typeshed import SupportsWrite

__all__ = ["finish_output", "printable", "say", "shortened", "silence_output"]

#: Words that are longer are shortened in messages [characters].
LONGEST_WORD = 300
#: Unicode categories of what is no letter, digit or sign: control codes, directions of writing, lone surrogates, lines.
_CONTROL = ("Cc", "Cf", "Cs", "Zl", "Zp")


def printable(text: object) -> str:
    r"""A text in which control codes stand as what Python writes for them, such as ``\x1b``; in one line.

    Args:
        text: The text, or what has one.
    """
    plain = str(text)
    if plain.isprintable():
        return plain
    return "".join(
        letter.encode("unicode_escape").decode("ascii") if unicodedata.category(letter) in _CONTROL else letter
        for letter in plain
    )


def shortened(text: str) -> str:
    """A text whose words of hundreds of letters, such as paths that are none, lack their middle."""
    return re.sub(rf"\S{{{LONGEST_WORD},}}", lambda word: f"{word[0][:80]}...{word[0][-20:]}", text)


def say(*lines: object, file: SupportsWrite[str] | None = None, end: str = "\n") -> None:
    """Print lines, each made printable; on standard output by default.

    Letters that the terminal's encoding lacks are written as escapes.

    Args:
        *lines: The lines; only a text's own line ends part it when it is given alone.
        file: Such as ``sys.stderr``.
        end: What comes after the last one.

    Raises:
        GraspAtlasError: If standard output cannot be written, as on a full disk; BrokenPipeError passes.
    """
    parts = str(lines[0]).split("\n") if len(lines) == 1 else lines
    text = "\n".join(map(printable, parts))
    stream = sys.stdout if file is None else file
    encoding = getattr(stream, "encoding", None) or "utf-8"
    try:
        print(text.encode(encoding, "backslashreplace").decode(encoding), file=stream, end=end)
    except BrokenPipeError:
        raise
    except OSError as error:
        if file is None:
            raise _unwritable(error) from None


def finish_output() -> None:
    """Write what standard output still holds.

    Raises:
        GraspAtlasError: If it cannot be written, as on a full disk; BrokenPipeError passes.
    """
    try:
        if sys.stdout is not None:
            sys.stdout.flush()
    except BrokenPipeError:
        raise
    except OSError as error:
        raise _unwritable(error) from None


def silence_output() -> None:
    """Let the rest of standard output go nowhere, so that nothing fails when the program ends."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, sys.stdout.fileno())
    os.close(nowhere)


def _unwritable(error: OSError) -> GraspAtlasError:
    silence_output()
    return GraspAtlasError(
        f"cannot write to standard output: {error.strerror or error}; make room there, or send it elsewhere"
    )
