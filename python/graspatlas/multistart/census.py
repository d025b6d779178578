"""The maxima that climbs have found so far, how often each, and what share of climbs may lead to others."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from graspatlas.multistart.rounds import Round, RoundKind
from graspatlas.support.arrays import Array

__all__ = ["Census", "FoundPeak"]

#: Ends of climbs are one maximum where their indices differ by less than this share, or they are nearer to each other
#: than this [units of the tangent space].
SAME_INDEX, SAME_PLACE = 1e-4, 0.05
#: Of these one is as high as another where they differ by less than this share.
AS_HIGH = 1e-5


@dataclass(frozen=True, eq=False)
class FoundPeak:
    """A place at which climbs ended.

    Attributes:
        x: Where the best of them ended, one that has converged if any has [configuration_size].
        place: The same in the space in which distances are Euclidean.
        value: The index there.
        kkt: Residual of the conditions of optimality there.
        converged: Whether it is a local maximum, by that.
        stalled: Whether it is none, but no smaller step gained anything.
        hits: Climbs that ended there.
    """

    x: Array
    place: Array
    value: float
    kkt: float
    converged: bool
    stalled: bool
    hits: int = 1

    def is_where(self, other: FoundPeak) -> bool:
        """Whether two ends are at one maximum."""
        near = abs(self.value - other.value) <= SAME_INDEX * max(abs(other.value), 1e-12)
        return near or bool(np.linalg.norm(self.place - other.place) <= SAME_PLACE)

    def stands_for(self, other: FoundPeak) -> bool:
        """Whether this end tells more than another of the same maximum: it is higher, or as high and has converged."""
        if abs(self.value - other.value) > AS_HIGH * abs(other.value):
            return self.value > other.value
        return (self.converged, self.value) > (other.converged, other.value)


class Census:
    """What rounds of climbs have found.

    Attributes:
        peaks: Places at which climbs ended, in the order in which they were found.
        climbs: Climbs in all.
        met: How many of them ended at grasps that meet the requirements.
        tries: Random starts that were tried at grasps.
        least_missed: By how much the end that is nearest to meeting the requirements misses them, and that end; None
            once a climb has met them.

    Args:
        embed: Of the system, see :class:`graspatlas.AnySystem`.
    """

    def __init__(self, embed: Callable[[Array], Array]) -> None:
        self._embed = embed
        self.peaks: list[FoundPeak] = []
        self.climbs = self.met = self.tries = 0
        self._counted = 0
        self.least_missed: tuple[float, Array] | None = None

    def add(self, new: Round) -> None:
        """Count the climbs of a round."""
        self.climbs += len(new.x)
        self.tries += new.tries
        self.met += int(new.met.sum())
        if new.kind is not RoundKind.STATED:
            self._counted += int(new.met.sum())
        for end in _ends(new, self._embed):
            self._take(end)
        if self.met:
            self.least_missed = None
        elif len(new.x):
            i = int(new.missed.argmin())
            if self.least_missed is None or new.missed[i] < self.least_missed[0]:
                self.least_missed = float(new.missed[i]), new.x[i]

    def _take(self, end: FoundPeak) -> None:
        for i, peak in enumerate(self.peaks):
            if peak.is_where(end):
                hits = peak.hits + 1
                self.peaks[i] = replace(end if end.stands_for(peak) else peak, hits=hits)
                return
        self.peaks.append(end)

    def improve(self, new: Round) -> None:
        """Let ends of more climbs from around the best stand for it, without counting them."""
        best = self.best
        for end in _ends(new, self._embed):
            if best is not None and best.is_where(end) and end.stands_for(best):
                improved = replace(end, hits=best.hits)
                self.peaks[self.peaks.index(best)] = best = improved

    @property
    def best(self) -> FoundPeak | None:
        """The highest; None where nothing was found."""
        return max(self.peaks, key=lambda peak: peak.value, default=None)

    def ranked(self) -> list[FoundPeak]:
        """The places, the highest first."""
        return sorted(self.peaks, key=lambda peak: -peak.value)

    @property
    def share_missing(self) -> float:
        """Expected share of climbs that end at maxima not found yet; 1 before anything can be said.

        Starts that were stated do not count: they are no sample.
        """
        w, n = len(self.peaks), self._counted
        return min(1.0, w * (w + 1) / (n * (n - 1))) if n > 1 else 1.0


def _ends(new: Round, embed: Callable[[Array], Array]) -> Iterator[FoundPeak]:
    """The ends of a round that meet the requirements."""
    for i in np.flatnonzero(new.met).tolist():
        yield FoundPeak(
            x=new.x[i],
            place=np.asarray(embed(new.x[i])),
            value=float(new.value[i]),
            kkt=float(new.kkt[i]),
            converged=bool(new.converged[i]),
            stalled=bool(new.stalled[i]),
        )
