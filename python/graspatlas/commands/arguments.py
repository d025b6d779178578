"""Words of the command line that argparse turns into what they mean, or refuses."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TypeAlias

__all__ = ["Subcommands", "path_word"]

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
