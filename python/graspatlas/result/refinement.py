"""What climbs from the basins of an atlas reached: the local maxima of the index on the manifold."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from graspatlas.support.arrays import Array, BoolArray, IntArray

__all__ = ["PeakStatus", "Refinement"]


class PeakStatus(str, Enum):
    """What a place is at which a climb ended."""

    MAXIMUM = "maximum"
    UNBOUNDED = "unbounded"
    GIVEN_UP = "given up"

    def __str__(self) -> str:
        return self.value


@dataclass(frozen=True, eq=False)
class Refinement:
    """Local maxima of the index on the manifold, the best first.

    Where the index has no maximum, or the climb was given up on its way, the place where it stopped stands in for one.

    Attributes:
        x: The grasps [p, configuration_size].
        qualities: The index there [p].
        starts: Chart from which the climb to each began [p].
        converged: True where the climb ended at a maximum by itself; for the others see ``statuses`` [p].
        unbounded: True where the index has no maximum but grows without bound, as far as numbers can tell [p].
        steps: Steps of the climb to each [p].
        kkt: Largest residual of the conditions of Karush, Kuhn and Tucker there, of the logarithm of the index [p]; at
            most 1e-6 where ``converged``.
        all_motions: True when no hand motion was frozen but the couplings: the grasps lie in F, not only in R.
        complete: False when interrupted or cut short, so that basins may be missing, or climbs in F.
    """

    x: Array
    qualities: Array
    starts: IntArray
    converged: BoolArray
    unbounded: BoolArray
    steps: IntArray
    kkt: Array
    all_motions: bool
    complete: bool

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
        return tuple(
            PeakStatus.UNBOUNDED if runs_away else PeakStatus.MAXIMUM if ended else PeakStatus.GIVEN_UP
            for runs_away, ended in zip(self.unbounded, self.converged, strict=True)
        )

    @property
    def advice(self) -> str:
        """What the status of the highest place means, and what to do next; empty when it is a maximum."""
        if self.statuses[0] is PeakStatus.UNBOUNDED:
            return (
                "the index has no maximum there, and this is no best grasp: state requirements that rule such grasps "
                "out, such as force_closure:0.5:0.02 and collision_free, or take another index"
            )
        if self.statuses[0] is PeakStatus.GIVEN_UP and self.complete:
            return (
                f"the climb was given up after {int(self.steps[0])} steps, still rising, so there are better grasps "
                f"nearby: climb on with more steps, refine_steps (--refine-steps) {10 * max(int(self.steps[0]), 1)}"
            )
        return ""
