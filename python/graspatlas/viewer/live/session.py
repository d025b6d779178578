"""One result that is looked at and worked on: what has been added to it, and what the page has been told."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from graspatlas.errors import GraspAtlasError
from graspatlas.result.result import Result
from graspatlas.simulation.outcome import Simulation
from graspatlas.support.arrays import Array
from graspatlas.support.validation import PlainTable
from graspatlas.viewer.explorer.charts import MOST_MAXIMA, Charts
from graspatlas.viewer.explorer.layout import Layout
from graspatlas.viewer.explorer.words import index_tables
from graspatlas.viewer.live.additions import Added, index_packed, packed, values_of
from graspatlas.viewer.live.jobs import Jobs

__all__ = ["Session"]

#: Grasps that a page can have besides the charts; more make it slow.
MOST_ADDED = 50_000


class Session:
    """A result with what has been found since it was opened.

    Grasps have numbers, as in the page: those of the charts, then those of the refined maxima that the page shows, then
    those that have been added. All but the jobs' own thread only read.

    Args:
        result: The result.
        file: The file that it was read from, beside which findings are saved; None where there is none.
    """

    def __init__(self, result: Result, file: Path | None = None) -> None:
        self.result, self.file = result, file
        self.charts, self.layout = Charts(result), Layout(result.atlas)
        self.jobs = Jobs()
        self.added: list[Added] = []
        self.others: dict[str, Array] = {}
        self.trials: list[tuple[int, Simulation]] = []
        #: Charts that have been filled, and how finely [units of the tangent space].
        self.spacings: dict[int, float] = {}
        #: What the page has to be told, in this order.
        self.told: list[PlainTable] = []
        #: What has been saved of it.
        self.saved = 0

    @property
    def n_first(self) -> int:
        """Number of grasps of the page when it is opened."""
        return self.result.atlas.n_charts + self.charts.n_maxima

    @property
    def count(self) -> int:
        """Number of all grasps."""
        return self.n_first + sum(map(len, self.added))

    @property
    def indices(self) -> list[str]:
        """Names of the page's indices."""
        return [*self.charts.indices, *self.others]

    def checked_grasp(self, number: object) -> int:
        """The number of a grasp that exists.

        Raises:
            GraspAtlasError: If there is none.
        """
        if not isinstance(number, int) or isinstance(number, bool) or not 0 <= number < self.count:
            raise GraspAtlasError(f"grasp {number!r} does not exist; there are grasps 0 to {self.count - 1}")
        return number

    def grasp(self, number: int) -> tuple[Array, int, bool]:
        """A grasp [configuration_size], its chart, -1 for none, and whether it may lie outside R."""
        atlas, refinement = self.result.atlas, self.result.refinement
        if number < atlas.n_charts:
            return atlas.centers[number], number, False
        at = number - atlas.n_charts
        if refinement and at < min(MOST_MAXIMA, len(refinement.x)):
            return refinement.x[at], int(refinement.starts[at]), refinement.all_motions
        at = number - self.n_first
        for added in self.added:
            if at < len(added):
                return added.grasps.x[at], int(added.grasps.charts[at]), added.all_motions
            at -= len(added)
        raise GraspAtlasError(f"grasp {number} does not exist")

    def add(self, added: Added) -> range:
        """Add grasps, and tell the page; their numbers.

        Raises:
            GraspAtlasError: If there would be too many.
        """
        if self.count - self.n_first + len(added) > MOST_ADDED:
            raise GraspAtlasError(
                f"the page has {self.count - self.n_first} grasps besides the charts, and more than {MOST_ADDED} make "
                "it slow: save them and open it again"
            )
        n_bits = len(self.charts.rejections[0])
        places = self.layout.coordinates.of(added.grasps.x)
        table = packed(self.result, added, self.indices, n_bits, places)
        numbers = range(self.count, self.count + len(added))
        self.added.append(added)
        self.told.append(table)
        return numbers

    def add_index(self, name: str, at_first: Array) -> None:
        """Add an index, whose values at the grasps that the page opens with are known, and tell the page."""
        values = [at_first, *(values_of(name, self.result, added) for added in self.added)]
        (table,) = index_tables(self.result, [name])
        self.others[name] = at_first
        self.told.append(index_packed(table, np.concatenate(values)))

    def add_trial(self, number: int, trial: Simulation, lines: list[str]) -> None:
        """Add the trial of a grasp, and tell the page."""
        self.trials.append((number, trial))
        self.told.append({"kind": "trial", "grasp": number, "lines": lines})

    def state(self, since: int) -> PlainTable:
        """What the page does not know yet, and how far the work is."""
        job = self.jobs.last
        table: PlainTable = {"job": job.table() if job else None}  # before the news, so that none is missed at its end
        return {**table, "news": self.told[since:], "unsaved": len(self.told) - self.saved}
