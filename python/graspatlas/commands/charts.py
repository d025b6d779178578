"""Words that name a chart of a result."""

from __future__ import annotations

from graspatlas.errors import GraspAtlasError
from graspatlas.result.result import Result
from graspatlas.support.validation import shown

__all__ = ["chart_named"]

#: Number of a chart [digits].
LONGEST_NUMBER = 18


def chart_named(result: Result, name: str) -> int:
    """The chart that a word names."""
    if name == "first":
        return 0
    if name in ("best", "worst"):
        return int(getattr(result, name).chart)
    if name.isascii() and name.isdigit() and len(name) <= LONGEST_NUMBER:
        return int(name)
    raise GraspAtlasError(f"{shown(name)} names no grasp; give the number of a chart, or first, best or worst")
