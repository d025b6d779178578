"""Local maxima of a quality index: those over the charts, and the places at which climbs ended."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from graspatlas.analysis.climb import Climb
from graspatlas.numerics.groups import linked_groups
from graspatlas.result.grasp_atlas import GraspAtlas, check_is_result
from graspatlas.support.arrays import Array, IntArray

__all__ = ["Peak", "local_maxima", "peaks_of"]

#: Two climbs end on one peak when their ends are no farther apart than this share of the chart radius.
SAME_PEAK = 0.5


def local_maxima(result: GraspAtlas) -> IntArray:
    """Charts that no neighbour beats, the best first; charts that do not meet the result's requirements do not count.

    Charts of equal quality that are connected count once, by the first of them, and only if none of them has a better
    neighbour.

    Args:
        result: The result.

    Returns:
        Charts [p], by decreasing quality.
    """
    check_is_result(result)
    atlas, q = result.atlas, np.where(result.accepted, result.qualities, -np.inf)
    i, j = atlas.neighbour_pairs.T
    equal = q[i] == q[j]
    group = linked_groups(atlas.n_charts, atlas.neighbour_pairs[equal])
    beaten = np.zeros(group.max(initial=-1) + 1, bool)
    beaten[group[i[q[i] < q[j]]]] = True
    beaten[group[j[q[j] < q[i]]]] = True
    first = np.unique(group, return_index=True)[1]
    charts = first[~beaten & result.accepted[first]]
    return np.asarray(charts[np.argsort(-q[charts], kind="stable")], np.int64)


@dataclass(frozen=True, eq=False)
class Peak:
    """A place at which climbs ended.

    Attributes:
        quality: The largest index with which one ended there.
        climbs: Numbers of the climbs, in the order given [n].
        x: End of the best of them [configuration_size].
        converged: True when every climb stopped there by itself, at a maximum.
        unbounded: True when the best of them ran after an index that grows without bound there.
    """

    quality: float
    climbs: IntArray
    x: Array
    converged: bool
    unbounded: bool = False

    def __repr__(self) -> str:
        return f"<Peak of quality {self.quality:.6g}, where {len(self.climbs)} climbs ended>"


def peaks_of(result: GraspAtlas, climbs: Sequence[Climb]) -> list[Peak]:
    """Group climbs by where they ended, the best peak first.

    Ends that are linked by distances of at most half a chart radius belong to one peak.

    Args:
        result: The result on which they climbed.
        climbs: The climbs.
    """
    if not climbs:
        return []
    difference = result.atlas.system.difference
    n = len(climbs)
    near = np.zeros((n, n), bool)
    for i in range(n):
        for j in range(i + 1, n):
            near[i, j] = np.linalg.norm(difference(climbs[i].x, climbs[j].x)) <= SAME_PEAK * result.atlas.radius
    group = linked_groups(n, np.argwhere(near))
    peaks = []
    for number in range(group.max() + 1):
        members = np.flatnonzero(group == number)
        top = max((climbs[int(m)] for m in members), key=lambda c: c.quality)
        peaks.append(Peak(top.quality, members, top.x, all(climbs[int(m)].converged for m in members), top.unbounded))
    return sorted(peaks, key=lambda peak: -peak.quality)
