"""The search for the shortest path between two grasps that keeps all contacts.

Charts that neighbour each other make a graph; its shortest path is bridged on the manifold and pulled tight there
(:mod:`graspatlas.systems.geodesic`), since a path from centre to centre zigzags.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from numbers import Integral
from typing import TYPE_CHECKING, overload

import numpy as np
from numpy.typing import ArrayLike

from graspatlas.atlas.atlas import Atlas
from graspatlas.errors import GraspAtlasError
from graspatlas.grasps.grasp import Grasp
from graspatlas.paths.path import GraspPath, Path
from graspatlas.paths.pieces import NotConnected, Piece, apart
from graspatlas.result.grasp_atlas import GraspAtlas
from graspatlas.support.arrays import Array, BoolArray, IntArray
from graspatlas.support.interrupts import stoppable
from graspatlas.support.renamed import renamed_keyword
from graspatlas.support.validation import number_array, positive
from graspatlas.systems.chain import Allowed
from graspatlas.systems.geodesic import arc_lengths, bridge, evenly, shorten
from graspatlas.systems.tangent_maps import BOUND_TOLERANCE

if TYPE_CHECKING:
    from scipy import sparse

__all__ = ["shortest_path"]

#: A chart's number, a grasp, or a point of the manifold.
End = int | Grasp | ArrayLike

#: Longest step of a path, as a share of the chart radius.
STEP = 0.1
#: Steps are this much shorter while a path is pulled tight, for they may grow then.
SPARE = 1.5
#: Largest entry of |R(x)| of a point of a path.
RESIDUAL_TOLERANCE = 1e-9
#: A grasp belongs to a chart when it is no farther from its polytope than this share of the radius.
NEAR = 0.5
#: Points no farther apart than this are the same [units of the tangent space].
SAME = 1e-9


@overload
def shortest_path(
    on: GraspAtlas,
    start: End = 0,
    end: End | None = None,
    *,
    accepted: bool = False,
    step: float | None = None,
    progress: bool | None = None,
) -> GraspPath: ...


@overload
def shortest_path(
    on: Atlas,
    start: End = 0,
    end: End | None = None,
    *,
    accepted: bool = False,
    step: float | None = None,
    progress: bool | None = None,
) -> Path: ...


@renamed_keyword("feasible", "accepted")
@stoppable()
def shortest_path(
    on: GraspAtlas | Atlas,
    start: End = 0,
    end: End | None = None,
    *,
    accepted: bool = False,
    step: float | None = None,
    progress: bool | None = None,
) -> Path:
    """The shortest path between two points of an atlas, all of it on the manifold and inside its bounds.

    Dijkstra's algorithm finds the way through the charts; the path is then pulled tight on the manifold. It is a
    geodesic, or hugs bounds and what is not accepted: the shortest of all that can be reached from the way through the
    charts without lifting over a hole. Ctrl-C keeps the path as it is then.

    Args:
        on: A result; or an atlas, of any system.
        start: A chart's number, a grasp, or a point of the manifold [configuration_size]; the first grasp by default.
        end: Likewise; the best grasp by default.
        accepted: Whether every point must meet the result's requirements. They are asked at the points of the path, not
            between them.
        step: Longest distance between neighbouring points [units of the tangent space]; a tenth of the chart radius by
            default.
        progress: Show a progress bar on standard error; by default when it is a terminal.

    Returns:
        The path; a :class:`GraspPath` for a result. It has one point where start and end are the same.

    Raises:
        GraspAtlasError: If start or end is no chart, not on the manifold, not in the atlas or not feasible, or no path
            leads from one to the other.
    """
    result = on if isinstance(on, GraspAtlas) else None
    if not isinstance(on, GraspAtlas | Atlas):
        raise GraspAtlasError(f"a path needs a graspatlas.Result or an Atlas, got {type(on).__name__}")
    atlas = on.atlas if isinstance(on, GraspAtlas) else on
    longest = _step(atlas, step)
    if result is None and accepted:
        raise GraspAtlasError("an atlas has no requirements; give the result, or leave out accepted=True")
    if result is None and end is None:
        raise GraspAtlasError("an atlas has no best grasp; give end")
    ends = [_End.of(atlas, result, "start", start)]
    ends.append(_End.of(atlas, result, "end", result.best.chart if result and end is None else end))
    open_charts, allowed = np.ones(atlas.n_charts, bool), None
    if result and accepted and result.requirements:
        open_charts, allowed = result.accepted, result.meets
        for e in ends:
            e.must_meet(result)
    if float(np.linalg.norm(atlas.system.difference(ends[0].x, ends[1].x))) <= SAME:
        X, tight = ends[0].x[None], True
    else:
        graph = _ChartGraph(atlas, open_charts, ends, longest / SPARE, allowed)
        try:
            X = graph.shortest_chain()
        except NotConnected as error:
            raise apart(error, atlas, result if allowed is not None else None, open_charts) from None
        X, tight = _shortened(atlas, X, longest, allowed, progress)
    residuals = np.array([np.abs(atlas.system.evaluate_residual(x)).max(initial=0.0) for x in X])
    arguments = (atlas, X, arc_lengths(atlas.system, X), residuals, tight)
    return GraspPath(*arguments, result) if result else Path(*arguments)


def _step(atlas: Atlas, step: float | None) -> float:
    if step is None:
        return STEP * atlas.radius
    given = positive(step, "step")
    if given > atlas.radius:
        raise GraspAtlasError(f"step must be at most the chart radius, {atlas.radius:g}, got {given:g}")
    return given


def _shortened(
    atlas: Atlas, X: Array, step: float, allowed: Allowed | None, progress: bool | None
) -> tuple[Array, bool]:
    """The chain X shortened, with even steps if all its points are then allowed, and whether no step shortens it."""

    def even(chain: Array, length: float) -> Array:
        spread = evenly(atlas.system, chain, length)
        return spread if spread is not None and (allowed is None or allowed(spread).all()) else chain

    X = even(X, step / SPARE)
    X, tight = shorten(atlas.system, X, trust_radius=atlas.radius, longest=step, allowed=allowed, progress=progress)
    return even(X, step), tight


@dataclass(frozen=True, eq=False)
class _End:
    """Where a path begins or ends: a point of the manifold, a chart near it, and whether that is its centre."""

    name: str
    x: Array
    chart: int
    at_centre: bool

    @classmethod
    def of(cls, atlas: Atlas, result: GraspAtlas | None, name: str, value: object) -> _End:
        """The end that the caller named."""
        if isinstance(value, Integral) and not isinstance(value, bool):
            chart = int(value)
            if not 0 <= chart < atlas.n_charts:
                raise GraspAtlasError(f"{name} {chart} is not a chart; the atlas has charts 0 to {atlas.n_charts - 1}")
            return cls(name, atlas.centers[chart], chart, True)
        x = number_array(value.x if isinstance(value, Grasp) else value, name)
        size = atlas.system.configuration_size
        if x.shape != (size,):
            raise GraspAtlasError(
                f"{name} must be a chart's number, a grasp, or {size} numbers; got an array of shape {x.shape}"
            )
        _check_on_manifold(atlas, result, name, x)
        chart, distance = atlas.locate(x)
        if chart < 0 or distance > NEAR * atlas.radius:
            raise GraspAtlasError(f"no chart of the atlas covers {name}; give a point connected to its first one")
        near = float(np.linalg.norm(atlas.system.difference(atlas.centers[chart], x))) <= SAME
        return cls(name, x, chart, near)

    @property
    def words(self) -> str:
        """Which end it is, and where."""
        return f"{self.name} ({'chart' if self.at_centre else 'in chart'} {self.chart})"

    def must_meet(self, result: GraspAtlas) -> None:
        """Make sure that the grasp meets the requirements."""
        if self.at_centre and result.accepted[self.chart]:
            return
        if self.at_centre or not result.meets(self.x[None])[0]:
            raise GraspAtlasError(
                f"{self.words} does not meet the requirements, which {result.accepted.sum()} charts do: see "
                "result.accepted, or leave out accepted=True"
            )


def _check_on_manifold(atlas: Atlas, result: GraspAtlas | None, name: str, x: Array) -> None:
    if not np.isfinite(x).all():
        raise GraspAtlasError(f"{name} holds a number that is not finite")
    residual = np.abs(atlas.system.evaluate_residual(x)).max(initial=0.0)
    if result is not None:
        residual = max(residual, np.abs(result.problem.frozen_residual(x, result.dimension)).max(initial=0.0))
    if residual > RESIDUAL_TOLERANCE:
        raise GraspAtlasError(
            f"{name} is not on the manifold: its largest residual is {residual:.1e}, at most {RESIDUAL_TOLERANCE:g} is "
            "allowed; give a chart's number or a grasp of this atlas"
        )
    slack = float(atlas.system.slack(x).min(initial=0.0))
    if slack < -BOUND_TOLERANCE:
        raise GraspAtlasError(f"{name} is {-slack:.1e} outside its bounds [units of the tangent space]")


class _ChartGraph:
    """Charts that may be passed as a graph, with the two ends of the path.

    Nodes are charts by their numbers, and ends that are no chart's centre after them.
    """

    def __init__(
        self, atlas: Atlas, open_charts: BoolArray, ends: list[_End], step: float, allowed: Allowed | None
    ) -> None:
        self.atlas, self.ends, self.step, self.allowed = atlas, ends, step, allowed
        pairs, lengths = [atlas.neighbour_pairs.astype(np.int64)], [atlas.neighbour_distances]
        self.points = [*atlas.centers]
        self.nodes = []
        for end in ends:
            self.nodes.append(end.chart if end.at_centre else len(self.points))
            if not end.at_centre:
                beside = np.append(atlas.neighbours[end.chart], end.chart)
                pairs.append(np.column_stack([beside, np.full(len(beside), len(self.points))]))
                to_end = [atlas.system.difference(self.points[i], end.x) for i in beside]
                lengths.append(np.linalg.norm(np.reshape(to_end, (len(beside), -1)), axis=1))
                self.points.append(end.x)
        self.open = np.append(open_charts, np.ones(len(self.points) - atlas.n_charts, bool))
        edges = np.concatenate(pairs)
        passable = self.open[edges].all(axis=1)
        self.pairs, self.lengths = edges[passable], np.concatenate(lengths)[passable]
        self.chains: dict[tuple[int, int], Array] = {}
        self.n_closed = 0

    def shortest_chain(self) -> Array:
        """The shortest chain of points from end to end [n, configuration_size].

        Neighbours between which no chain leads, or none that is allowed, are parted, and the way is sought again.
        """
        while True:
            route = self._route()
            legs = [(min(pair), max(pair)) for pair in pairwise(route)]
            closed = self._connect([leg for leg in legs if leg not in self.chains])
            if not closed:
                break
            self.n_closed += len(closed)
            numbers, parted = self._numbers(self.pairs), self._numbers(np.array(sorted(closed)))
            keep = ~np.isin(numbers, parted)
            self.pairs, self.lengths = self.pairs[keep], self.lengths[keep]
        pieces = [self.chains[a, b] if a < b else self.chains[b, a][::-1] for a, b in pairwise(route)]
        return np.concatenate([pieces[0], *(piece[1:] for piece in pieces[1:])])

    def _connect(self, legs: list[tuple[int, int]]) -> set[tuple[int, int]]:
        """Find the chains of legs; legs that have none are returned."""
        found = {(a, b): bridge(self.atlas.system, self.points[a], self.points[b], self.step) for a, b in legs}
        closed = {leg for leg, chain in found.items() if chain is None}
        chains = {leg: chain for leg, chain in found.items() if chain is not None}
        if self.allowed is not None and chains:
            free = self.allowed(np.concatenate([*chains.values()]))
            starts = np.cumsum([0, *(len(chain) for chain in chains.values())])
            closed |= {leg for leg, a, b in zip(chains, starts[:-1], starts[1:], strict=True) if not free[a:b].all()}
        self.chains |= {leg: chain for leg, chain in chains.items() if leg not in closed}
        return closed

    def _numbers(self, pairs: IntArray) -> IntArray:
        """A number for each pair of nodes, whichever comes first (p,)."""
        return np.asarray(pairs.min(axis=1) * len(self.points) + pairs.max(axis=1), np.int64)

    def _route(self) -> list[int]:
        """Nodes of the shortest way through the graph."""
        from scipy.sparse.csgraph import dijkstra  # slow to import

        start, end = self.nodes
        graph = self._graph()
        distances, before = dijkstra(graph, directed=False, indices=start, return_predecessors=True)
        if not np.isfinite(distances[end]):
            raise NotConnected(*self._pieces(graph), self.n_closed)
        route = [end]
        while route[-1] != start:
            route.append(int(before[route[-1]]))
        return route[::-1]

    def _graph(self) -> sparse.csr_array:
        from scipy.sparse import coo_array  # slow to import

        n = len(self.points)
        return coo_array((self.lengths, (self.pairs[:, 0], self.pairs[:, 1])), shape=(n, n)).tocsr()

    def _pieces(self, graph: sparse.csr_array) -> tuple[tuple[Piece, Piece], int]:
        """The pieces of the graph in which start and end lie, and how many there are."""
        from scipy.sparse.csgraph import connected_components  # slow to import

        group = connected_components(graph, directed=False)[1]
        charts = np.arange(self.atlas.n_charts)
        pieces = [
            Piece(end.words, charts[self.open[charts] & (group[charts] == group[node])])
            for end, node in zip(self.ends, self.nodes, strict=True)
        ]
        return (pieces[0], pieces[1]), len(np.unique(group[self.open]))
