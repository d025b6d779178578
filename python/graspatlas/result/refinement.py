"""What climbs from the basins of an atlas reached: the local maxima of the index on the manifold."""

from __future__ import annotations

from dataclasses import dataclass

from graspatlas.support.arrays import Array, BoolArray, IntArray
from graspatlas.support.words import Word

__all__ = ["PeakStatus", "Refinement", "SearchEnd", "SearchReport"]


class PeakStatus(Word):
    """What a place is at which a climb ended."""

    MAXIMUM = "maximum"
    STALLED = "stalled"
    UNBOUNDED = "unbounded"
    GIVEN_UP = "given up"


class SearchEnd(Word):
    """Why a search over all feasible grasps ended."""

    ENOUGH = "little can be missing"
    UNBOUNDED = "the index grows without bound"
    ROUNDS = "limit of rounds"
    TIME_LIMIT = "limit of time"
    INTERRUPTED = "interrupted"


@dataclass(frozen=True)
class SearchReport:
    """What a search over all feasible grasps did, and what it can say of what it did not find.

    Attributes:
        status: Why it ended.
        rounds: Rounds of climbs.
        climbs: Climbs in all.
        met: How many of them ended at grasps that meet the requirements.
        peaks: Different local maxima among these ends.
        best_hits: Climbs that ended at the best.
        share_missing: Expected share of climbs that end at maxima not found yet, of those that meet the requirements:
            w (w + 1) / (n (n - 1)) after n climbs to w maxima. It is a share of climbs such as these, not of the
            manifold: a maximum that few climbs reach may be missing still.
        tries: Random starts that were tried at grasps.
        seed: Of the random numbers.
        seconds: Time that it took.

    Source of the share: C. G. E. Boender, A. H. G. Rinnooy Kan, "Bayesian stopping rules for multistart global
        optimization methods", Mathematical Programming 37 (1987).
    """

    status: SearchEnd
    rounds: int
    climbs: int
    met: int
    peaks: int
    best_hits: int
    share_missing: float
    tries: int
    seed: int
    seconds: float


@dataclass(frozen=True, eq=False)
class Refinement:
    """Local maxima of the index on the manifold, the best first.

    Where the index has no maximum, or the climb was given up on its way, the place where it stopped stands in for one.

    Attributes:
        x: The grasps [p, configuration_size].
        qualities: The index there [p].
        starts: Chart from which the climb to each began [p]; -1 for a grasp that was found elsewhere.
        converged: True where the climb ended at a maximum by itself; for the others see ``statuses`` [p].
        stalled: True where it ended because no smaller step gained anything, though the slope of the index does not
            vanish: on a kink, or where numbers are not exact enough [p].
        unbounded: True where the index has no maximum but grows without bound, as far as numbers can tell [p].
        steps: Steps of the climb to each [p]; 0 where they were not kept, as by a search over all of F.
        kkt: Largest residual of the conditions of Karush, Kuhn and Tucker there, of the logarithm of the index [p]; at
            most 1e-6 where ``converged``.
        hits: Climbs that ended at each [p].
        all_motions: True when no hand motion was frozen but the couplings: the grasps lie in F, not only in R.
        complete: False when interrupted or cut short, so that basins may be missing, or climbs in F.
        search: What a search over all of F did; None where there was none.
    """

    x: Array
    qualities: Array
    starts: IntArray
    converged: BoolArray
    stalled: BoolArray
    unbounded: BoolArray
    steps: IntArray
    kkt: Array
    hits: IntArray
    all_motions: bool
    complete: bool
    search: SearchReport | None = None

    def __repr__(self) -> str:
        best = f", the highest {self.qualities[0]:.6g}" if len(self.qualities) else ""
        return f"<Refinement: {self.n_peaks} local maxima{best}>"

    @property
    def n_peaks(self) -> int:
        """Number of places at which climbs ended."""
        return len(self.x)

    @property
    def statuses(self) -> tuple[PeakStatus, ...]:
        """What each of them is."""
        return tuple(map(_status, self.unbounded.tolist(), self.converged.tolist(), self.stalled.tolist()))

    @property
    def advice(self) -> str:
        """What the status of the highest place means, and what to do next; empty when it is a maximum."""
        if self.statuses[0] is PeakStatus.UNBOUNDED:
            return (
                "the index has no maximum there, and this is no best grasp: state requirements that rule such grasps "
                "out, such as force_closure:0.5:0.02 and collision_free, or take another index"
            )
        if self.statuses[0] is PeakStatus.STALLED:
            return (
                "no smaller step gains anything there, but the slope of the index does not vanish: it has a kink "
                "there, or is not known to more digits"
            )
        if self.statuses[0] is PeakStatus.GIVEN_UP and self.complete and self.search is None:
            return (
                f"the climb was given up after {int(self.steps[0])} steps, still rising, so there are better grasps "
                f"nearby: climb on with more steps, refine_steps (--refine-steps) {10 * max(int(self.steps[0]), 1)}"
            )
        return ""


def _status(unbounded: bool, converged: bool, stalled: bool) -> PeakStatus:
    if unbounded:
        return PeakStatus.UNBOUNDED
    if converged:
        return PeakStatus.MAXIMUM
    return PeakStatus.STALLED if stalled else PeakStatus.GIVEN_UP
