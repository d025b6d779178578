"""How an atlas ended: its status, why vertices were closed, and what its audit found."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from graspatlas import _core
from graspatlas.errors import GraspAtlasError
from graspatlas.support.words import Word

__all__ = ["Audit", "Closed", "Status"]


class Status(Word):
    """How the construction of an atlas ended; all but the first are cut short."""

    COMPLETE = "complete"
    CHART_LIMIT = "cut short: limit of charts"
    TIME_LIMIT = "cut short: limit of time"
    MEMORY_LIMIT = "cut short: limit of memory"
    INTERRUPTED = "cut short: interrupted"
    BLOCKED = "cut short: steps from some charts failed"


class Closed(int, Enum):
    """Why a vertex of a polytope was not expanded; covered: an audit went on there by small steps, to other charts."""

    OPEN = int(_core.Closed.OPEN)
    BOUNDS = int(_core.Closed.BOUNDS)
    CURVATURE = int(_core.Closed.CURVATURE)
    NOT_CONVERGED = int(_core.Closed.NOT_CONVERGED)
    COVERED = int(_core.Closed.COVERED)


@dataclass(frozen=True)
class Audit:
    """What became of the search for points of the manifold that a complete atlas does not cover.

    The points are those of random walks over the manifold and along its bounds, which begin at charts and then know
    nothing of them; beside them, every place was looked at where a vertex was closed, and behind every bound that cuts
    a chart.

    Attributes:
        points: Points of the last round, all of which a chart covers; 0 where there was none, as for an atlas that was
            cut short.
        holes: Charts that were begun at points that none covered, in the rounds before.
        seconds: Time that it took.
    """

    points: int
    holes: int
    seconds: float

    def share_missing(self, confidence: float = 0.95) -> float:
        """Largest share of the points that random walks come to that no chart covers, at this confidence.

        If more were missing, all points of the last round would have been covered with a chance below 1 - confidence. A
        part that no walk can come to, behind a passage much narrower than a chart, does not count.

        Args:
            confidence: Between 0 and 1.
        """
        if not 0.0 < confidence < 1.0:
            raise GraspAtlasError(f"confidence must lie between 0 and 1, got {confidence!r}")
        return float(1.0 - (1.0 - confidence) ** (1.0 / self.points)) if self.points else 1.0
