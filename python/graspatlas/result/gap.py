"""What the charts' centres may have missed: how many charts could still hold a better grasp, and by how much.

All of it is estimated, not proved: see :mod:`graspatlas.atlas.upper_bounds`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from graspatlas.atlas.atlas import Atlas
from graspatlas.atlas.upper_bounds import estimate_upper_bounds
from graspatlas.support.arrays import Array, BoolArray, IntArray

__all__ = ["Gap", "estimate_gap"]

#: A bound is above the best when it is by more than this share of it: the rest is rounding.
ROUNDING = 1e-9


@dataclass(frozen=True, eq=False)
class Gap:
    """Which charts could still hold a better grasp than the best, estimated.

    A chart whose centre is rejected counts when a neighbour is accepted, since the border of the grasps that meet the
    requirements may pass through it; its bound is that of the index alone. Of charts amid rejected ones nothing is
    expected.

    Attributes:
        best: The quality to beat: that of the refined best, or of the best chart where none was refined.
        bounds: Estimated upper bound of the index on each chart [n]; infinite where there are too few neighbours to
            tell, and -inf where no grasp that meets the requirements is expected.
        accepted: Which charts' centres meet the requirements [n].
    """

    best: float
    bounds: Array
    accepted: BoolArray

    def __repr__(self) -> str:
        return f"<Gap, estimated: {self.n_charts} of {len(self.bounds)} charts, {self.share:.3g} of the best>"

    @cached_property
    def charts(self) -> IntArray:
        """Charts that could hold a better grasp, the highest bound first; without those that are unknown."""
        above = self.best + ROUNDING * abs(self.best)
        charts = np.flatnonzero((self.bounds > above) & np.isfinite(self.bounds))
        return np.asarray(charts[np.argsort(-self.bounds[charts], kind="stable")], np.int64)

    @property
    def n_charts(self) -> int:
        """How many charts could hold a better grasp."""
        return len(self.charts)

    @property
    def n_rejected(self) -> int:
        """How many of them have a centre that does not meet the requirements."""
        return int((~self.accepted[self.charts]).sum())

    @cached_property
    def unknown(self) -> IntArray:
        """Charts with too few neighbours to tell, ascending."""
        return np.flatnonzero(self.bounds == np.inf)

    @property
    def bound(self) -> float:
        """The highest of the bounds, and at least the best; without the charts that are unknown."""
        return float(self.bounds[self.charts[0]]) if self.n_charts else self.best

    @property
    def share(self) -> float:
        """By how much the bound is above the best, as a share of the best; infinite when the best is 0."""
        if self.n_charts == 0:
            return 0.0
        return (self.bound - self.best) / abs(self.best) if self.best else np.inf


def estimate_gap(atlas: Atlas, qualities: Array, accepted: BoolArray, best: float) -> Gap:
    """Estimate which charts could hold a better grasp; see :class:`Gap` for the arguments."""
    i, j = atlas.neighbour_pairs.T
    expected = accepted.copy()
    expected[i[accepted[j]]] = True
    expected[j[accepted[i]]] = True
    return Gap(best, np.where(expected, estimate_upper_bounds(atlas, qualities), -np.inf), accepted)
