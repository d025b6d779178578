"""The atlas of a manifold as arrays: charts, their polytopes and who neighbours whom (Section IV of the paper)."""

from __future__ import annotations

from dataclasses import dataclass, fields
from enum import Enum
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import nnls
from scipy.spatial import ConvexHull, cKDTree

from graspatlas import _core
from graspatlas.errors import GraspAtlasError
from graspatlas.support.pickling import Light
from graspatlas.support.validation import number_array, read_only
from graspatlas.systems.projection import checked_point
from graspatlas.systems.system import AnySystem

if TYPE_CHECKING:
    from pandas import DataFrame

__all__ = ["BOX_TAG", "Atlas", "Audit", "Closed", "Status"]

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]

#: Facet tag of the initial box; a tag t >= 0 is the neighbour's index, t <= -2 is bound -2 - t.
BOX_TAG = -1
#: Largest entry of |R(x)| of a point that is looked up.
ON_MANIFOLD = 1e-6
#: How far Newton's method may come down from a point that it should lead to, as a share of the radius.
SAME_SHEET = 0.01
#: Coordinates of a point that is looked up are smaller, so that their squares do not overflow.
LARGEST = 1e100
#: Facets of a polygon shorter than this share of the radius are left out of the surface's triangulation.
SHORT_FACET = 0.05


class Status(str, Enum):
    """How the construction of an atlas ended; all but the first are cut short."""

    COMPLETE = "complete"
    CHART_LIMIT = "cut short: limit of charts"
    TIME_LIMIT = "cut short: limit of time"
    MEMORY_LIMIT = "cut short: limit of memory"
    INTERRUPTED = "cut short: interrupted"
    BLOCKED = "cut short: steps from some charts failed"

    def __str__(self) -> str:
        return self.value


class Closed(int, Enum):
    """Why a vertex of a polytope was not expanded; covered: an audit went on there by small steps, to other charts."""

    OPEN = 0
    BOUNDS = 1
    CURVATURE = 2
    NOT_CONVERGED = 3
    COVERED = 4


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


@dataclass(frozen=True, eq=False)
class Atlas(Light):
    """Charts that cover the part of a manifold connected to a first point.

    Chart i covers the points above the polytope ``{u : facet_normals u <= facet_offsets}`` of its tangent space; facets
    and vertices of all charts are stored one after another, chart i has rows ``start[i]`` to ``start[i + 1]``. The
    arrays cannot be written to: copy what you want to change.

    Attributes:
        system: The system R(x) = 0.
        radius, epsilon: r and epsilon of the paper [units of the tangent space].
        status: Whether the atlas is complete.
        seconds: Time that its construction took.
        audit: How it was looked for points that no chart covers.
        centers: Chart centres x_i [n, configuration_size].
        bases: Orthonormal tangent bases Phi_i, one tangent vector a row [n, k, tangent_size].
        residuals: Largest entry of |R(x_i)| [n].
        regularities: About the smallest singular value of the Jacobian at each centre [n], its rows divided by their
            largest entries.
        nearly_singular: Charts within which the Jacobian loses rank, or falls below a tenth of that [n].
        facet_start, facet_normals, facet_offsets, facet_tags: Facets [n + 1], [f, k], [f], [f]; see ``BOX_TAG``.
        vertex_start, vertices, vertex_closed: Vertices [n + 1], [v, k], and the :class:`Closed` reason of each [v].
        neighbour_pairs: Pairs of charts that cut each other [p, 2].
    """

    system: AnySystem
    radius: float
    epsilon: float
    status: Status
    seconds: float
    audit: Audit
    centers: Array
    bases: Array
    residuals: Array
    regularities: Array
    nearly_singular: NDArray[np.bool_]
    facet_start: IntArray
    facet_normals: Array
    facet_offsets: Array
    facet_tags: NDArray[np.int32]
    vertex_start: IntArray
    vertices: Array
    vertex_closed: NDArray[np.uint8]
    neighbour_pairs: NDArray[np.int32]

    def __repr__(self) -> str:
        sizes = f"k = {self.dimension}, r = {self.radius:g}, epsilon = {self.epsilon:g}"
        return f"<Atlas of {self.n_charts} charts, {sizes}: {self.status}>"

    def __post_init__(self) -> None:
        for f in fields(self):
            if isinstance(array := getattr(self, f.name), np.ndarray):
                object.__setattr__(self, f.name, read_only(array))

    def check_arrays(self) -> None:
        """Make sure that the arrays fit together, for an atlas that was read from a file.

        Raises:
            GraspAtlasError: If a shape, a type or an index is wrong, or a number is not finite.
        """
        n, k, v = len(self.centers), self.system.dimension, self.system.tangent_size
        facets, vertices = len(self.facet_offsets), len(self.vertex_closed)
        shapes = {
            "centers": (n, self.system.configuration_size),
            "bases": (n, k, v),
            "residuals": (n,),
            "regularities": (n,),
            "nearly_singular": (n,),
            "facet_start": (n + 1,),
            "facet_normals": (facets, k),
            "facet_offsets": (facets,),
            "facet_tags": (facets,),
            "vertex_start": (n + 1,),
            "vertices": (vertices, k),
            "vertex_closed": (vertices,),
            "neighbour_pairs": (len(self.neighbour_pairs), 2),
        }
        for name, shape in shapes.items():
            array = getattr(self, name)
            whole = name in ("facet_start", "facet_tags", "vertex_start", "vertex_closed", "neighbour_pairs")
            kinds = "b" if name == "nearly_singular" else "iu" if whole else "f"
            if array.shape != shape or array.dtype.kind not in kinds:
                raise GraspAtlasError(f"array '{name}' has shape {array.shape} and type {array.dtype}, not {shape}")
            if kinds == "f" and not (np.abs(array.astype(float)) < LARGEST).all():
                raise GraspAtlasError(f"array '{name}' holds a number that is not finite, or not below {LARGEST:g}")
        ends_fit = all(
            start[0] == 0 and start[-1] == end and (np.diff(start) > k).all()
            for start, end in ((self.facet_start, facets), (self.vertex_start, vertices))
        )
        pairs = self.neighbour_pairs
        in_order = (pairs[:, 0] < pairs[:, 1]).all() and len(np.unique(pairs, axis=0)) == len(pairs)
        in_range = in_order and (pairs >= 0).all() and (pairs < n).all() and (self.facet_tags < n).all()
        if n == 0 or not ends_fit or not in_range:
            raise GraspAtlasError("its charts, facets and neighbours do not fit together")

    @property
    def n_charts(self) -> int:
        """Number of charts."""
        return len(self.centers)

    @property
    def dimension(self) -> int:
        """k: dimension of the manifold."""
        return int(self.bases.shape[1])

    @property
    def box_half_width(self) -> float:
        """Half the width of the box that each polytope was cut from: it encloses the ball, and on a line exceeds it."""
        return 1.5 * self.radius if self.dimension == 1 else self.radius

    @property
    def complete(self) -> bool:
        """True when no chart was left to expand, an audit found nothing uncovered, and no vertex is blocked."""
        return self.status is Status.COMPLETE and self.blocked == 0

    @property
    def blocked(self) -> int:
        """How many vertices no step could leave for curvature or want of convergence: what lies there is not known."""
        reasons = (Closed.CURVATURE.value, Closed.NOT_CONVERGED.value)
        return int(np.isin(self.vertex_closed, reasons).sum())

    @property
    def doubts(self) -> tuple[str, ...]:
        """Why charts may be missing, each with what to do; empty when nothing speaks against it.

        The Jacobian of a grasp that nearly loses rank may belong to two branches of the manifold that meet there, of
        which the atlas may follow one.
        """
        doubts = []
        if self.status not in (Status.COMPLETE, Status.BLOCKED):
            doubts.append(f"the atlas is {self.status}")
        if self.blocked:
            doubts.append(
                f"at {self.blocked} vertices no step succeeds, and what lies there is not known; use a smaller radius"
            )
        if self.complete and self.audit.points == 0:
            doubts.append(
                "no point could be found beside the charts, to look whether they cover all; use a smaller radius"
            )
        count = int(self.nearly_singular.sum())
        if count:
            doubts.append(
                f"at {count} charts the Jacobian nearly loses rank: other branches may begin there; see whether "
                "find_components finds more"
            )
        return tuple(doubts)

    @property
    def closed_vertices(self) -> dict[str, int]:
        """How many vertices outside their chart's ball no step could leave, by reason."""
        return {
            reason.name.lower(): int((self.vertex_closed == reason.value).sum())
            for reason in Closed
            if reason is not Closed.OPEN
        }

    def facets(self, chart: int) -> tuple[Array, Array, NDArray[np.int32]]:
        """Unit normals [f, k], offsets [f] and tags [f] of a chart's polytope: normals u <= offsets."""
        rows = slice(self.facet_start[chart], self.facet_start[chart + 1])
        return self.facet_normals[rows], self.facet_offsets[rows], self.facet_tags[rows]

    def polytope(self, chart: int) -> Array:
        """Vertices of a chart's polytope [v, k]; in order round the polygon when k = 2."""
        vertices = self.vertices[self.vertex_start[chart] : self.vertex_start[chart + 1]]
        if self.dimension == 2:
            return np.asarray(vertices[np.argsort(np.arctan2(vertices[:, 1], vertices[:, 0]))])
        return vertices

    def point(self, chart: int, u: ArrayLike) -> Array | None:
        """Point of the manifold above u [k] of a chart, eqs (14) and (15).

        Returns:
            The point [configuration_size], or None when Newton's method does not converge.
        """
        x = _core.project(self.system, self.centers[chart], self.bases[chart], number_array(u, "u"))
        return None if x is None else np.asarray(x)

    @cached_property
    def volumes(self) -> Array:
        """k-dimensional volume of each chart's polytope [n]."""
        if self.dimension == 1:
            return np.array([np.ptp(self.polytope(i)) for i in range(self.n_charts)])
        return np.array([ConvexHull(self.polytope(i)).volume for i in range(self.n_charts)])

    @cached_property
    def neighbours(self) -> list[IntArray]:
        """Neighbours of each chart, ascending."""
        pairs = np.concatenate([self.neighbour_pairs, self.neighbour_pairs[:, ::-1]]).astype(np.int64)
        pairs = pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]
        ends = np.searchsorted(pairs[:, 0], np.arange(self.n_charts + 1))
        return [pairs[a:b, 1] for a, b in pairwise(ends)]

    @cached_property
    def _index(self) -> cKDTree:
        return cKDTree(np.array([self.system.embed(x) for x in self.centers]))

    def locate(self, x: ArrayLike) -> tuple[int, float]:
        """Chart whose polytope a point of the manifold lies in, or the nearest one.

        Charts of another sheet do not count, however near: from the point's image, eq (15) must lead back to the point.

        Args:
            x: A point of the manifold [configuration_size].

        Returns:
            The chart's index and the distance from the point's image to the polytope, 0 inside; (-1, inf) when no chart
            within reach has the point near its tangent space.

        Raises:
            GraspAtlasError: If x has another shape, is not finite, or is off the manifold by more than ``ON_MANIFOLD``.
        """
        point = checked_point(self.system, x, "x")
        residual = float(np.abs(self.system.evaluate_residual(point)).max(initial=0.0))
        if not residual <= ON_MANIFOLD:
            raise GraspAtlasError(
                f"x is off the manifold: R(x) has an entry of {residual:.3g}, and at most {ON_MANIFOLD:g} is allowed; "
                "project it first: graspatlas.project(atlas.system, x)"
            )
        best, best_distance = -1, np.inf
        for chart in sorted(self._index.query_ball_point(self.system.embed(point), 2.0 * self.radius)):
            displacement = self.system.difference(self.centers[chart], point)
            u = self.bases[chart] @ displacement
            if displacement @ displacement - u @ u > self.epsilon**2:
                continue
            normals, offsets, _ = self.facets(chart)
            excess = normals @ u - offsets
            if excess.max() >= best_distance:
                continue
            distance = 0.0 if excess.max() <= 0.0 else float(np.linalg.norm(shortest_way(normals, excess)))
            if distance < best_distance and self._leads_to(chart, u, point):
                best, best_distance = chart, distance
            if best_distance == 0.0:
                break
        return best, best_distance

    def _leads_to(self, chart: int, u: Array, point: Array) -> bool:
        """False when u of a chart lies below another point of the manifold than this one."""
        above = self.point(chart, u)
        if above is None:
            return True
        apart = float(np.linalg.norm(self.system.difference(above, point)))
        if isinstance(self.system, _core.GraspSystem):
            # Its differences leave out the hand motions that are frozen.
            hand = slice(self.system.hand_q_size)
            apart = max(apart, float(np.abs(above[hand] - point[hand]).max()))
        return apart <= SAME_SHEET * self.radius

    def euler_characteristic(self) -> int:
        """Euler characteristic V - E + F of the surface that the charts triangulate; for closed manifolds with k = 2.

        Charts are the vertices, facets that two charts have in common are the edges, and the faces are traced round the
        charts' polygons, so that the count holds also where four charts meet.

        Raises:
            GraspAtlasError: If k is not 2, or the atlas has a boundary or is cut short.
        """
        if self.dimension != 2:
            raise GraspAtlasError(f"the Euler characteristic is counted for k = 2, this atlas has k = {self.dimension}")
        if not self.complete or (self.facet_tags < 0).any():
            raise GraspAtlasError("the Euler characteristic needs a complete atlas without boundary")
        rings, edges = self._rotation_system()
        seen: set[tuple[int, int, int]] = set()
        faces = 0
        for start in [(i, j, turn) for turn in (1, -1) for i in rings for j in rings[i]]:
            if start in seen:
                continue
            faces += 1
            dart = start
            while dart not in seen:
                seen.add(dart)
                i, j, turn = dart
                turn *= self._orientation(i, j)
                ring = rings[j]
                dart = (j, ring[(ring.index(i) + turn) % len(ring)], turn)
        # Every face is traced twice, once in each direction.
        return len(rings) - len(edges) + faces // 2

    def _rotation_system(self) -> tuple[dict[int, list[int]], set[tuple[int, int]]]:
        """Neighbours of each chart in order round its polygon, joined by facets that both charts have.

        Short facets are left out: near a corner of four charts, seen in four tangent planes, both diagonals may seem to
        be edges. Leaving out an edge joins two faces and keeps V - E + F.
        """
        order = {i: self._facet_ring(i) for i in range(self.n_charts)}
        edges = {(i, j) for i, ring in order.items() for j in ring if i < j and i in order[j]}
        rings = {i: [j for j in ring if (min(i, j), max(i, j)) in edges] for i, ring in order.items()}
        return rings, edges

    def _facet_ring(self, chart: int) -> list[int]:
        """Neighbours behind the long facets of a polygon, in order round it."""
        normals, offsets, tags = self.facets(chart)
        ring = np.argsort(np.arctan2(normals[:, 1], normals[:, 0]))
        after = np.roll(ring, -1)
        corners = np.linalg.solve(
            np.stack([normals[ring], normals[after]], axis=1),
            np.stack([offsets[ring], offsets[after]], axis=1)[..., None],
        )[..., 0]
        lengths = np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1)
        return [int(tags[f]) for f, length in zip(ring, lengths, strict=True) if length > SHORT_FACET * self.radius]

    def _orientation(self, i: int, j: int) -> int:
        """1 when the tangent bases of two charts have the same orientation, else -1."""
        return 1 if np.linalg.det(self.bases[i] @ self.bases[j].T) > 0.0 else -1

    def to_pandas(self, *, volumes: bool = False) -> DataFrame:
        """The charts as a table, one row a chart: centre, residual, neighbours, facets and closed vertices.

        Columns are ``x0``, ``x1`` and so on, the numbers of the centre; ``residual``, the largest entry of |R(x)|;
        ``n_neighbours``; ``n_facets``; ``n_vertices``; and how many vertices were not expanded, by reason:
        ``closed_bounds``, ``closed_curvature``, ``closed_not_converged``.

        Args:
            volumes: Add ``volume``, that of each chart's polytope; slow in high dimensions.

        Raises:
            GraspAtlasError: If pandas is not installed.
        """
        from graspatlas.result.data_frames import atlas_frame  # pandas is slow to import

        return atlas_frame(self, volumes)

    def neighbours_to_pandas(self) -> DataFrame:
        """Pairs of neighbouring charts as a table: ``chart``, ``neighbour`` and ``distance``, each pair once.

        The distance of the centres is in units of the tangent space.

        Raises:
            GraspAtlasError: If pandas is not installed.
        """
        from graspatlas.result.data_frames import neighbour_frame  # pandas is slow to import

        return neighbour_frame(self)

    def to_arrays(self) -> dict[str, Any]:
        """All arrays by name, for storing."""
        return {f.name: getattr(self, f.name) for f in fields(self) if f.name not in _SCALARS}


_SCALARS = ("system", "radius", "epsilon", "status", "seconds", "audit")


def shortest_way(normals: Array, excess: Array) -> Array:
    """Shortest d [k] with normals d <= -excess: from a point to a polytope, whose facets it is beyond by the excess.

    Source: C. L. Lawson and R. J. Hanson, "Solving Least Squares Problems", Chapter 23: least-distance programming as a
    non-negative least-squares problem.
    """
    A = np.vstack([-normals.T, excess[None]])
    goal = np.zeros(len(A))
    goal[-1] = 1.0
    r = A @ nnls(A, goal)[0] - goal
    return np.asarray(-r[:-1] / r[-1])
