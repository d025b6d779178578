"""A local optimiser from many starts against the atlas: the paper's claim, tested."""

from __future__ import annotations

import sys
from dataclasses import dataclass

import numpy as np
from tqdm import tqdm

from graspatlas.local_search import Climb, climb, peaks_of
from graspatlas.reproduce.report import Number
from graspatlas.result import Result

__all__ = ["MAX_STEPS", "SEED", "STARTS", "Study", "study"]

#: Random charts from which the local optimiser starts, and the seed that draws them.
STARTS = 200
SEED = 20110627
#: Steps after which a climb is given up.
MAX_STEPS = 100


@dataclass(frozen=True, eq=False)
class Study:
    """What became of the climbs from random charts.

    Attributes:
        result: The result on which they climbed.
        climbs: The climbs.
        from_best: One more climb, from the best chart.
        at_best: How many ended at the peak at which that one ended.
        n_others: Number of other peaks.
        above: How many ended above the peak of the best chart, at a peak that the atlas did not see.
        below: How many ended below the index at the best chart.
        given_up: How many were still climbing after the largest number of steps.
    """

    result: Result
    climbs: list[Climb]
    from_best: Climb
    at_best: int
    n_others: int
    above: int
    below: int
    given_up: int

    @property
    def at_others(self) -> int:
        """How many ended at other peaks."""
        return len(self.climbs) - self.at_best

    @property
    def sentence(self) -> str:
        """The outcome in words."""
        n = len(self.climbs)
        words = (
            f"Of {n} climbs from random charts {self.at_best} ({100 * self.at_best / n:.0f} %) ended where the climb "
            f"from the best chart ended, and {self.at_others} at {self.n_others} other places; {self.below} "
            f"({100 * self.below / n:.0f} %) ended below the value at the best chart of the atlas."
        )
        if self.given_up:
            words += f" {self.given_up} were given up, still climbing, after {MAX_STEPS} steps."
        if self.above:
            words += f" {self.above} ended higher than the climb from the best chart."
        return words

    def numbers(self, run: str) -> list[Number]:
        """The outcome in numbers."""
        rows = (
            ("local searches from random charts", len(self.climbs)),
            ("local searches that ended at the global best", self.at_best),
            ("local searches that ended elsewhere", self.at_others),
            ("places other than the global best where they ended", self.n_others),
            ("local searches that ended below the best chart", self.below),
            ("local searches that ended above the climb from the best chart", self.above),
            ("local searches given up, still climbing", self.given_up),
            ("index at the end of the climb from the best chart", self.from_best.quality),
        )
        return [Number(run, quantity, None, value) for quantity, value in rows]


def study(result: Result, label: str, *, progress: bool = True) -> Study:
    """Climb from random charts, and from the best one.

    Args:
        result: The result.
        label: What stands beside the progress bar.
        progress: Show the bar on standard error.
    """
    count = min(STARTS, result.atlas.n_charts)
    starts = np.random.default_rng(SEED).choice(result.atlas.n_charts, count, replace=False)
    bar = tqdm(starts, desc=label, unit=" climbs", disable=not progress, file=sys.stderr, leave=False)
    climbs = [climb(result, int(chart), max_steps=MAX_STEPS) for chart in bar]
    from_best = climb(result, result.best.chart, max_steps=MAX_STEPS)
    peaks = peaks_of(result, [*climbs, from_best])
    home = next(peak for peak in peaks if count in peak.climbs)
    ends = np.array([c.quality for c in climbs])
    elsewhere = ~np.isin(np.arange(count), home.climbs)
    return Study(
        result=result,
        climbs=climbs,
        from_best=from_best,
        at_best=int(count - elsewhere.sum()),
        n_others=len(peaks) - 1,
        above=int((elsewhere & (ends > from_best.quality)).sum()),
        below=int((ends < result.qualities.max()).sum()),
        given_up=sum(not c.converged for c in climbs),
    )
