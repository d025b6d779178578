"""A denser grid than the charts' centres, for indices that change abruptly (end of Section IV of the paper).

Each chart's polytope is filled with the points of a cubic lattice of its tangent space, and these are projected to the
manifold, first in the charts that could hold a better grasp than the best::

    samples = ga.densify(result, 0.02)                  # everywhere
    samples = ga.densify(result, 0.02, share=0.1)       # in a tenth of the charts: those of result.gap, and large jumps
    samples.best.quality, result.best.quality

How close the samples lie stands in :mod:`graspatlas.atlas.grid`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from graspatlas.atlas.grid import Grid, grid_blocks, joined_grid
from graspatlas.errors import GraspAtlasError
from graspatlas.grasps.grasp import Grasp
from graspatlas.grasps.grasps import Grasps
from graspatlas.problem.problem import Problem
from graspatlas.quality.evaluation import evaluate
from graspatlas.requirements.screening import screen
from graspatlas.result.grasp_atlas import GraspAtlas, check_is_result
from graspatlas.support.arrays import Array, BoolArray, IntArray
from graspatlas.support.interrupts import stoppable
from graspatlas.support.renamed import renamed_attribute
from graspatlas.support.validation import positive

__all__ = ["Samples", "by_promise", "densify", "jumps"]


@dataclass(frozen=True, eq=False)
class Samples(Grid):
    """Grasps on a grid that is denser than the charts' centres, with their qualities; see ``Grid``.

    Attributes:
        problem: The problem.
        qualities: The result's index at each sample [m].
        accepted: Which samples meet the result's requirements [m].
        rejected: How many samples each requirement rejected, of those that the ones before it had left.
    """

    problem: Problem
    qualities: Array
    accepted: BoolArray
    rejected: dict[str, int]
    __repr__ = Grid.__repr__

    feasible = renamed_attribute("feasible", "accepted")
    refused = renamed_attribute("refused", "rejected")

    @cached_property
    def best(self) -> Grasp:
        """Grasp with the largest quality of those that meet the requirements; the first of equals.

        Raises:
            GraspAtlasError: If no sample meets them.
        """
        candidates = np.flatnonzero(self.accepted)
        if len(candidates) == 0:
            counts = ", ".join(f"{name} rejected {count}" for name, count in self.rejected.items()) or "none was made"
            raise GraspAtlasError(f"none of {len(self)} samples meets the requirements ({counts}): relax a requirement")
        at = int(candidates[np.argmax(self.qualities[candidates])])
        one = Grasps(self.problem, self.x[at])[0]
        return replace(one, quality=float(self.qualities[at]), chart=int(self.charts[at]))

    def to_arrays(self) -> dict[str, Any]:
        """All arrays by name, for storing: ``np.savez_compressed("samples.npz", **samples.to_arrays())``."""
        return {name: getattr(self, name) for name in ("x", "charts", "u", "qualities", "accepted")}


@stoppable()
def densify(
    result: GraspAtlas,
    spacing: float,
    *,
    share: float = 1.0,
    charts: Sequence[int] | None = None,
    progress: bool | None = None,
) -> Samples:
    """Read the index on a denser grid: inside the polytopes, at a spacing of your choice.

    Everywhere, or where it promises most: see ``by_promise``. The charts are filled in that order, and Ctrl-C keeps
    what there is; the samples come by chart.

    Args:
        result: The result; its index and its requirements are those of the samples.
        spacing: Distance between lattice points in a tangent space [rad, and lengths in units of
            ``problem.length_scale``]; at a fourth of the radius there are some thirty samples a chart when k = 2.
        share: Share of the charts to fill, those that promise most; above 0, and 1 for all.
        charts: Fill only these charts, in this order, in place of a share of all.
        progress: Show a progress bar on standard error; by default when it is a terminal.

    Returns:
        The samples. Their best is at least as good as the best chart when all charts are filled.

    Raises:
        GraspAtlasError: If an argument makes no sense, there is no such chart, the grid would be too large, the index
            fails, or a requirement is a function that a file did not keep.

    Source: "Global Optimization of Robotic Grasps", end of Section IV.
    """
    check_is_result(result)
    positive(share, "share", most=1.0)
    if charts is None:
        chosen = by_promise(result)[: int(np.ceil(share * result.atlas.n_charts))]
    elif share != 1.0:
        raise GraspAtlasError("give only one of share and charts")
    else:
        chosen = np.array([result.checked_chart(chart) for chart in charts], np.int64)
    done: list[tuple[Grid, Array, BoolArray, dict[str, int]]] = []
    blocks = grid_blocks(result.atlas, spacing, chosen, progress)
    complete = True
    try:
        for block in blocks:
            grasps = Grasps(result.problem, block.x, result.system)
            accepted, rejected = screen(result.requirements, grasps)
            done.append((block, evaluate(result.quality, grasps) if len(block) else np.zeros(0), accepted, rejected))
    except KeyboardInterrupt:
        complete = False
    finally:
        blocks.close()
    grid = joined_grid(result.atlas, [block for block, *_ in done], complete)
    order = np.argsort(grid.charts, kind="stable")
    return Samples(
        **{**vars(grid), **{name: getattr(grid, name)[order] for name in ("x", "charts", "u")}},
        problem=result.problem,
        qualities=np.concatenate([np.zeros(0), *(qualities for _, qualities, _, _ in done)])[order],
        accepted=np.concatenate([np.zeros(0, bool), *(accepted for _, _, accepted, _ in done)])[order],
        rejected={name: sum(rejected[name] for *_, rejected in done) for name in (done[0][-1] if done else ())},
    )


def by_promise(result: GraspAtlas) -> IntArray:
    """All charts, those first where samples between the centres promise most [n].

    First come the charts of ``result.gap`` that could hold a grasp better than the best, the highest bound first; then
    those with too few neighbours to tell; then the others by how much the index jumps, see :func:`jumps`.

    Args:
        result: The result.
    """
    others = np.argsort(-jumps(result), kind="stable")
    if not result.accepted.any():
        return others
    first = np.concatenate([result.gap.charts, result.gap.unknown])
    return np.concatenate([first, others[~np.isin(others, first)]])


def jumps(result: GraspAtlas) -> Array:
    """How much the index changes from each chart to a neighbour, at most [n].

    It is the largest difference between the values of the chart and of a neighbour, not divided by their distance: what
    the centres may miss between them. A grasp that does not meet the requirements has the value of the worst that
    does, so that the border of those that do is a jump, the higher the better the grasps at it are; and charts amid
    rejected ones jump by nothing.

    Args:
        result: The result.
    """
    n = result.atlas.n_charts
    if not result.accepted.any():
        return np.zeros(n)
    values = np.where(result.accepted, result.qualities, result.qualities[result.accepted].min())
    i, j = result.atlas.neighbour_pairs.T
    with np.errstate(invalid="ignore"):  # of two infinite values
        differences = np.nan_to_num(np.abs(values[i] - values[j]), nan=0.0, posinf=np.inf)
    largest = np.zeros(n)
    np.maximum.at(largest, i, differences)
    np.maximum.at(largest, j, differences)
    return largest
