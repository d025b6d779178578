"""One grasp as quality indices, viewers and users see it.

A transform T_a_b is the pose of b in the frame of a: it maps coordinates in b to coordinates in a. The palm is the root
link of the hand's URDF, the object that of its own.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from typing_extensions import Unpack

from graspatlas.errors import GraspAtlasError
from graspatlas.execution.approach import Approach, approach
from graspatlas.execution.contact_forces import ContactForces, ForceOptions, contact_forces
from graspatlas.execution.pregrasp import DISTANCE, Pregrasp, pregrasps
from graspatlas.execution.squeeze import Stiffness, squeeze
from graspatlas.grasps.poses import inverse, poses_by_name, quaternions, se3
from graspatlas.reach.reach import ReachStatus, arm_reach
from graspatlas.support.arrays import Array
from graspatlas.support.notebooks import Displayed

if TYPE_CHECKING:
    import pinocchio as pin

    from graspatlas.problem.problem import Problem

__all__ = ["Grasp"]


@dataclass(frozen=True, eq=False)
class Grasp(Displayed):
    """One grasp; m contacts, h joint velocities. Its arrays cannot be written to: copy what you want to change.

    Attributes:
        x: The grasp as a point of the manifold [configuration_size].
        q: Joint configuration of the hand [nq], in the order of ``joints``.
        joints: Names of the joints, in the order of q.
        joint_positions: Position of each joint by name [rad or m]; of a continuous joint the angle in [-pi, pi].
        T_palm_object: Pose of the object in the palm's frame [4, 4].
        contact_points: Contact points in the palm's frame [m, 3], metres.
        contact_normals: Outward unit normals of the object there [m, 3].
        J: Joint velocities to velocities of the contact points [3 m, h]; of joints that mimic others the columns are
            added to those of their drivers, ``problem.hand.mechanism.actuated``.
        G: Contact forces to the object's wrench at its origin, world axes [6, 3 m]; [3, 3 m] in the plane.
        semi_axes: Ascending semi-axes of the manipulability ellipsoid [6], lengths in millimetres; [3] in the plane.
        problem: The problem that it solves.
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
    problem: Problem
    quality: float = float("nan")
    chart: int = -1

    def __repr__(self) -> str:
        chart = f", chart {self.chart}" if self.chart >= 0 else ""
        quality = "" if np.isnan(self.quality) else f", quality {self.quality:.6g}"
        return f"<Grasp of {self.problem.name!r}{chart}{quality}>"

    @property
    def object_xyz(self) -> Array:
        """Position of the object in the palm's frame [3], metres."""
        return np.asarray(self.T_palm_object[:3, 3])

    @property
    def object_quat_xyzw(self) -> Array:
        """Rotation of the object as a unit quaternion [4]."""
        return np.asarray(quaternions(self.T_palm_object[None])[0])

    @property
    def T_object_palm(self) -> Array:
        """Pose of the palm in the object's frame [4, 4]: where a robot has to bring the hand."""
        return inverse(self.T_palm_object)

    @property
    def palm_xyz(self) -> Array:
        """Position of the palm in the object's frame [3], metres."""
        return np.asarray(self.T_object_palm[:3, 3])

    @property
    def palm_quat_xyzw(self) -> Array:
        """Rotation of the palm in the object's frame as a unit quaternion [4]."""
        return np.asarray(quaternions(self.T_object_palm[None])[0])

    @property
    def object_pose(self) -> pin.SE3:
        """Pose of the object in the palm's frame, as a ``pinocchio.SE3``; metres."""
        return se3(self.T_palm_object)

    @property
    def palm_pose(self) -> pin.SE3:
        """Pose of the palm in the object's frame, as a ``pinocchio.SE3``; metres."""
        return se3(self.T_object_palm)

    @property
    def contact_frames(self) -> tuple[str, ...]:
        """Link or frame of the hand that touches, for each contact [m]."""
        return tuple(contact.frame for contact in self.problem.contacts)

    @property
    def contact_points_in_object(self) -> Array:
        """Contact points in the object's frame [m, 3], metres."""
        T = self.T_object_palm
        return np.asarray(self.contact_points @ T[:3, :3].T + T[:3, 3])

    @property
    def contact_normals_in_object(self) -> Array:
        """Outward unit normals of the object there, in the object's frame [m, 3]."""
        return np.asarray(self.contact_normals @ self.T_object_palm[:3, :3].T)

    def poses(self, frames: Sequence[str] | None = None) -> dict[str, Array]:
        """Poses by name, ``"A_in_B"`` being that of A in B's frame.

        Args:
            frames: Links and frames of the hand; by default those that touch the object.

        Returns:
            Transforms [4, 4], lengths in metres: ``object_in_palm``, ``palm_in_object``, and ``<frame>_in_object`` for
            each frame.

        Raises:
            GraspAtlasError: If the hand has no such frame.
        """
        chosen = self.contact_frames if frames is None else frames
        named = poses_by_name(self.problem.hand, self.q[None], self.T_palm_object[None], chosen)
        return {name: T[0] for name, T in named.items()}

    def contact_forces(self, **options: Unpack[ForceOptions]) -> ContactForces:
        """Forces with which the contacts hold the object, farthest from their friction cones, and the joint torques.

        Args:
            **options: ``normal_force`` [N], ``friction``, ``torsional`` [m], ``load`` and ``within_efforts``; see
                :class:`graspatlas.execution.ForceOptions`.

        Raises:
            GraspAtlasError: If no forces inside the friction cones hold the object, or an option is out of its range.
        """
        forces = contact_forces(self.problem, self.problem.full_system, self.x[None], **options)[0]
        if forces.margin > 0.0:
            return forces
        mu = f"{forces.friction:g}"
        given = f"friction {mu} and torsional {forces.torsional:g}"
        if options.get("load") is not None:
            raise GraspAtlasError(
                f"no contact forces balance this load with {given} and normal forces that add up to "
                f"{forces.total_normal_force:g} N (margin 0); raise normal_force, or take a grasp of force closure"
            )
        raise GraspAtlasError(
            f"this grasp has no force closure with {given} (margin 0), so no contact forces hold it; state the "
            f"friction there is, for soft fingers torsional=... [m], or require=['force_closure:{mu}:0.02']"
        )

    def squeeze(self, stiffness: Stiffness, **options: Unpack[ForceOptions]) -> dict[str, float]:
        """Joint targets by name [rad or m] with which position actuators exert the contact forces.

        Args:
            stiffness: Of the actuators [N m/rad], of joints that slide [N/m]; one for all, or by actuated joint.
            **options: Which contact forces; see :meth:`contact_forces`.

        Raises:
            GraspAtlasError: If no forces inside the friction cones hold the object, or an argument is wrong.
        """
        forces, at = self.contact_forces(**options), {j: np.float64(q) for j, q in self.joint_positions.items()}
        targets = squeeze(self.problem.hand, at, forces, stiffness)
        return {name: float(target) for name, target in targets.items()}

    def arm_positions(self, clearance: float = 0.0) -> dict[str, float]:
        """Joint positions by name [rad or m] with which the problem's arm brings the hand to this grasp.

        They are within the joint limits, and nothing is hit; the way there is not looked at. See
        :class:`graspatlas.Reachable`.

        Args:
            clearance: Distance that the arm's links must keep from the hand, the object and obstacles [m].

        Raises:
            GraspAtlasError: If none were found, the problem has no arm, or something has no collision shape.
        """
        reach = arm_reach(self.problem, clearance).look(self.q[None], self.T_palm_object[None])
        if reach.found[0]:
            return {name: float(positions[0]) for name, positions in reach.positions.items()}
        hits = reach.hits[0]
        if reach.statuses[0] is ReachStatus.HITS and hits is not None:
            why = f"in each posture found something is hit, in the first {hits[0]} and {hits[1]}"
        else:
            why = "no posture was found within the joint limits, which is no proof that there is none"
        raise GraspAtlasError(
            f"arm '{reach.arm.name}' does not bring the hand to this grasp: {why}; take a grasp that meets "
            "the requirement reachable, or move the base or the object"
        )

    def pregrasp(self, distance: float = DISTANCE, *, touch_depth: float = 0.002, clearance: float = 0.0) -> Pregrasp:
        """The posture of the hand before this grasp: each contact point off the object by the same distance.

        The object is where the grasp holds it, and the contact points of the hand, which stay where they are in their
        links, are off it along its outward normals at the contacts. Only joints that move them leave the grasp's
        posture. The hand walks outwards in steps of a millimetre, each a least-squares problem bounded by the joint
        limits; joints that mimic others follow them. On the way the fingertips may be as deep in the object as
        :class:`graspatlas.CollisionFree` allows; at the end nothing touches, neither object nor hand.

        A distance that cannot be reached is no error: the result says how far the hand gets, and why.

        Args:
            distance: How far the contact points are off the object [m].
            touch_depth: Depth to which a touching link may sink into the object on the way [m].
            clearance: Distance that all other pairs of shapes must keep [m].

        Raises:
            GraspAtlasError: If a number makes no sense, or hand or object has no collision shape.
        """
        found = pregrasps(self.problem, self.x[None], distance, touch_depth=touch_depth, clearance=clearance)
        return found[0]

    def approach(
        self,
        distance: float = DISTANCE,
        seconds: float = 0.4,
        *,
        time_step: float = 0.01,
        squeeze: Mapping[str, float] | Sequence[float] | Array | None = None,
        squeeze_seconds: float = 0.4,
        touch_depth: float = 0.002,
        clearance: float = 0.0,
    ) -> Approach:
        """The way into this grasp: a timed trajectory of the joints from :meth:`pregrasp` to the grasp, and a squeeze.

        At each time all contact points are equally far off the object, so that they arrive together. Either part starts
        and stops with least jerk. It takes longer than asked for where a joint would exceed the velocity limit of the
        hand's URDF, and says so.

        Args:
            distance: How far the contact points are off the object at the beginning [m].
            seconds: Time from there to the grasp [s].
            time_step: Time between two points, at most [s].
            squeeze: Joint positions to go on to after the grasp, by name or those of all joints [h], radians and
                metres: what a position controller is to be told so that it presses. Joints that are not named stay;
                limits and collisions are not looked at.
            squeeze_seconds: Time from the grasp to the squeeze [s].
            touch_depth: See :meth:`pregrasp`.
            clearance: See :meth:`pregrasp`.

        Raises:
            GraspAtlasError: If a number makes no sense, the squeeze names a joint that there is not, or hand or object
                has no collision shape.
        """
        start = self.pregrasp(distance, touch_depth=touch_depth, clearance=clearance)
        return approach(start, seconds, time_step=time_step, squeeze=squeeze, squeeze_seconds=squeeze_seconds)

    def __str__(self) -> str:
        angles = ", ".join(f"{name} {value:.3f}" for name, value in self.joint_positions.items())
        xyz = ", ".join(f"{value:.4f}" for value in self.object_xyz)
        return f"quality {self.quality:.6g} at chart {self.chart}: object at ({xyz}) m; {angles}"
