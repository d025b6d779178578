"""A local optimiser from many starts against the atlas: the paper's claim, tested against a strong opponent.

The climbs stay on the manifold and start from grasps, which is more than the local methods have that the paper speaks
of: those must find the contacts first, as :mod:`graspatlas.reproduce.box_starts` does.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from graspatlas.analysis.climb import Climb, climb
from graspatlas.analysis.peaks import peaks_of
from graspatlas.reproduce.report import Number
from graspatlas.result.result import Result
from graspatlas.support.progress import counted

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
        unbounded: How many ran after an index that grows without bound.
    """

    result: Result
    climbs: list[Climb]
    from_best: Climb
    at_best: int
    n_others: int
    above: int
    below: int
    given_up: int
    unbounded: int

    @property
    def rate(self) -> float:
        """Share of the climbs that ended at the peak of the best chart."""
        return self.at_best / len(self.climbs)

    @property
    def starts_needed(self) -> float:
        """After how many starts one has ended there with a chance of 95 %."""
        if self.at_best in (0, len(self.climbs)):
            return 1.0 if self.at_best else np.inf
        return float(np.ceil(np.log(0.05) / np.log(1.0 - self.rate)))

    @property
    def at_others(self) -> int:
        """How many ended at other peaks."""
        return len(self.climbs) - self.at_best

    @property
    def sentence(self) -> str:
        """The outcome in words."""
        n = len(self.climbs)
        words = (
            f"Of {n} climbs on the manifold from random grasps of the atlas {self.at_best} ({100 * self.rate:.0f} %) "
            f"ended where the climb from the best chart ended, and {self.at_others} at {self.n_others} other places; "
            f"{self.below} ({100 * self.below / n:.0f} %) ended below the value at the best chart of the atlas."
        )
        if self.unbounded:
            words += f" {self.unbounded} ran after the index where it grows without bound, so that there is no maximum."
        elif np.isfinite(self.starts_needed) and self.at_others:
            words += (
                f" So this local method, started again and again, gets there too: after {self.starts_needed:.0f} "
                "starts with a chance of 95 %. What it does not tell is that nothing better exists."
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
            ("share that ended at the global best [%]", 100.0 * self.rate),
            ("local searches that ended elsewhere", self.at_others),
            ("places other than the global best where they ended", self.n_others),
            ("local searches that ended below the best chart", self.below),
            ("local searches that ended above the climb from the best chart", self.above),
            ("local searches given up, still climbing", self.given_up),
            ("local searches on an index that grows without bound", self.unbounded),
            ("index at the end of the climb from the best chart", self.from_best.quality),
        )
        return [Number(run, quantity, None, value) for quantity, value in rows]


def study(result: Result, label: str, *, progress: bool = True) -> Study:
    """Climb from random charts that meet the requirements, and from the best one.

    Charts are about equally large, so that random ones are random grasps of the manifold.

    Args:
        result: The result.
        label: What stands beside the progress bar.
        progress: Show the bar on standard error.
    """
    charts = result.candidates()
    count = min(STARTS, len(charts))
    starts = np.random.default_rng(SEED).choice(charts, count, replace=False)
    climbs = [climb(result, int(chart), max_steps=MAX_STEPS) for chart in counted(starts, label, "climbs", progress)]
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
        below=int((ends < result.best.quality).sum()),
        given_up=sum(not c.converged and not c.unbounded for c in climbs),
        unbounded=sum(c.unbounded for c in climbs),
    )
