"""A batch of grasps as quality indices, viewers and users see them; frames are those of one :class:`Grasp`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike
from typing_extensions import Unpack

from graspatlas import _core
from graspatlas.execution.contact_forces import ContactForces, ForceOptions, contact_forces
from graspatlas.execution.pregrasp import DISTANCE, Pregrasp, pregrasps
from graspatlas.execution.squeeze import Stiffness, squeeze
from graspatlas.grasps.grasp import Grasp
from graspatlas.grasps.poses import inverse, poses_by_name, quaternions
from graspatlas.reach.reach import Reach, arm_reach
from graspatlas.support.arrays import Array
from graspatlas.support.pickling import Light
from graspatlas.support.validation import number_array, read_only

if TYPE_CHECKING:
    from graspatlas.problem.problem import Problem

__all__ = ["Grasps"]


class Grasps(Light):
    """A batch of n grasps of one problem; everything is computed once, in the compiled core, when first asked for.

    Its attributes are those of :class:`Grasp` with a leading axis of length n. Its arrays cannot be written to: they
    are shared, ``x`` with what it was made of, often the centres of an atlas.

    Args:
        problem: The problem.
        system: Its system; that of all feasible grasps by default.
        X: One grasp a row [n, configuration_size].
        charts: Chart of each [n]; -1 for none, as by default.
    """

    #: Unit of the lengths in the object's velocity for `semi_axes` [m].
    LENGTH_UNIT = 1e-3

    def __init__(
        self,
        problem: Problem,
        X: ArrayLike,
        system: _core.GraspSystem | None = None,
        charts: ArrayLike | None = None,
    ) -> None:
        self.problem = problem
        self.system = system if system is not None else problem.full_system
        self.x = read_only(np.ascontiguousarray(np.atleast_2d(number_array(X, "X"))))
        self.charts = read_only(np.full(len(self.x), -1) if charts is None else np.asarray(charts, np.int64))

    def __repr__(self) -> str:
        return f"<Grasps: {len(self)} of {self.problem.name!r}>"

    def __len__(self) -> int:
        return len(self.x)

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the hand's joints."""
        return self.problem.hand.joints

    @property
    def q(self) -> Array:
        """Joint configurations of the hand [n, nq]."""
        return self.x[:, : self.problem.hand.model.hand_q_size]

    @property
    def joint_positions(self) -> dict[str, Array]:
        """Position of each joint by name, [n] each [rad or m]; of a continuous joint the angle in [-pi, pi]."""
        columns = self.problem.hand.joint_columns(self.q)
        return {name: columns[name] for name in self.joints}

    @cached_property
    def _arrays(self) -> dict[str, Array]:
        return {name: read_only(array) for name, array in self.system.grasp_arrays(self.x).items()}

    @property
    def T_palm_object(self) -> Array:
        """Poses of the object in the palm's frame [n, 4, 4]."""
        return self._arrays["T_palm_object"]

    @property
    def object_xyz(self) -> Array:
        """Positions of the object in the palm's frame [n, 3], metres."""
        return self.T_palm_object[:, :3, 3]

    @property
    def object_quat_xyzw(self) -> Array:
        """Rotations of the object as unit quaternions [n, 4]."""
        return quaternions(self.T_palm_object)

    @property
    def T_object_palm(self) -> Array:
        """Poses of the palm in the object's frame [n, 4, 4]."""
        return inverse(self.T_palm_object)

    @property
    def palm_xyz(self) -> Array:
        """Positions of the palm in the object's frame [n, 3], metres."""
        return self.T_object_palm[:, :3, 3]

    @property
    def palm_quat_xyzw(self) -> Array:
        """Rotations of the palm in the object's frame as unit quaternions [n, 4]."""
        return quaternions(self.T_object_palm)

    def poses(self, frames: Sequence[str] | None = None) -> dict[str, Array]:
        """Poses by name, [n, 4, 4] each; see :meth:`Grasp.poses`.

        Raises:
            GraspAtlasError: If the hand has no such frame.
        """
        chosen = self.contact_frames if frames is None else frames
        return poses_by_name(self.problem.hand, self.q, self.T_palm_object, chosen)

    @property
    def contact_frames(self) -> tuple[str, ...]:
        """Link or frame of the hand that touches, for each contact [m]."""
        return tuple(contact.frame for contact in self.problem.contacts)

    @property
    def contact_points(self) -> Array:
        """Contact points on the object, in the palm's frame [n, m, 3], metres."""
        return self._arrays["object_points"]

    @property
    def contact_normals(self) -> Array:
        """Outward unit normals of the object at the contacts [n, m, 3]."""
        return self._arrays["object_normals"]

    @property
    def contact_points_in_object(self) -> Array:
        """Contact points in the object's frame [n, m, 3], metres."""
        T = self.T_object_palm
        return np.asarray(self.contact_points @ T[:, :3, :3].swapaxes(1, 2) + T[:, None, :3, 3])

    @property
    def contact_normals_in_object(self) -> Array:
        """Outward unit normals of the object there, in the object's frame [n, m, 3]."""
        return np.asarray(self.contact_normals @ self.T_object_palm[:, :3, :3].swapaxes(1, 2))

    @property
    def J(self) -> Array:
        """Joint velocities to velocities of the contact points [n, 3 m, h]."""
        return self._arrays["J"]

    @property
    def G(self) -> Array:
        """Contact forces to the object's wrench at its origin, world axes [n, 6, 3 m]."""
        return self._arrays["G"]

    @cached_property
    def semi_axes(self) -> Array:
        """Ascending semi-axes of the manipulability ellipsoid [n, 6], lengths in millimetres."""
        return read_only(np.asarray(_core.semi_axes(self.system, self.x, self.LENGTH_UNIT)))

    def contact_forces(self, **options: Unpack[ForceOptions]) -> ContactForces:
        """Contact forces of all grasps, NaN for those that cannot hold; see :meth:`Grasp.contact_forces`.

        Raises:
            GraspAtlasError: If an option is out of its range.
        """
        return contact_forces(self.problem, self.system, self.x, **options)

    def squeeze(self, stiffness: Stiffness, **options: Unpack[ForceOptions]) -> dict[str, Array]:
        """Joint targets by name, (n,) each, NaN for grasps that cannot hold; see :meth:`Grasp.squeeze`.

        Raises:
            GraspAtlasError: If an argument is wrong.
        """
        return squeeze(self.problem.hand, self.joint_positions, self.contact_forces(**options), stiffness)

    def pregrasps(
        self,
        distance: float = DISTANCE,
        *,
        touch_depth: float = 0.002,
        clearance: float = 0.0,
        progress: bool | None = None,
    ) -> list[Pregrasp]:
        """The posture of the hand before each grasp (n,); much quicker than one by one. See :meth:`Grasp.pregrasp`.

        Args:
            distance: How far the contact points are off the object [m].
            touch_depth: Depth to which a touching link may sink into the object on the way [m].
            clearance: Distance that all other pairs of shapes must keep [m].
            progress: Show a progress bar; by default when standard error is a terminal.

        Raises:
            GraspAtlasError: If a number makes no sense, or hand or object has no collision shape.
        """
        depths = {"touch_depth": touch_depth, "clearance": clearance}
        return pregrasps(self.problem, self.x, distance, **depths, progress=progress)

    def reach(self, clearance: float = 0.0) -> Reach:
        """Where the problem's arm can bring the hand: its postures at the grasps; see :class:`graspatlas.Reachable`.

        Args:
            clearance: Distance that the arm's links must keep from the hand, the object and obstacles [m].

        Raises:
            GraspAtlasError: If the problem has no arm, or something has no collision shape.
        """
        return arm_reach(self.problem, clearance).look(self.q, self.T_palm_object)

    def arm_positions(self, clearance: float = 0.0) -> dict[str, Array]:
        """Joint positions of the arm by name, (n,) each [rad or m], NaN where none were found; see :meth:`reach`."""
        return self.reach(clearance).positions

    def __getitem__(self, i: int) -> Grasp:
        one = Grasps(self.problem, self.x[i], self.system) if len(self) > 1 else self  # computed for this grasp alone
        return Grasp(
            x=one.x[0],
            q=one.q[0],
            joints=self.joints,
            joint_positions=self.problem.hand.joint_positions(one.q[0]),
            T_palm_object=one.T_palm_object[0],
            contact_points=one.contact_points[0],
            contact_normals=one.contact_normals[0],
            J=one.J[0],
            G=one.G[0],
            semi_axes=one.semi_axes[0],
            problem=self.problem,
            chart=int(self.charts[i]),
        )

    def __iter__(self) -> Iterator[Grasp]:
        return (self[i] for i in range(len(self)))
