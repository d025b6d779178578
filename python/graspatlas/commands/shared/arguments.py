"""Words of the command line, turned into what they mean or refused; and exit statuses, of which 0 is success."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from graspatlas.errors import GraspAtlasError
from graspatlas.support.validation import shown

if TYPE_CHECKING:
    from graspatlas.result.result import Result

__all__ = ["FAILED", "INTERRUPTED", "MISUSE", "Subcommands", "chart_named", "path_word"]

#: Exit status where no grasp meets the requirements, or a check fails.
FAILED = 1
#: That of wrong input.
MISUSE = 2
#: That of Ctrl-C, as shells report it.
INTERRUPTED = 130

#: Number of a chart [digits].
LONGEST_NUMBER = 18

#: What the commands are added to.
Subcommands: TypeAlias = "argparse._SubParsersAction[argparse.ArgumentParser]"


def path_word(word: str) -> Path:
    """A path; an empty word, as an unset variable of the shell leaves it, is none.

    Raises:
        argparse.ArgumentTypeError: If it is empty.
    """
    if not word:
        raise argparse.ArgumentTypeError("the path is empty; name a place, or leave the option out")
    return Path(word)


def chart_named(result: Result, name: str) -> int:
    """The chart that a word names."""
    if name == "first":
        return 0
    if name in ("best", "worst"):
        return int(getattr(result, name).chart)
    if name == "nearest":
        return int((result.nearest or result.best).chart)
    if name.isascii() and name.isdigit() and len(name) <= LONGEST_NUMBER:
        return int(name)
    raise GraspAtlasError(
        f"{shown(name)} names no grasp; give the number of a chart, 0 to {result.atlas.n_charts - 1}, or first, best, "
        "worst or nearest"
    )
