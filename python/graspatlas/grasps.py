"""Grasps as quality indices, viewers and users see them: one, or a batch."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from graspatlas import _core
from graspatlas.tables import number_array

if TYPE_CHECKING:
    from graspatlas.problem import Problem

__all__ = ["Grasp", "Grasps"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Grasp:
    """One grasp; m contacts, h joint velocities.

    Attributes:
        x: The grasp as a point of the manifold [configuration_size].
        q: Joint configuration of the hand [nq], in the order of ``joints``.
        joints: Names of the joints, in the order of q.
        joint_positions: Position of each joint by name [rad or m]; of a continuous joint the angle in [-pi, pi].
        T_palm_object: Pose of the object in the palm's frame [4, 4].
        contact_points: Contact points in the palm's frame [m, 3], metres.
        contact_normals: Outward unit normals of the object there [m, 3].
        J: Joint velocities to velocities of the contact points [3 m, h]; of joints that mimic others the columns are
            added to those of their drivers, ``problem.hand.mechanism.driven``.
        G: Contact forces to the object's wrench at its origin, world axes [6, 3 m]; [3, 3 m] in the plane.
        semi_axes: Ascending semi-axes of the manipulability ellipsoid [6], lengths in millimetres; [3] in the plane.
        quality: Value of the index that was optimised; NaN when there is none.
        chart: Index of the chart; -1 when there is none.
    """

    x: Array
    q: Array
    joints: tuple[str, ...]
    joint_positions: Mapping[str, float]
    T_palm_object: Array
    contact_points: Array
    contact_normals: Array
    J: Array
    G: Array
    semi_axes: Array
    quality: float = float("nan")
    chart: int = -1

    @property
    def object_xyz(self) -> Array:
        """Position of the object in the palm's frame [3], metres."""
        return np.asarray(self.T_palm_object[:3, 3])

    @property
    def object_quat_xyzw(self) -> Array:
        """Rotation of the object as a unit quaternion [4]."""
        return np.asarray(Rotation.from_matrix(self.T_palm_object[:3, :3]).as_quat())

    def __str__(self) -> str:
        angles = ", ".join(f"{name} {value:.3f}" for name, value in self.joint_positions.items())
        xyz = ", ".join(f"{value:.4f}" for value in self.object_xyz)
        return f"quality {self.quality:.6g} at chart {self.chart}: object at ({xyz}) m; {angles}"


class Grasps:
    """A batch of n grasps of one problem; everything is computed once, in the compiled core, when first asked for.

    Its attributes are those of :class:`Grasp` with a leading axis of length n.

    Args:
        problem: The problem.
        system: Its system; that of all feasible grasps by default.
        X: One grasp a row [n, configuration_size].
    """

    #: Unit of the lengths in the object's velocity for `semi_axes` [m].
    LENGTH_UNIT = 1e-3

    def __init__(self, problem: Problem, X: ArrayLike, system: _core.GraspSystem | None = None) -> None:
        self.problem = problem
        self.system = system if system is not None else problem.full_system
        self.x = np.ascontiguousarray(np.atleast_2d(number_array(X, "X")))

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

    @cached_property
    def _arrays(self) -> dict[str, Array]:
        return dict(self.system.grasp_arrays(self.x))

    @property
    def T_palm_object(self) -> Array:
        """Poses of the object in the palm's frame [n, 4, 4]."""
        return self._arrays["T_palm_object"]

    @property
    def contact_points(self) -> Array:
        """Contact points on the object, in the palm's frame [n, m, 3], metres."""
        return self._arrays["object_points"]

    @property
    def contact_normals(self) -> Array:
        """Outward unit normals of the object at the contacts [n, m, 3]."""
        return self._arrays["object_normals"]

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
        return np.asarray(_core.semi_axes(self.system, self.x, self.LENGTH_UNIT))

    def __getitem__(self, i: int) -> Grasp:
        one = Grasps(self.problem, self.x[i], self.system) if len(self) > 1 else self
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
        )

    def __iter__(self) -> Iterator[Grasp]:
        return (self[i] for i in range(len(self)))
