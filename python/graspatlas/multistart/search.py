"""The search over all feasible grasps: rounds of climbs until little can be missing, or there is no maximum."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Generator, Iterator
from contextlib import closing
from functools import partial

import numpy as np

from graspatlas.analysis.unbounded import Around, levels_around, never_levels_off, rises_towards_one_point
from graspatlas.errors import GraspAtlasError
from graspatlas.multistart.census import Census, FoundPeak
from graspatlas.multistart.checkpoint import RoundFolder
from graspatlas.multistart.rounds import FIRST_STEP, Plan, Round, RoundKind, Starts, climbed, run_round
from graspatlas.requirements.base import asked
from graspatlas.requirements.rejections import rejections
from graspatlas.result.refinement import Refinement, SearchEnd, SearchReport
from graspatlas.support.arrays import Array
from graspatlas.support.deadlines import deadline_after
from graspatlas.support.interrupts import held, stopping
from graspatlas.support.progress import ProgressBar, progress_bar

__all__ = ["MOST_ROUNDS", "SHARE", "Search", "Source", "nothing_meets", "one_by_one"]

#: Rounds after which a search ends.
MOST_ROUNDS = 150
#: A search ends when climbs such as these end at maxima not found yet with less than this chance, and so many have
#: ended at the best, in at least so many rounds.
SHARE, BEST_HITS, LEAST_ROUNDS = 0.01, 3, 3
#: Rounds without a grasp that meets the requirements after which none is expected.
EMPTY_ROUNDS = 40
#: Climbs from around a maximum that has not converged.
POLISH_CLIMBS = 8

#: Yields the rounds of a plan from a number on, in their order, until it is closed or a reading of
#: ``time.perf_counter`` has passed.
Source = Callable[[Plan, int, float], Generator[Round, None, None]]


def one_by_one(plan: Plan, first: int, deadline: float) -> Generator[Round, None, None]:
    """The rounds of a plan in this process, each on all cores; see :data:`Source`."""
    for number in range(first, MOST_ROUNDS + 1):
        left = deadline - time.perf_counter()
        yield run_round(plan, number, None if left == float("inf") else max(left, 1e-3))


class Search:
    """A search over all feasible grasps.

    Attributes:
        plan: What is maximised.
        census: What it has found.

    Args:
        plan: What is maximised.
        share: The search ends when the expected share of climbs that end at maxima not found yet is at most this; see
            :class:`graspatlas.SearchReport`.
        checkpoint: Folder that keeps the rounds; a search that is begun again goes on after the last.
        progress: Show a progress bar on standard error; by default when it is a terminal.
    """

    def __init__(
        self, plan: Plan, share: float, checkpoint: str | os.PathLike[str] | None, progress: bool | None
    ) -> None:
        self.plan, self.share, self.progress = plan, share, progress
        self.census = Census(plan.objective.system.embed)
        self.folder = None if checkpoint is None else RoundFolder(checkpoint, plan)
        self.rounds = 0
        self._judged: dict[FoundPeak, bool] = {}

    def run(self, starts: Array, max_seconds: float | None, source: Source = one_by_one) -> Refinement | None:
        """The local maxima of the index over all feasible grasps that climbs from many starts find.

        Ctrl-C ends it and keeps what was found.

        Args:
            starts: Grasps to start from before all others [n, configuration_size], such as the best of an atlas.
            max_seconds: Time after which it ends; None for none.
            source: Where the rounds are done.

        Returns:
            What was found, the best first; None where no climb met the requirements, see :func:`nothing_meets`.

        Raises:
            GraspAtlasError: If the checkpoint is of another search or cannot be read or written.
        """
        start = time.perf_counter()
        deadline = deadline_after(max_seconds)
        bar = progress_bar("search", "climbs", progress=self.progress)
        try:
            for kept in self.folder.load() if self.folder else ():
                self._count(kept)
            if self.rounds == 0:
                self._keep(climbed(self.plan, Starts(0, RoundKind.STATED, starts), deadline), deadline)
            bar.update(self.census.climbs)
            with closing(source(self.plan, self.rounds, deadline)) as rounds:
                status = self._follow(rounds, deadline, bar)
        except KeyboardInterrupt:
            status = SearchEnd.INTERRUPTED
        finally:
            with held():
                bar.close()
        with held():
            return self._refinement(status, time.perf_counter() - start)

    def _follow(self, rounds: Iterator[Round], deadline: float, bar: ProgressBar) -> SearchEnd:
        """Count rounds until the search ends; why it does."""
        while True:
            ended = self._ended(deadline)
            if ended is not None:
                return ended
            new = next(rounds, None)
            if new is None:
                return self._ended(deadline) or SearchEnd.ROUNDS
            self._keep(new, deadline)
            bar.update(len(new.x))
            bar.note(self._told())

    def _keep(self, new: Round, deadline: float) -> None:
        """Count a round, and write it to the checkpoint unless its climbs were cut short."""
        if self.folder and time.perf_counter() < deadline:
            with held():
                self.folder.write(new)
        self._count(new)

    def _count(self, new: Round) -> None:
        self.census.add(new)
        self.rounds = new.number + 1

    def _told(self) -> str:
        """What the progress bar says of what was found."""
        best = self.census.best
        if best is None:
            return "none meets the requirements yet"
        missing = f"{self.census.share_missing:.1%} may be missing"
        return f"best {best.value:.6g}, {len(self.census.peaks)} maxima, {missing}"

    def _ended(self, deadline: float) -> SearchEnd | None:
        """Why the search ends here; None where it goes on."""
        if stopping():
            return SearchEnd.INTERRUPTED
        if time.perf_counter() >= deadline:
            return SearchEnd.TIME_LIMIT
        best = self.census.best
        if best is None:
            return SearchEnd.ROUNDS if self.rounds > EMPTY_ROUNDS else None
        if self.rounds <= LEAST_ROUNDS:
            return None
        if self._unbounded(best):
            return SearchEnd.UNBOUNDED
        enough = self.census.share_missing <= self.share and best.hits >= BEST_HITS
        return SearchEnd.ENOUGH if enough else None

    def _unbounded(self, peak: FoundPeak) -> bool:
        """Whether the index grows without bound where climbs ended that have not converged."""
        if peak.converged:
            return False
        if peak not in self._judged:
            levels = levels_around(partial(Around, self.plan.objective), peak.x, peak.value, FIRST_STEP)
            self._judged[peak] = rises_towards_one_point(levels) or never_levels_off(levels)
        return self._judged[peak]

    def _refinement(self, status: SearchEnd, seconds: float) -> Refinement | None:
        """What was found; None where nothing was."""
        census = self.census
        if not census.peaks:
            return None
        if status is not SearchEnd.INTERRUPTED:
            self._polish()
        peaks = census.ranked()
        unbounded = np.array([self._unbounded(peak) for peak in peaks], bool)
        report = SearchReport(
            status=status,
            rounds=self.rounds,
            climbs=census.climbs,
            met=census.met,
            peaks=len(peaks),
            best_hits=peaks[0].hits,
            share_missing=census.share_missing,
            tries=census.tries,
            seed=self.plan.seed,
            seconds=seconds,
        )
        return Refinement(
            x=np.array([peak.x for peak in peaks]),
            qualities=np.array([peak.value for peak in peaks]),
            starts=np.full(len(peaks), -1, np.int64),
            converged=np.array([peak.converged for peak in peaks], bool),
            stalled=np.array([peak.stalled for peak in peaks], bool) & ~unbounded,
            unbounded=unbounded,
            steps=np.zeros(len(peaks), np.int64),
            kkt=np.array([peak.kkt for peak in peaks]),
            hits=np.array([peak.hits for peak in peaks], np.int64),
            all_motions=True,
            complete=status in (SearchEnd.ENOUGH, SearchEnd.UNBOUNDED),
            search=report,
        )

    def _polish(self) -> None:
        """Climb again from around the highest place where it has not converged, so that its residual tells more."""
        best = self.census.best
        if best is None or best.converged or self._unbounded(best):
            return
        rng = np.random.default_rng(self.plan.seed)
        system = self.plan.objective.system
        steps = rng.normal(size=(POLISH_CLIMBS, system.tangent_size))
        steps *= 0.1 * FIRST_STEP / np.linalg.norm(steps, axis=1, keepdims=True)
        near = np.array([best.x, *(system.integrate(best.x, step) for step in steps)])
        self.census.improve(climbed(self.plan, Starts(-1, RoundKind.STATED, near), deadline_after(None)))


def nothing_meets(plan: Plan, census: Census) -> GraspAtlasError:
    """What to say where no climb met the requirements: which of them the nearest end misses, and by how much."""
    said = "no climb found a grasp at all"
    if census.least_missed is not None:
        missed, x = census.least_missed
        grasp = plan.objective.grasps(x[None])
        rejected = any(not asked(each, grasp)[0] for each in plan.requirements)
        parts = map(str, rejections(plan.requirements, grasp)) if rejected else [f"a bound by {missed:.3g}"]
        said = "the nearest misses " + " and ".join(parts)
    return GraspAtlasError(
        f"no feasible grasp of problem '{plan.problem.name}' that meets the requirements was found in {census.climbs} "
        f"climbs from {census.tries} random starts: {said}; relax it, or search longer"
    )
