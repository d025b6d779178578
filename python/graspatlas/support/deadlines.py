"""When work that may only take so long has to end."""

from __future__ import annotations

import time

from graspatlas.support.validation import positive

__all__ = ["deadline_after", "seconds_until"]


def deadline_after(max_seconds: float | None) -> float:
    """Reading of ``time.perf_counter`` after so many seconds [s]; infinite for None.

    Raises:
        GraspAtlasError: If the seconds are not a positive number.
    """
    return float("inf") if max_seconds is None else time.perf_counter() + positive(max_seconds, "max_seconds")


def seconds_until(deadline: float, least: float = 0.0) -> float | None:
    """Time that is left until a deadline [s], at least `least`; None where there is no deadline."""
    return None if deadline == float("inf") else max(deadline - time.perf_counter(), least)
