"""What has been found since the page was made: grasps, indices and trials, packed as the page packs its own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np

from graspatlas.analysis.climb import Climb
from graspatlas.grasps.grasps import Grasps
from graspatlas.quality.batched import quality_name
from graspatlas.quality.evaluation import INDICES, evaluate
from graspatlas.requirements.base import Requirement, asked, requirement_name
from graspatlas.requirements.lost import kept
from graspatlas.result.grasp_atlas import GraspAtlas
from graspatlas.support.arrays import AnyArray, Array, BoolArray
from graspatlas.support.validation import PlainTable
from graspatlas.viewer.explorer.charts import Charts
from graspatlas.viewer.explorer.numbers import Numbers

__all__ = ["Added", "index_packed", "packed", "values_of"]


@dataclass(frozen=True, eq=False)
class Added:
    """Grasps that have been added.

    Attributes:
        grasps: The grasps, with their charts (n).
        accepted: Which meet the requirements (n,).
        qualities: The result's index (n,).
        titles: What the page calls each (n).
        statuses: How each climb ended (n); empty for samples.
        all_motions: Whether they lie in F, not only in R.
        flat: Where they lie in the unrolled atlas (n, 2); None where it is not unrolled.
        climb: The climb that found it; None for samples.
    """

    grasps: Grasps
    accepted: BoolArray
    qualities: Array
    titles: Sequence[str]
    statuses: Sequence[str]
    all_motions: bool = False
    flat: Array | None = None
    climb: Climb | None = None

    def __len__(self) -> int:
        return len(self.grasps)

    def entries(self) -> list[PlainTable]:
        """What is said of each, as the page's ``facts.maxima`` has it."""
        flat = None if self.flat is None else self.flat.round(5).tolist()
        return [
            {
                "chart": int(self.grasps.charts[i]),
                "title": self.titles[i],
                "status": self.statuses[i],
                "all_motions": self.all_motions,
                "sample": self.climb is None,
                "flat": None if flat is None else flat[i],
            }
            for i in range(len(self))
        ]


class _Columns(Charts):
    """The columns of grasps that have been added; their requirements stand at the same bits as those of the charts."""

    def __init__(self, result: GraspAtlas, added: Added, n_bits: int) -> None:
        super().__init__(result, [added.grasps])
        self._added, self._n_bits = added, n_bits

    @cached_property
    def rejections(self) -> tuple[list[str], AnyArray]:
        named = [r for r in kept(self.result.requirements) if isinstance(r, Requirement)]
        bits = np.zeros(len(self._added), np.uint32)
        for bit, requirement in enumerate(named):
            bits |= (self._of_all(partial(asked, requirement)) == 0.0).astype(np.uint32) << bit
        by_functions = (bits == 0) & ~self._added.accepted
        if self._n_bits > len(named):
            bits[by_functions] |= np.uint32(1 << len(named))
        return [requirement_name(r) for r in named], bits


def values_of(name: str, result: GraspAtlas, added: Added) -> Array:
    """Values of an index of the page (n,); NaN where it is a function that a file did not keep."""
    if name == quality_name(result.quality):
        return added.qualities
    return evaluate(name, added.grasps) if name in INDICES else np.full(len(added), np.nan)


def packed(result: GraspAtlas, added: Added, indices: Sequence[str], n_bits: int, coordinates: Array) -> PlainTable:
    """Grasps as they are sent to the page.

    Args:
        result: The result.
        added: The grasps.
        indices: Names of the page's indices.
        n_bits: Number of the page's requirements.
        coordinates: Where the page draws them (n, 3).
    """
    numbers, columns = Numbers(), _Columns(result, added, n_bits)
    columns.write_postures(numbers)
    numbers.add_rounded("coordinates", coordinates)
    numbers.add("rejections", columns.rejections[1])
    for i, name in enumerate(indices):
        numbers.add(f"index_{i}", values_of(name, result, added))
    return {"kind": "grasps", "grasps": added.entries(), **numbers.table()}


def index_packed(table: PlainTable, values: Array) -> PlainTable:
    """Values of another index at all grasps of the page, as they are sent."""
    numbers = Numbers()
    numbers.add("values", np.asarray(values, float))
    return {"kind": "index", "index": table, **numbers.table()}
