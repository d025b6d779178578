"""Words of the command line that argparse turns into what they mean, or refuses."""

from __future__ import annotations

import argparse
from pathlib import Path

__all__ = ["path_word"]


def path_word(word: str) -> Path:
    """A path; an empty word, as an unset variable of the shell leaves it, is none.

    Raises:
        argparse.ArgumentTypeError: If it is empty.
    """
    if not word:
        raise argparse.ArgumentTypeError("the path is empty; name a place, or leave the option out")
    return Path(word)
