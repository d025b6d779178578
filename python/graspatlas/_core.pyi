"""
Compiled core of graspatlas: continuation, grasp systems and quality indices.
"""

from __future__ import annotations
import collections.abc
import numpy
import numpy.typing
import typing

__all__: list[str] = [
    "Angles",
    "AnySystem",
    "AtlasBuilder",
    "BSplinePatch",
    "Closed",
    "CollisionBatch",
    "ContactSide",
    "CurvePatch",
    "EllipsoidPatch",
    "FlippedPatch",
    "GraspAtlasError",
    "GraspSystem",
    "HoldingLimits",
    "JointInfo",
    "Measure",
    "Model",
    "Neighbours",
    "Patch",
    "PatchParameter",
    "PlanePatch",
    "Polytope",
    "PythonSystem",
    "ReachBatch",
    "RevolutionPatch",
    "Rotations",
    "Sphere",
    "Torus",
    "TorusPatch",
    "available_threads",
    "axes_measure",
    "ball_radii",
    "blurred",
    "box_half_width",
    "centrality_measure",
    "climbs",
    "closure_index_measure",
    "closure_measure",
    "contact_forces",
    "convex_hull",
    "corner_normals",
    "developed",
    "distances_from_hull",
    "distances_measure",
    "enlarged",
    "epsilon_measure",
    "force_closure_margins",
    "force_closure_slacks",
    "fragments_in_front",
    "holding_forces",
    "holding_index_measure",
    "holding_measure",
    "hull_volumes",
    "joint_margin_measure",
    "lay_over",
    "measured",
    "min_weights",
    "missed",
    "nearest_fragments",
    "numbers_measure",
    "project",
    "project_far",
    "read_collision_shapes",
    "read_visual_shapes",
    "resisted_loads",
    "round_ball_radii",
    "semi_axes",
    "shaded",
    "slacks_measure",
    "test_measure",
]

class GraspAtlasError(ValueError):
    pass

class AnySystem:
    """
    Equations R(x) = 0 on a configuration space.
    """
    def __repr__(self) -> str: ...
    def difference(
        self,
        x0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
        x1: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
    ) -> numpy.typing.NDArray[numpy.float64]:
        """
        x1 (-) x0 [tangent_size].
        """
    def differences(
        self,
        X0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
        X1: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
    ) -> numpy.typing.NDArray[numpy.float64]:
        """
        x1 (-) x0 of n pairs of points [n x tangent_size], each a row of X0 and X1 [n x configuration_size].
        """
    def embed(self, x: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> numpy.typing.NDArray[numpy.float64]:
        """
        Euclidean image of x, by which charts are looked up.
        """
    def evaluate_jacobian(
        self, x: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]
    ) -> numpy.typing.NDArray[numpy.float64]:
        """
        J(x) [n_equations x tangent_size], derivative of R(x (+) v) at v = 0.
        """
    def evaluate_residual(
        self, x: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]
    ) -> numpy.typing.NDArray[numpy.float64]:
        """
        R(x) [n_equations].
        """
    def integrate(
        self,
        x: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
        v: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
    ) -> numpy.typing.NDArray[numpy.float64]:
        """
        x (+) v [configuration_size].
        """
    def same_point(
        self,
        x0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
        x1: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
        tolerance: typing.SupportsFloat | typing.SupportsIndex,
    ) -> bool:
        """
        True when two points are one, to within a tolerance [units of the tangent space].
        """
    def slack(self, x: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> numpy.typing.NDArray[numpy.float64]:
        """
        Distance of x from each bound; negative outside.
        """
    @property
    def bound_normals(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        B [n_bounds x tangent_size]: slack(x (+) v) = slack(x) - B v to first order.
        """
    @property
    def configuration_size(self) -> int:
        """
        Numbers in a point x.
        """
    @property
    def dimension(self) -> int:
        """
        k: tangent_size - n_equations.
        """
    @property
    def n_equations(self) -> int:
        """
        Numbers in R(x).
        """
    @property
    def tangent_size(self) -> int:
        """
        Numbers in a tangent vector v.
        """

class PythonSystem(AnySystem):
    """
    Base of systems written in Python.
    """
    def __init__(
        self,
        n_variables: typing.SupportsInt | typing.SupportsIndex,
        n_equations: typing.SupportsInt | typing.SupportsIndex,
        lower: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
        upper: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
    ) -> None: ...
    def __reduce__(self) -> tuple[typing.Any, ...]: ...

class Sphere(AnySystem):
    """
    The unit sphere in R^n.
    """
    def __init__(self, n: typing.SupportsInt | typing.SupportsIndex) -> None: ...
    def __reduce__(self) -> tuple[typing.Any, ...]: ...

class Torus(AnySystem):
    """
    A torus in R^3.
    """
    def __init__(
        self,
        major_radius: typing.SupportsFloat | typing.SupportsIndex,
        minor_radius: typing.SupportsFloat | typing.SupportsIndex,
    ) -> None: ...
    def __reduce__(self) -> tuple[typing.Any, ...]: ...

class Angles(AnySystem):
    """
    n angles, no equation.
    """
    def __init__(self, n: typing.SupportsInt | typing.SupportsIndex) -> None: ...
    def __reduce__(self) -> tuple[typing.Any, ...]: ...

class Rotations(AnySystem):
    """
    All rotations, no equation.
    """
    def __init__(self) -> None: ...
    def __reduce__(self) -> tuple[typing.Any, ...]: ...

class Polytope:
    """
    A convex polytope in R^k: a box, cut by half-spaces.
    """

    BOX_TAG: typing.ClassVar[int] = -1
    @staticmethod
    def bound_of_tag(tag: typing.SupportsInt | typing.SupportsIndex) -> int:
        """
        The bound whose facets have a tag below -1.
        """
    @staticmethod
    def bound_tag(bound: typing.SupportsInt | typing.SupportsIndex) -> int:
        """
        Tag of the facets that a bound makes.
        """
    @staticmethod
    def lists_all(dimension: typing.SupportsInt | typing.SupportsIndex) -> bool:
        """
        Whether the polytopes of an atlas of this dimension list all vertices.
        """
    @staticmethod
    def vertices_of(
        half_width: typing.SupportsFloat | typing.SupportsIndex,
        normals: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
        offsets: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
    ) -> numpy.typing.NDArray[numpy.float64]:
        """
        Vertices [n x k] of a box that half-spaces cut: unit normals [m x k], offsets [m].
        """
    def __init__(
        self,
        dimension: typing.SupportsInt | typing.SupportsIndex,
        half_width: typing.SupportsFloat | typing.SupportsIndex,
        outer: bool = False,
    ) -> None:
        """
        The box [-half_width, half_width]^dimension; with `outer`, vertices outside a ball alone are listed.
        """
    def close(self, vertex: typing.SupportsInt | typing.SupportsIndex) -> None:
        """
        The vertex is not to be expanded.
        """
    def contains(
        self,
        u: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
        tolerance: typing.SupportsFloat | typing.SupportsIndex = 0.0,
    ) -> bool:
        """
        True when u is inside all half-spaces.
        """
    def cut(
        self,
        normal: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
        offset: typing.SupportsFloat | typing.SupportsIndex,
        tag: typing.SupportsInt | typing.SupportsIndex,
    ) -> bool:
        """
        Keep normal . u <= offset; False if nothing is cut off.
        """
    def expandable_vertex(self, radius: typing.SupportsFloat | typing.SupportsIndex) -> int:
        """
        Index of the farthest vertex outside the ball that was not closed, or -1; where `outer` vertices are listed this lists them first: all of them if they are closed.
        """
    @property
    def vertices(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        Vertices [n x k].
        """

class Neighbours:
    """
    Points that come one by one, and those within a distance of any point.
    """
    def __init__(self, size: typing.SupportsInt | typing.SupportsIndex) -> None: ...
    def insert(self, point: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> None:
        """
        Add a point [size]; points are numbered 0, 1, 2, ... as they come.
        """
    def within(
        self,
        point: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
        distance: typing.SupportsFloat | typing.SupportsIndex,
    ) -> list[int]:
        """
        Numbers of the points within a distance, and maybe of some farther by a millionth of how far the points are from the first one, ascending.
        """

class Closed:
    """
    Why a vertex of a polytope was not expanded.

    Members:

      OPEN

      BOUNDS

      CURVATURE

      NOT_CONVERGED

      COVERED
    """

    BOUNDS: typing.ClassVar[Closed]
    COVERED: typing.ClassVar[Closed]
    CURVATURE: typing.ClassVar[Closed]
    NOT_CONVERGED: typing.ClassVar[Closed]
    OPEN: typing.ClassVar[Closed]
    __members__: typing.ClassVar[dict[str, Closed]]
    @typing.overload
    def __eq__(self, other: Closed) -> bool: ...
    @typing.overload
    def __eq__(self, other: typing.Any) -> bool: ...
    def __getstate__(self) -> int: ...
    def __hash__(self) -> int: ...
    def __index__(self) -> int: ...
    def __init__(self, value: typing.SupportsInt | typing.SupportsIndex) -> None: ...
    def __int__(self) -> int: ...
    @typing.overload
    def __ne__(self, other: Closed) -> bool: ...
    @typing.overload
    def __ne__(self, other: typing.Any) -> bool: ...
    def __repr__(self) -> str: ...
    def __setstate__(self, state: typing.SupportsInt | typing.SupportsIndex) -> None: ...
    def __str__(self) -> str: ...
    @property
    def name(self) -> str: ...
    @property
    def value(self) -> int: ...

class AtlasBuilder:
    """
    Grows an atlas chart by chart (Algorithm 1, lines 4 to 13).
    """
    @staticmethod
    def resume(
        system: AnySystem,
        saved: dict[str, numpy.ndarray[typing.Any, numpy.dtype[typing.Any]]],
        radius: typing.SupportsFloat | typing.SupportsIndex,
        epsilon: typing.SupportsFloat | typing.SupportsIndex,
        threads: typing.SupportsInt | typing.SupportsIndex = 1,
    ) -> AtlasBuilder:
        """
        Goes on from what `save` returned, with all charts, to the same atlas.
        """
    def __init__(
        self,
        system: AnySystem,
        x0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
        radius: typing.SupportsFloat | typing.SupportsIndex,
        epsilon: typing.SupportsFloat | typing.SupportsIndex,
        threads: typing.SupportsInt | typing.SupportsIndex = 1,
    ) -> None: ...
    def arrays(self) -> dict[str, numpy.ndarray[typing.Any, numpy.dtype[typing.Any]]]:
        """
        The atlas as a dictionary of arrays.
        """
    def audit(
        self, points: typing.SupportsInt | typing.SupportsIndex, seconds: typing.SupportsFloat | typing.SupportsIndex
    ) -> None:
        """
        Look for points that a complete atlas does not cover, until that is done or the seconds have passed; where there is one the atlas is open again.
        """
    def expand(
        self,
        chart_limit: typing.SupportsInt | typing.SupportsIndex,
        seconds: typing.SupportsFloat | typing.SupportsIndex,
    ) -> None:
        """
        Expand until complete, the limit of charts is reached, or the seconds have passed.
        """
    def save(
        self, first: typing.SupportsInt | typing.SupportsIndex = 0
    ) -> dict[str, numpy.ndarray[typing.Any, numpy.dtype[typing.Any]]]:
        """
        All that is needed to go on later, as arrays, with the charts from `first` on.
        """
    def take_arrays(self) -> dict[str, numpy.ndarray[typing.Any, numpy.dtype[typing.Any]]]:
        """
        The same, for which the builder gives its own memory back: nothing but counts can be asked of it any more.
        """
    @property
    def audit_holes(self) -> int:
        """
        Charts that audits began where nothing was covered.
        """
    @property
    def audit_points(self) -> int:
        """
        Points of random walks that the last audit found covered; 0 when it was given up.
        """
    @property
    def audited(self) -> bool:
        """
        True when it is complete, and an audit has ended.
        """
    @property
    def complete(self) -> bool:
        """
        True when no chart is left to expand.
        """
    @property
    def n_bytes(self) -> int:
        """
        Memory that it holds.
        """
    @property
    def n_charts(self) -> int:
        """
        Charts so far.
        """
    @property
    def n_open(self) -> int:
        """
        Charts still to be expanded.
        """
    @property
    def n_projections(self) -> int:
        """
        Newton projections so far.
        """
    @property
    def n_settled(self) -> int:
        """
        Charts, the first ones, whose numbers stay.
        """
    @property
    def n_threads(self) -> int:
        """
        Threads that it uses.
        """

class JointInfo:
    """
    A joint's name and its places in q and v.
    """
    @property
    def name(self) -> str: ...
    @property
    def prismatic(self) -> bool: ...
    @property
    def q_index(self) -> int: ...
    @property
    def q_size(self) -> int: ...
    @property
    def v_index(self) -> int: ...
    @property
    def v_size(self) -> int: ...

class Model:
    """
    Hand and object as one kinematic tree.
    """
    def __init__(self, urdf: str, object_joint: str) -> None: ...
    def __reduce__(self) -> tuple[typing.Any, ...]: ...
    def frame_placements(
        self, q: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]
    ) -> dict[str, typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 4]"]]:
        """
        Frame name -> T_world_frame [4 x 4] at q.
        """
    @property
    def frames(self) -> dict[str, tuple[int, typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 4]"]]]:
        """
        Frame name -> (joint, placement of the frame in the joint [4 x 4]).
        """
    @property
    def hand_joints(self) -> list[JointInfo]:
        """
        Moving joints of the hand, in the order of q.
        """
    @property
    def hand_q_size(self) -> int:
        """
        Numbers in the hand's part of q.
        """
    @property
    def hand_v_size(self) -> int:
        """
        Numbers in the hand's part of a velocity.
        """
    @property
    def lower_limits(self) -> list[float]:
        """
        Lower joint limits [hand_q_size].
        """
    @property
    def neutral(self) -> list[float]:
        """
        Neutral configuration [q_size].
        """
    @property
    def object_joint(self) -> int:
        """
        Joint that carries the object; -1 without one.
        """
    @property
    def q_size(self) -> int:
        """
        Numbers in q.
        """
    @property
    def upper_limits(self) -> list[float]:
        """
        Upper joint limits [hand_q_size].
        """
    @property
    def v_size(self) -> int:
        """
        Numbers in a velocity.
        """

class Patch:
    """
    A parametrised piece of surface.
    """
    def evaluate(
        self, u: typing.SupportsFloat | typing.SupportsIndex, v: typing.SupportsFloat | typing.SupportsIndex
    ) -> dict[str, typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]]:
        """
        Point o, normal m, tangents a and b, and their derivatives by u and v.
        """

class PlanePatch(Patch):
    """
    The x-z plane of a placement, normal y.
    """
    def __init__(self, T: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"]) -> None: ...
    def __reduce__(self) -> tuple[typing.Any, ...]: ...

class RevolutionPatch(Patch):
    """
    A surface of revolution about y of a placement.
    """
    def __init__(
        self,
        T: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"],
        breaks: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex],
        coefficients: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 4]"],
    ) -> None: ...
    def __reduce__(self) -> tuple[typing.Any, ...]: ...

class TorusPatch(Patch):
    """
    A torus about y of a placement; a sphere with a ring of radius 0.
    """
    def __init__(
        self,
        T: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"],
        ring_radius: typing.SupportsFloat | typing.SupportsIndex,
        tube_radius: typing.SupportsFloat | typing.SupportsIndex,
    ) -> None: ...
    def __reduce__(self) -> tuple[typing.Any, ...]: ...

class EllipsoidPatch(Patch):
    """
    An ellipsoid with its semi-axes along x, y, z of a placement.
    """
    def __init__(
        self,
        T: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"],
        semi_axes: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"],
    ) -> None: ...
    def __reduce__(self) -> tuple[typing.Any, ...]: ...

class BSplinePatch(Patch):
    """
    A tensor-product B-spline.
    """
    def __init__(
        self,
        degrees: tuple[typing.SupportsInt | typing.SupportsIndex, typing.SupportsInt | typing.SupportsIndex],
        u_knots: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex],
        v_knots: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex],
        control_points: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 3]"],
        unit: str,
    ) -> None: ...
    def __reduce__(self) -> tuple[typing.Any, ...]: ...

class FlippedPatch(Patch):
    """
    A patch with the opposite normal.
    """
    def __init__(self, patch: Patch) -> None: ...
    def __reduce__(self) -> tuple[typing.Any, ...]: ...

class CurvePatch(Patch):
    """
    A curve u(s), v(s) on a patch.
    """
    def __init__(
        self,
        patch: Patch,
        breaks: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex],
        u: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 4]"],
        v: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 4]"],
    ) -> None: ...
    def __reduce__(self) -> tuple[typing.Any, ...]: ...

class PatchParameter:
    """
    One parameter of a patch: frozen, or an unknown.
    """
    def __init__(
        self,
        free: bool,
        value: typing.SupportsFloat | typing.SupportsIndex,
        periodic: bool,
        lower: typing.SupportsFloat | typing.SupportsIndex,
        upper: typing.SupportsFloat | typing.SupportsIndex,
    ) -> None: ...
    def __reduce__(self) -> tuple[typing.Any, ...]: ...

class ContactSide:
    """
    A patch on a joint of the model.
    """
    def __init__(
        self,
        joint: typing.SupportsInt | typing.SupportsIndex,
        T_joint_frame: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"],
        patch: Patch,
        u: PatchParameter,
        v: PatchParameter,
    ) -> None: ...
    def __reduce__(self) -> tuple[typing.Any, ...]: ...

class GraspSystem(AnySystem):
    """
    The relevant grasps R of a hand and an object.
    """
    def __init__(
        self,
        model: Model,
        contacts: collections.abc.Sequence[tuple[ContactSide, ContactSide]],
        motions: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"],
        length_scale: typing.SupportsFloat | typing.SupportsIndex,
        lower: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex],
        upper: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex],
        transmission: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"] | None = None,
    ) -> None: ...
    def __reduce__(self) -> tuple[typing.Any, ...]: ...
    def grasp_arrays(
        self, X: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]
    ) -> dict[str, numpy.ndarray[typing.Any, numpy.dtype[typing.Any]]]:
        """
        For grasps X [n x configuration_size]: T_palm_object, contact points and normals, J and G, as arrays.
        """
    @property
    def bound_names(self) -> list[str]:
        """
        Name of each bound, in the order of slack.
        """
    @property
    def hand_q_size(self) -> int:
        """
        Numbers of a point that are the hand's; they come first.
        """
    @property
    def n_contacts(self) -> int:
        """
        Number of contacts.
        """
    @property
    def n_parameters(self) -> int:
        """
        Free patch parameters.
        """
    @property
    def object_dof(self) -> int:
        """
        Degrees of freedom of the object.
        """

class HoldingLimits:
    """
    What holds an object; see holding_force.hpp.
    """
    def __init__(
        self,
        friction: typing.SupportsFloat | typing.SupportsIndex,
        torsional: typing.SupportsFloat | typing.SupportsIndex,
        normal_force: typing.SupportsFloat | typing.SupportsIndex,
        efforts: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
        center_of_mass: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"],
        torque_length: typing.SupportsFloat | typing.SupportsIndex,
        gap: typing.SupportsFloat | typing.SupportsIndex,
    ) -> None: ...

class CollisionBatch:
    """
    Collision shapes of hand and object; safe to call from any number of threads.
    """
    def __init__(
        self,
        model: Model,
        shapes: collections.abc.Sequence[
            tuple[
                str,
                str,
                typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"],
                typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
                typing.Annotated[numpy.typing.ArrayLike, numpy.int32],
                typing.SupportsInt | typing.SupportsIndex,
                typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"],
            ]
        ],
        pairs: typing.Annotated[numpy.typing.ArrayLike, numpy.int32],
        required: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
    ) -> None:
        """
        From shapes (name, kind, sizes [3], points [n x 3], triangles [t x 3], joint, placement [4 x 4]), pairs of them [p x 2] and the distances that the pairs must keep [p]; see collision_scene.hpp.
        """
    def first_hits(
        self, X: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]
    ) -> numpy.typing.NDArray[numpy.int32]:
        """
        First pair of each grasp that does not, or -1 [n].
        """
    def free(self, X: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> numpy.typing.NDArray[numpy.bool]:
        """
        Whether all pairs of each grasp keep their distances [n].
        """
    def nearest(
        self,
        X: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
        pairs: typing.Annotated[numpy.typing.ArrayLike, numpy.int32],
    ) -> dict[str, numpy.ndarray[typing.Any, numpy.dtype[typing.Any]]]:
        """
        Distances [n x p], and on_first, on_second and normals [n x p x 3] of pairs; see NearestPoints.
        """
    def point_distances(
        self,
        X: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
        shapes: typing.Annotated[numpy.typing.ArrayLike, numpy.int32],
        points: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
    ) -> numpy.typing.NDArray[numpy.float64]:
        """
        Distance of each point [palm] from the nearest of some shapes [n x points].
        """

class Measure:
    """
    An index or requirement that climbs follow; see climb/measure.hpp.
    """
    @property
    def any_thread(self) -> bool:
        """
        False where it asks Python.
        """

class ReachBatch:
    """
    An arm with a hand that looks for its postures; safe to call from any number of threads.
    """
    def __init__(
        self,
        model: Model,
        joint: typing.SupportsInt | typing.SupportsIndex,
        frame: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"],
        lower: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex],
        upper: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex],
        scene: CollisionBatch,
        arm_at: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex],
        hand_at: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex],
        seeds: typing.SupportsInt | typing.SupportsIndex,
        postures: typing.SupportsInt | typing.SupportsIndex,
    ) -> None:
        """
        From the arm alone, the joint that carries its frame, the frame in it [4 x 4], the limits [nq], the collisions of arm and hand, and where their numbers stand there; see reach_batch.hpp.
        """
    def solve(
        self,
        targets: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
        hand: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
    ) -> dict[str, numpy.ndarray[typing.Any, numpy.dtype[typing.Any]]]:
        """
        Postures q [n x nq] that bring the frame to targets [n x 4 x 4] with the hand at its postures [n x hand], NaN where none was found; statuses [n] (0 found, 1 no posture, 2 all hit something) and, of the latter, the pairs of shapes that hit.
        """

def available_threads() -> int:
    """
    Cores that this process may use.
    """

def axes_measure(
    index: str,
    connectivity: typing.SupportsInt | typing.SupportsIndex,
    length_unit: typing.SupportsFloat | typing.SupportsIndex,
) -> Measure:
    """
    An index of the manipulability ellipsoid; see climb/index_measures.hpp.
    """

def ball_radii(
    wrenches: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
) -> numpy.typing.NDArray[numpy.float64]:
    """
    Radius of the largest ball around the origin in the hull of each grasp's wrenches [n x points x 3 or 6]; see wrench_hull.hpp.
    """

def blurred(
    picture: typing.Annotated[numpy.typing.ArrayLike, numpy.float32], sigma: typing.SupportsFloat | typing.SupportsIndex
) -> numpy.typing.NDArray[numpy.float32]:
    """
    A picture [h x w] blurred by a Gauss function of so many pixels, mirrored at its edges.
    """

def box_half_width(
    dimension: typing.SupportsInt | typing.SupportsIndex, radius: typing.SupportsFloat | typing.SupportsIndex
) -> float:
    """
    Half the width of the box that the polytopes of charts are cut from.
    """

def centrality_measure(joints: typing.SupportsInt | typing.SupportsIndex) -> Measure:
    """
    How near the joints are to the middle of their ranges; `joints` is how many the hand has.
    """

def climbs(
    system: GraspSystem,
    X: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
    index: Measure,
    requirements: collections.abc.Sequence[Measure],
    trust_radius: typing.SupportsFloat | typing.SupportsIndex,
    max_steps: typing.SupportsInt | typing.SupportsIndex,
    max_seconds: typing.SupportsFloat | typing.SupportsIndex | None = None,
    threads: typing.SupportsInt | typing.SupportsIndex | None = None,
) -> dict[str, typing.Any]:
    """
    Climbs from each grasp of X [n x configuration_size] to a local maximum of the index within bounds and requirements: ends x [n x configuration_size], value, missed, kkt and evaluations [n], and lists of status and of values. See climb/climber.hpp.
    """

def closure_index_measure(friction: typing.SupportsFloat | typing.SupportsIndex) -> Measure:
    """
    The force-closure margin as an index, with its sign.
    """

def closure_measure(
    friction: typing.SupportsFloat | typing.SupportsIndex,
    torsional: typing.SupportsFloat | typing.SupportsIndex = 0.0,
    margin: typing.SupportsFloat | typing.SupportsIndex = 0.0,
) -> Measure:
    """
    The force-closure margin beyond one that is asked for.
    """

def contact_forces(
    system: GraspSystem,
    X: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
    friction: typing.SupportsFloat | typing.SupportsIndex,
    torsional: typing.SupportsFloat | typing.SupportsIndex = 0.0,
    loads: typing.Annotated[numpy.typing.ArrayLike, numpy.float64] | None = None,
) -> dict[str, numpy.ndarray[typing.Any, numpy.dtype[typing.Any]]]:
    """
    Contact forces on the object of each grasp that stay farthest from their friction cones: forces [n x m x 3] and torques about the normals into the object [n x m], world axes, for a total normal force of one; joint_torques of the actuated joints [n x a], and margin [n]. Loads [n x object_dof] are wrenches at the object's origin to balance. NaN where the margin is 0. See force_closure.hpp.
    """

def convex_hull(
    points: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
) -> dict[str, numpy.ndarray[typing.Any, numpy.dtype[typing.Any]]]:
    """
    Convex hull of points [n x 3]: numbers of its corners, triangles of its surface [t x 3], and planes [f x 4]; see convex_hull.hpp.
    """

def corner_normals(
    points: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
    triangles: typing.Annotated[numpy.typing.ArrayLike, numpy.int64],
    crease: typing.SupportsFloat | typing.SupportsIndex,
) -> numpy.typing.NDArray[numpy.float64]:
    """
    Unit normals at the corners of triangles [t x 3 x 3]; see corner_normals.hpp.
    """

def developed(
    picture: typing.Annotated[numpy.typing.ArrayLike, numpy.float32],
    width: typing.SupportsInt | typing.SupportsIndex,
    height: typing.SupportsInt | typing.SupportsIndex,
    samples: typing.SupportsInt | typing.SupportsIndex,
) -> numpy.typing.NDArray[numpy.uint8]:
    """
    Screen colours [h x w x 3] of linear light; see shading.hpp.
    """

def distances_from_hull(
    points: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
    corners: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
) -> numpy.typing.NDArray[numpy.float64]:
    """
    Distance of each point from the convex hull of others, 0 inside [n].
    """

def distances_measure(batch: CollisionBatch) -> Measure:
    """
    Distances of hand and object.
    """

def enlarged(
    picture: typing.Annotated[numpy.typing.ArrayLike, numpy.float32],
    width: typing.SupportsInt | typing.SupportsIndex,
    height: typing.SupportsInt | typing.SupportsIndex,
) -> numpy.typing.NDArray[numpy.float32]:
    """
    A picture [h x w x channels] at another size, bilinear.
    """

def epsilon_measure(
    friction: typing.SupportsFloat | typing.SupportsIndex,
    edges: typing.SupportsInt | typing.SupportsIndex,
    torsional: typing.SupportsFloat | typing.SupportsIndex,
    length: typing.SupportsFloat | typing.SupportsIndex,
) -> Measure:
    """
    Radius of the largest ball in the hull of contact wrenches; see climb/wrench_measures.hpp.
    """

def force_closure_margins(
    system: GraspSystem,
    X: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
    friction: typing.SupportsFloat | typing.SupportsIndex,
    torsional: typing.SupportsFloat | typing.SupportsIndex = 0.0,
) -> numpy.typing.NDArray[numpy.float64]:
    """
    Force-closure margin of each grasp [n]; zero where a grasp is not force-closed. See force_closure.hpp.
    """

def force_closure_slacks(
    system: GraspSystem,
    X: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
    friction: typing.SupportsFloat | typing.SupportsIndex,
    torsional: typing.SupportsFloat | typing.SupportsIndex = 0.0,
) -> numpy.typing.NDArray[numpy.float64]:
    """
    Force-closure margin of each grasp with its sign [n]; -infinity where there are no internal forces. See force_closure.hpp.
    """

def fragments_in_front(
    corners: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
    width: typing.SupportsInt | typing.SupportsIndex,
    height: typing.SupportsInt | typing.SupportsIndex,
    nearness: typing.Annotated[numpy.typing.ArrayLike, numpy.float32],
) -> dict[str, numpy.ndarray[typing.Any, numpy.dtype[typing.Any]]]:
    """
    All of triangles that is nearer than a picture's pixels; see raster.hpp.
    """

def holding_forces(
    system: GraspSystem, X: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], limits: HoldingLimits
) -> numpy.typing.NDArray[numpy.float64]:
    """
    Largest disturbance from whatever side that each grasp withstands [n], newtons; see holding_force.hpp.
    """

def holding_index_measure(limits: HoldingLimits) -> Measure:
    """
    The holding force as an index.
    """

def holding_measure(limits: HoldingLimits, at_least: typing.SupportsFloat | typing.SupportsIndex) -> Measure:
    """
    The holding force as a multiple of one that is asked for, less one; see climb/holding_measures.hpp.
    """

def hull_volumes(
    wrenches: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
) -> numpy.typing.NDArray[numpy.float64]:
    """
    Volume of the hull of each grasp's wrenches [n x points x 3 or 6]; see wrench_hull.hpp.
    """

def joint_margin_measure(distance: typing.SupportsFloat | typing.SupportsIndex) -> Measure:
    """
    Distances of the joints from their limits beyond one that is asked for.
    """

def lay_over(
    picture: numpy.typing.NDArray[numpy.float32],
    pixels: typing.Annotated[numpy.typing.ArrayLike, numpy.int64],
    opacities: typing.Annotated[numpy.typing.ArrayLike, numpy.float32],
    light: typing.Annotated[numpy.typing.ArrayLike, numpy.float32],
) -> None:
    """
    Lays fragments over a picture [pixels x 3], which is changed; see shading.hpp.
    """

def measured(
    system: GraspSystem,
    x: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
    measure: Measure,
    reach: typing.SupportsFloat | typing.SupportsIndex,
) -> dict[str, numpy.ndarray[typing.Any, numpy.dtype[typing.Any]]]:
    """
    Rows of a measure at a grasp, projected onto the manifold as x: their ids and values [r], slopes [r x dimension] along the tangent basis Phi [dimension x tangent_size]. See climb/measure.hpp.
    """

def min_weights(
    wrenches: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
) -> numpy.typing.NDArray[numpy.float64]:
    """
    Min-weight metric, between 0 and 1, of each grasp's wrenches [n x points x 3 or 6]; see min_weight.hpp.
    """

def missed(
    system: GraspSystem,
    X: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
    requirements: collections.abc.Sequence[Measure],
) -> numpy.typing.NDArray[numpy.float64]:
    """
    By how much each grasp of X misses the requirement that it misses most, in about units of the tangent space [n]; infinite where a requirement that is met or not is not met.
    """

def nearest_fragments(
    corners: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
    width: typing.SupportsInt | typing.SupportsIndex,
    height: typing.SupportsInt | typing.SupportsIndex,
) -> dict[str, numpy.ndarray[typing.Any, numpy.dtype[typing.Any]]]:
    """
    What is seen of triangles [f x 3 x 3] at each pixel of a picture; see raster.hpp.
    """

def numbers_measure(
    values: collections.abc.Callable[
        [numpy.ndarray[typing.Any, numpy.dtype[typing.Any]]], numpy.ndarray[typing.Any, numpy.dtype[typing.Any]]
    ],
) -> Measure:
    """
    An index that is a function of grasps [n x configuration_size] that returns numbers [n].
    """

def project(
    system: AnySystem,
    x: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
    Phi: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
    u: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
) -> typing.Any:
    """
    Point of the manifold above u in the tangent space at x (eqs 14 and 15); None when Newton does not converge.
    """

def project_far(
    system: AnySystem, X: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]
) -> tuple[numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.bool]]:
    """
    Points X [n x configuration_size], which may be far off, moved to the manifold and within the bounds; and whether each got there [n]. See manifold/far_projection.hpp.
    """

def read_collision_shapes(
    tree: str, urdf: str, package_dirs: collections.abc.Sequence[str]
) -> list[dict[str, typing.Any]]:
    """
    Collision shapes of a URDF, each a table; see collision_shape.hpp.
    """

def read_visual_shapes(
    tree: str, urdf: str, package_dirs: collections.abc.Sequence[str]
) -> list[dict[str, typing.Any]]:
    """
    Shapes of a URDF to look at, each a table; see collision_shape.hpp.
    """

def resisted_loads(
    system: GraspSystem,
    X: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
    directions: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
    limits: HoldingLimits,
) -> numpy.typing.NDArray[numpy.float64]:
    """
    Largest force along unit vectors in the object's frame [n x 3, in the plane 2] that each grasp withstands [n].
    """

def round_ball_radii(
    axes: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], friction: typing.SupportsFloat | typing.SupportsIndex
) -> numpy.typing.NDArray[numpy.float64]:
    """
    The same for round friction cones, from the wrenches of unit forces along normal and tangents [n x 3 m x 6].
    """

def semi_axes(
    system: GraspSystem,
    X: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
    length_unit: typing.SupportsFloat | typing.SupportsIndex,
) -> numpy.typing.NDArray[numpy.float64]:
    """
    Ascending semi-axes of the manipulability ellipsoid of each grasp [n x object_dof]; see manipulability.hpp.
    """

def shaded(
    points: typing.Annotated[numpy.typing.ArrayLike, numpy.float32],
    normals: typing.Annotated[numpy.typing.ArrayLike, numpy.float32],
    nearness: typing.Annotated[numpy.typing.ArrayLike, numpy.float32],
    colours: typing.Annotated[numpy.typing.ArrayLike, numpy.float32],
    triangles: typing.Annotated[numpy.typing.ArrayLike, numpy.int64],
    weights: typing.Annotated[numpy.typing.ArrayLike, numpy.float32],
    camera: typing.Annotated[numpy.typing.ArrayLike, numpy.float32, "[3, 1]"],
    lamps: collections.abc.Sequence[
        tuple[
            typing.Annotated[numpy.typing.ArrayLike, numpy.float32, "[3, 1]"],
            typing.SupportsFloat | typing.SupportsIndex,
        ]
    ],
    shadow: tuple[
        typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 3]"],
        typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"],
        typing.SupportsFloat | typing.SupportsIndex,
        typing.Annotated[numpy.typing.ArrayLike, numpy.float32],
    ]
    | None,
) -> tuple[numpy.typing.NDArray[numpy.float32], numpy.typing.NDArray[numpy.float32]]:
    """
    Light [n x 3] of fragments, and how squarely they face the camera [n]; see shading.hpp.
    """

def slacks_measure(
    near: collections.abc.Callable[
        [numpy.ndarray[typing.Any, numpy.dtype[typing.Any]]],
        collections.abc.Callable[
            [numpy.ndarray[typing.Any, numpy.dtype[typing.Any]]], numpy.ndarray[typing.Any, numpy.dtype[typing.Any]]
        ],
    ],
) -> Measure:
    """
    A requirement's slacks: a function of one grasp [1 x configuration_size] that returns a function of grasps near it [n x configuration_size], which returns slacks [n x c].
    """

def test_measure(
    met: collections.abc.Callable[
        [numpy.ndarray[typing.Any, numpy.dtype[typing.Any]]], numpy.ndarray[typing.Any, numpy.dtype[typing.Any]]
    ],
) -> Measure:
    """
    A requirement that is a function of grasps [n x configuration_size] that returns flags [n].
    """
