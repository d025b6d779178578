"""The atlas of a manifold as arrays: charts, their polytopes and who neighbours whom (Section IV of the paper)."""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graspatlas import _core
from graspatlas.atlas.status import Audit, Closed, Status
from graspatlas.atlas.topology import euler_characteristic, facet_ring
from graspatlas.errors import GraspAtlasError
from graspatlas.storage.columns import joined, to_frame
from graspatlas.support.arrays import AnyArray, Array, BoolArray, Int32Array, IntArray
from graspatlas.support.notebooks import Displayed
from graspatlas.support.pickling import Light
from graspatlas.support.validation import number_array, read_only
from graspatlas.systems.projection import checked_point
from graspatlas.systems.system import AnySystem

if TYPE_CHECKING:
    from pandas import DataFrame
    from scipy.spatial import cKDTree

__all__ = ["BOX_TAG", "Atlas"]


#: Tag of a facet that is a face of the box from which a chart's polytope is cut. A tag t >= 0 is the neighbour's index,
#: t <= -2 is bound -2 - t.
BOX_TAG = _core.Polytope.BOX_TAG
#: Largest entry of |R(x)| of a point that is looked up.
ON_MANIFOLD = 1e-6
#: How far Newton's method may come down from a point that it should lead to, as a share of the radius.
SAME_SHEET = 0.01
#: Coordinates of a point that is looked up are smaller, so that their squares do not overflow.
LARGEST = 1e100
#: Facets of a polygon shorter than this share of the radius are left out of the surface's triangulation.
SHORT_FACET = 0.05

#: Vertices of a polytope nearer to each other than this share of the radius count as one for its volume.
_GRAIN = 1e-7
#: Pairs of charts of which distances are computed at a time.
_PAIRS = 1 << 16


@dataclass(frozen=True, eq=False)
class Atlas(Light, Displayed):
    """Charts that cover the part of a manifold connected to a first point.

    Chart i covers the points above the polytope ``{u : facet_normals u <= facet_offsets}`` of its tangent space; facets
    and vertices of all charts are stored one after another, chart i has rows ``start[i]`` to ``start[i + 1]``. The
    arrays cannot be written to: copy what you want to change.

    Attributes:
        system: The system R(x) = 0.
        radius, epsilon: r and epsilon of the paper [units of the tangent space].
        status: Whether the atlas is complete.
        seconds: Time that its construction took.
        n_projections: Newton projections that it took, those that failed or told charts' sheets apart included; since
            the checkpoint, if it went on from one.
        audit: How it was looked for points that no chart covers.
        centers: Chart centres x_i [n, configuration_size].
        bases: Orthonormal tangent bases Phi_i, one tangent vector a row [n, k, tangent_size].
        residuals: Largest entry of ``|R(x_i)|`` [n].
        regularities: About the smallest singular value of the Jacobian at each centre [n], its rows divided by their
            largest entries.
        nearly_singular: Charts within which the Jacobian loses rank, or falls below a tenth of that [n].
        facet_start, facet_normals, facet_offsets, facet_tags: Facets [n + 1], [f, k], [f], [f]; see ``BOX_TAG``.
        vertex_start, vertices, vertex_closed: Vertices [n + 1], [v, k], and the :class:`Closed` reason of each [v].
            From four dimensions on, where polytopes have very many, they are only those outside the ball of the radius
            that could not be expanded; :meth:`polytope` finds all. There half-spaces that cut nothing off are among the
            facets, too.
        neighbour_pairs: Pairs of charts that cut each other [p, 2].
    """

    system: AnySystem
    radius: float
    epsilon: float
    status: Status
    seconds: float
    n_projections: int
    audit: Audit
    centers: Array
    bases: Array
    residuals: Array
    regularities: Array
    nearly_singular: BoolArray
    facet_start: IntArray
    facet_normals: Array
    facet_offsets: Array
    facet_tags: Int32Array
    vertex_start: IntArray
    vertices: Array
    vertex_closed: NDArray[np.uint8]
    neighbour_pairs: Int32Array

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
            start[0] == 0 and start[-1] == end and (np.diff(start) >= least).all()
            for start, end, least in (
                (self.facet_start, facets, k + 1),
                (self.vertex_start, vertices, k + 1 if self.lists_all_vertices else 0),
            )
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
    def lists_all_vertices(self) -> bool:
        """Whether ``vertices`` holds those of the whole polytopes: below four dimensions."""
        return _core.Polytope.lists_all(self.dimension)

    @property
    def box_half_width(self) -> float:
        """Half the width of the box that each polytope was cut from: it encloses the ball, and on a line exceeds it."""
        return _core.box_half_width(self.dimension, self.radius)

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
            doubts.append("the audit found no point to test whether the charts cover everything; use a smaller radius")
        count = int(self.nearly_singular.sum())
        if count:
            doubts.append(
                f"at {count} charts the Jacobian nearly loses rank: other branches may begin there; check whether "
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

    def facets(self, chart: int) -> tuple[Array, Array, Int32Array]:
        """Unit normals [f, k], offsets [f] and tags [f] of a chart's polytope: normals u <= offsets."""
        rows = slice(self.facet_start[chart], self.facet_start[chart + 1])
        return self.facet_normals[rows], self.facet_offsets[rows], self.facet_tags[rows]

    def polytope(self, chart: int) -> Array:
        """Vertices of a chart's polytope [v, k]; in order round the polygon when k = 2."""
        if not self.lists_all_vertices:
            normals, offsets, tags = self.facets(chart)
            cuts = tags != BOX_TAG
            return _core.Polytope.vertices_of(self.box_half_width, normals[cuts], offsets[cuts])
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
        from scipy.spatial import ConvexHull  # slow to import

        if self.dimension == 1:
            return np.array([np.ptp(self.polytope(i)) for i in range(self.n_charts)])
        # Corners where more than k facets meet are several points next to each other, which Qhull cannot tell apart.
        grain = _GRAIN * self.radius
        corners = (np.unique(np.round(self.polytope(i) / grain), axis=0) * grain for i in range(self.n_charts))
        return np.array([ConvexHull(points).volume for points in corners])

    @cached_property
    def _vertex_counts(self) -> IntArray:
        if self.lists_all_vertices:
            return np.diff(self.vertex_start)
        return np.array([len(self.polytope(i)) for i in range(self.n_charts)])

    @cached_property
    def neighbours(self) -> list[IntArray]:
        """Neighbours of each chart, ascending."""
        pairs = np.concatenate([self.neighbour_pairs, self.neighbour_pairs[:, ::-1]]).astype(np.int64)
        pairs = pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]
        ends = np.searchsorted(pairs[:, 0], np.arange(self.n_charts + 1))
        return [pairs[a:b, 1] for a, b in pairwise(ends)]

    @cached_property
    def neighbour_distances(self) -> Array:
        """Distances of the centres of neighbouring charts, in the order of `neighbour_pairs` [p], as `radius`."""
        x = self.centers
        parts = (self.neighbour_pairs[i : i + _PAIRS] for i in range(0, len(self.neighbour_pairs), _PAIRS))
        steps = [np.linalg.norm(self.system.differences(x[pairs[:, 0]], x[pairs[:, 1]]), axis=1) for pairs in parts]
        return read_only(np.concatenate(steps or [np.zeros(0)]))

    @cached_property
    def _index(self) -> cKDTree:
        from scipy.spatial import cKDTree  # slow to import

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
        return self.system.same_point(above, point, SAME_SHEET * self.radius)

    def euler_characteristic(self) -> int:
        """Euler characteristic V - E + F of the surface that the charts triangulate; for closed manifolds with k = 2.

        Raises:
            GraspAtlasError: If k is not 2, or the atlas has a boundary or is cut short.
        """
        if self.dimension != 2:
            raise GraspAtlasError(f"the Euler characteristic is counted for k = 2, this atlas has k = {self.dimension}")
        if not self.complete or (self.facet_tags < 0).any():
            raise GraspAtlasError("the Euler characteristic needs a complete atlas without boundary")
        rings = [facet_ring(*self.facets(chart), SHORT_FACET * self.radius) for chart in range(self.n_charts)]
        return euler_characteristic(rings, self.bases)

    def to_pandas(self, *, volumes: bool = False) -> DataFrame:
        """The charts as a table, one row a chart: centre, residual, neighbours, facets and closed vertices.

        Columns are ``x0``, ``x1`` and so on, the numbers of the centre; ``residual``, the largest entry of ``|R(x)|``;
        ``n_neighbours``; ``n_facets``; ``n_vertices``; and how many vertices were not expanded, by reason:
        ``closed_bounds``, ``closed_curvature``, ``closed_not_converged``, ``closed_covered``.

        Args:
            volumes: Add ``volume``, that of each chart's polytope; slow in high dimensions.

        Raises:
            GraspAtlasError: If pandas is not installed.
        """
        centers = {f"x{i}": column for i, column in enumerate(self.centers.T)}
        return to_frame(joined(centers, self.chart_columns(volumes)))

    def chart_columns(self, volumes: bool = False) -> dict[str, AnyArray]:
        """What is known of each chart besides its centre, by name; see :meth:`to_pandas`."""
        n = self.n_charts
        chart_of_vertex = np.repeat(np.arange(n), np.diff(self.vertex_start))
        columns: dict[str, AnyArray] = {
            "residual": self.residuals,
            "n_neighbours": np.bincount(self.neighbour_pairs.ravel(), minlength=n),
            "n_facets": np.diff(self.facet_start),
            "n_vertices": self._vertex_counts,
        }
        for reason in Closed:
            if reason is not Closed.OPEN:
                closed = chart_of_vertex[self.vertex_closed == reason.value]
                columns[f"closed_{reason.name.lower()}"] = np.bincount(closed, minlength=n)
        return {**columns, "volume": self.volumes} if volumes else columns

    def neighbours_to_pandas(self) -> DataFrame:
        """Pairs of neighbouring charts as a table: ``chart``, ``neighbour`` and ``distance``, each pair once.

        The distance of the centres is in units of the tangent space.

        Raises:
            GraspAtlasError: If pandas is not installed.
        """
        pairs = self.neighbour_pairs
        columns: dict[str, AnyArray] = {
            "chart": pairs[:, 0],
            "neighbour": pairs[:, 1],
            "distance": self.neighbour_distances,
        }
        return to_frame(columns, index=None)

    def to_arrays(self) -> dict[str, AnyArray]:
        """All arrays by name, for storing."""
        return {f.name: getattr(self, f.name) for f in fields(self) if f.name not in _SCALARS}


_SCALARS = ("system", "radius", "epsilon", "status", "seconds", "n_projections", "audit")


def shortest_way(normals: Array, excess: Array) -> Array:
    """Shortest d [k] with normals d <= -excess: from a point to a polytope, whose facets it is beyond by the excess.

    Source: C. L. Lawson and R. J. Hanson, "Solving Least Squares Problems", Chapter 23: least-distance programming as a
    non-negative least-squares problem.
    """
    from scipy.optimize import nnls  # slow to import

    A = np.vstack([-normals.T, excess[None]])
    goal = np.zeros(len(A))
    goal[-1] = 1.0
    r = A @ nnls(A, goal)[0] - goal
    return np.asarray(-r[:-1] / r[-1])
