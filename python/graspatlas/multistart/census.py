"""The maxima that climbs have found so far, how often each, and what share of climbs may lead to others."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from graspatlas.multistart.rounds import Round, RoundKind
from graspatlas.support.arrays import Array

__all__ = ["Census", "FoundPeak"]

#: Ends of climbs are one maximum where their indices differ by less than this share, or they are nearer to each other
#: than this [units of the tangent space].
SAME_INDEX, SAME_PLACE = 1e-4, 0.05


@dataclass(eq=False)
class FoundPeak:
    """A place at which climbs ended.

    Attributes:
        x: Where the best of them ended, one that has converged if any has [configuration_size].
        place: The same in the space in which distances are Euclidean.
        value: The index there.
        kkt: Residual of the conditions of optimality there.
        converged: Whether it is a local maximum, by that.
        hits: Climbs that ended there.
    """

    x: Array
    place: Array
    value: float
    kkt: float
    converged: bool
    hits: int = 0

    def take(self, x: Array, place: Array, value: float, kkt: float, converged: bool) -> None:
        """Count a climb that ended here."""
        self.hits += 1
        higher = value > self.value + SAME_INDEX * abs(self.value)
        if higher or (converged, value) > (self.converged, self.value):
            self.x, self.place, self.value, self.kkt, self.converged = x, place, value, kkt, converged


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
        for i in np.flatnonzero(new.met).tolist():
            self._take(new.x[i], float(new.value[i]), float(new.kkt[i]), bool(new.converged[i]))
        if self.met:
            self.least_missed = None
        elif len(new.x):
            i = int(new.missed.argmin())
            if self.least_missed is None or new.missed[i] < self.least_missed[0]:
                self.least_missed = float(new.missed[i]), new.x[i]

    def _take(self, x: Array, value: float, kkt: float, converged: bool) -> None:
        place = np.asarray(self._embed(x))
        for peak in self.peaks:
            near = abs(peak.value - value) <= SAME_INDEX * max(abs(value), 1e-12)
            if near or np.linalg.norm(peak.place - place) <= SAME_PLACE:
                peak.take(x, place, value, kkt, converged)
                return
        self.peaks.append(FoundPeak(x, place, value, kkt, converged, hits=1))

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
