"""The one exception of the package, and help with names that do not exist."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Sequence
from itertools import accumulate

from graspatlas._core import GraspAtlasError

__all__ = ["GraspAtlasError", "unknown_name"]

#: Most names that a message lists, and their letters.
MOST_NAMES, MOST_LETTERS = 40, 400


def _listed(names: Sequence[str]) -> str:
    """The first of the names, as many as can be read, and how many more there are."""
    lengths = accumulate(len(name) + 2 for name in names[:MOST_NAMES])
    shown = max(sum(length <= MOST_LETTERS for length in lengths), 1)
    more = len(names) - shown
    return ", ".join(names[:shown]) + (f" and {more} more" if more > 0 else "")


def unknown_name(kind: str, name: object, known: Iterable[str], place: str = "") -> GraspAtlasError:
    """Error for a name that is not known, with the nearest one that is.

    Args:
        kind: What the name should name, such as ``"frame"``.
        name: What came.
        known: The names that exist.
        place: Where it was looked for, such as ``"in hand 'schunk_sah'"``.

    Returns:
        The error, to be raised by the caller.
    """
    names = sorted(known)
    near = difflib.get_close_matches(str(name), names, n=1, cutoff=0.5)
    near = near or [known_name for known_name in names if len(str(name)) > 2 and str(name) in known_name]
    where = f"not {place}" if place else "unknown"
    listed = _listed(names)
    hint = f"did you mean '{near[0]}'?" if near else f"known: {listed or 'none'}"
    shown = " ".join(str(name).split())[:80]
    return GraspAtlasError(f"{kind} '{shown}' is {where}; {hint}")
