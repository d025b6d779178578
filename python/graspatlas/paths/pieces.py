"""What to say where no path leads from start to end: the pieces in which they lie, and where these come nearest."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from graspatlas.atlas.atlas import Atlas
from graspatlas.errors import GraspAtlasError
from graspatlas.result.grasp_atlas import GraspAtlas
from graspatlas.support.arrays import BoolArray, IntArray

__all__ = ["Gap", "NotConnected", "Piece", "apart", "narrowest_gap"]

#: Pairs of charts whose Euclidean images are nearest, of which the distance is measured.
MEASURED = 100


@dataclass(frozen=True, eq=False)
class Piece:
    """Charts that are connected with one end of a path.

    Attributes:
        end: Which end it is, and where, such as ``start (chart 12)``.
        charts: The charts of the piece, ascending; none for a point that no centre of a chart is connected with.
    """

    end: str
    charts: IntArray


class NotConnected(Exception):
    """No path leads from one end to the other.

    Args:
        pieces: The pieces of start and end.
        count: How many pieces there are.
        parted: How many pairs of neighbours were parted, since no chain of points leads from one to the other.
    """

    def __init__(self, pieces: tuple[Piece, Piece], count: int, parted: int) -> None:
        super().__init__(pieces, count, parted)
        self.pieces, self.count, self.parted = pieces, count, parted


@dataclass(frozen=True, eq=False)
class Gap:
    """Where two pieces come nearest.

    Attributes:
        charts: A chart of each piece.
        distance: How far their centres are apart [units of the tangent space].
        between: Charts of neither piece on the shortest way from one to the other through all charts; None where
            no way through neighbouring charts leads there.
    """

    charts: tuple[int, int]
    distance: float
    between: tuple[int, ...] | None


def apart(error: NotConnected, atlas: Atlas, result: GraspAtlas | None, open_charts: BoolArray) -> GraspAtlasError:
    """The error that says where two ends lie, and what to do.

    Args:
        error: What is known.
        atlas: The atlas.
        result: The result whose requirements are asked for; None where none are.
        open_charts: Charts that may be passed (n,).
    """
    start, end = error.pieces
    kind = "charts that meet the requirements" if result else "charts"
    parted = f" ({error.parted} pairs of neighbours parted by grasps between them)" if error.parted else ""
    words = [
        f"{start.end} and {end.end} are not connected: the {open_charts.sum()} {kind} form {error.count} pieces{parted}"
        f", start lies in one of {len(start.charts)} charts, end in one of {len(end.charts)}"
    ]
    choice = "choose an end in start's piece"
    if len(start.charts) and len(end.charts):
        gap = narrowest_gap(atlas, start.charts, end.charts)
        words.append(_where(gap, result))
        choice += f", such as chart {gap.charts[0]}"
    choice += ", relax a requirement, or leave out accepted=True (--accepted)" if result else ""
    return GraspAtlasError("; ".join([*words, choice]))


def _where(gap: Gap, result: GraspAtlas | None) -> str:
    """Where two pieces come nearest, and what is in the way."""
    first, second = gap.charts
    said = f"nearest are chart {first} in start's piece and chart {second} in end's, {gap.distance:.3g} apart"
    if gap.between is None:
        return said + ", which no neighbouring charts join"
    if not gap.between:
        return said + ", neighbours between which no path was found"
    those = f"{len(gap.between)} rejected charts" if len(gap.between) > 1 else "one rejected chart"
    reasons = result.rejections(gap.between[0]) if result else ()
    why = f", such as {gap.between[0]} by {' and by '.join(map(str, reasons))}" if reasons else ""
    return f"{said}, with {those} between{why}"


def narrowest_gap(atlas: Atlas, first: IntArray, second: IntArray) -> Gap:
    """Where two pieces of an atlas come nearest: along the shortest way through all its charts.

    Args:
        atlas: The atlas.
        first: Charts of one piece, at least one.
        second: Charts of the other.
    """
    from scipy.sparse import coo_array  # slow to import
    from scipy.sparse.csgraph import dijkstra

    pairs = atlas.neighbour_pairs.astype(np.int64)
    graph = coo_array(
        (atlas.neighbour_distances, (pairs[:, 0], pairs[:, 1])), shape=(atlas.n_charts, atlas.n_charts)
    ).tocsr()
    distances, before, _ = dijkstra(graph, directed=False, indices=first, return_predecessors=True, min_only=True)
    nearest = int(second[np.argmin(distances[second])])
    if not np.isfinite(distances[nearest]):
        return _gap_in_space(atlas, first, second)
    way = [nearest]
    while before[way[-1]] >= 0:
        way.append(int(before[way[-1]]))
    return Gap((way[-1], nearest), _distance(atlas, way[-1], nearest), tuple(way[-2:0:-1]))


def _gap_in_space(atlas: Atlas, first: IntArray, second: IntArray) -> Gap:
    """The nearest charts of two pieces, of those whose Euclidean images are nearest."""
    from scipy.spatial import cKDTree  # slow to import

    images = [np.array([atlas.system.embed(x) for x in atlas.centers[piece]]) for piece in (first, second)]
    apart, nearest = cKDTree(images[1]).query(images[0])
    order = np.argsort(apart, kind="stable")[:MEASURED]
    pairs = [(int(first[i]), int(second[nearest[i]])) for i in order]
    distance, pair = min((_distance(atlas, *pair), pair) for pair in pairs)
    return Gap(pair, distance, None)


def _distance(atlas: Atlas, i: int, j: int) -> float:
    return float(np.linalg.norm(atlas.system.difference(atlas.centers[i], atlas.centers[j])))
