"""Words that stand for one of a few things, such as how a run ended."""

from __future__ import annotations

from enum import Enum

__all__ = ["Word"]


class Word(str, Enum):
    """Base of such words: each is text, and prints as it reads."""

    def __str__(self) -> str:
        return str(self.value)
