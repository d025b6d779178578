"""A grasp problem: hand, object, contacts, hand motions, a first grasp (Sections II and III of the paper)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from graspatlas import _core
from graspatlas.errors import GraspAtlasError
from graspatlas.hand.body import Body
from graspatlas.hand.hand import Hand
from graspatlas.hand.motions import HandMotions
from graspatlas.problem.assembly import (
    frozen_residual,
    grasp_system,
    jacobian_rank,
    joint_units,
    mimic_residual,
    random_points,
)
from graspatlas.problem.contacts import Contact
from graspatlas.problem.first_grasp import FirstGrasp, first_grasp_from_array, first_grasp_to_array, posture_array
from graspatlas.problem.object_joint import ObjectJoint, object_joint
from graspatlas.problem.pose_guess import PoseGuess
from graspatlas.problem.requirement import StatedRequirement, requirement_from_dict
from graspatlas.problem.torque_lengths import largest_arm
from graspatlas.problem.validation import (
    DEFAULTS,
    check_arm,
    check_bounds,
    check_freedom,
    check_joints,
    check_lengths,
    check_obstacles,
    check_poses,
    check_reference,
    check_touch,
    check_types,
    checked_posture,
)
from graspatlas.support.arrays import Array
from graspatlas.support.notebooks import Displayed
from graspatlas.support.pickling import Light
from graspatlas.support.validation import PlainTable, StatedTable, checked_table, number, number_array, read_only, shown
from graspatlas.world.arm import Arm
from graspatlas.world.obstacle import Obstacle

__all__ = ["Problem"]

#: How far a first grasp may be off the hand motions that are frozen at the reference posture [rad].
FROZEN_TOLERANCE = 1e-9


@dataclass(frozen=True, eq=False)
class Problem(Light, Displayed):
    """All that defines the set of relevant grasps, and defaults for its atlas.

    Joints that mimic others, by the ``<mimic>`` tags of the hand's URDF, follow their drivers on all feasible grasps F:
    they add no freedom to t, and are none of the s = t - k hand motions that k freezes. Postures and hand motions may
    leave them out.

    Attributes:
        name: Its name.
        hand: The hand.
        object: The object.
        contacts: The contacts, at least one.
        x1: A feasible first grasp; without one, :func:`graspatlas.find_grasps` finds some.
        reference: Joint positions by name [rad or m] through which the hand motions that are kept pass: x_1,h of
            eq (13). By default those of x1; without x1 the mean of the hand motions, moved within the joint limits.
        pose_guess: About where the object is when it is held; without x1 the search for a first grasp starts there.
        motions: Principal hand motions; without them only the full dimension t can be traced.
        object_joint: How the object moves: ``"free_flyer"``, or ``"planar"`` for problems in the palm's x-y plane.
        length_scale: Length that counts as much as one radian [m].
        torque_length: Length that divides torques where an index weighs them against forces [m]; by default
            ``torque_arm`` finds one.
        defaults: ``dimension``, ``radius``, ``epsilon`` and ``quality`` to use when the caller names none.
        requirements: What the best grasp must meet when the caller does not say.
        obstacles: What the hand must not touch beside the object: they count wherever collisions are looked at.
        arm: The arm that carries the hand, for the requirement ``reachable``; none by default.
        description, source: For people.

    Raises:
        GraspAtlasError: If a contact names no frame of the hand, x1 misses its contacts, or a limit is broken.
    """

    name: str
    hand: Hand
    object: Body
    contacts: tuple[Contact, ...]
    x1: FirstGrasp | None = None
    motions: HandMotions | None = None
    reference: Mapping[str, float] | None = None
    object_joint: str = "free_flyer"
    length_scale: float = 0.01
    defaults: Mapping[str, Any] = field(default_factory=dict)
    requirements: tuple[StatedRequirement, ...] = ()
    description: str = ""
    source: str = ""
    pose_guess: PoseGuess | None = None
    torque_length: float | None = None
    obstacles: tuple[Obstacle, ...] = ()
    arm: Arm | None = None

    def __post_init__(self) -> None:
        check_types(vars(self), self.contacts)
        number(self.length_scale, "length_scale")
        if self.torque_length is not None:
            object.__setattr__(self, "torque_length", float(number(self.torque_length, "torque_length")))
        object.__setattr__(self, "contacts", tuple(self.contacts))
        object.__setattr__(self, "requirements", tuple(self.requirements))
        check_obstacles(self.obstacles)
        object.__setattr__(self, "obstacles", tuple(self.obstacles))
        check_arm(self.name, self.arm, self.requirements)
        if not self.contacts:
            raise GraspAtlasError(f"problem '{self.name}' has no contact")
        check_lengths(self.length_scale, self.torque_length)
        joint = self.object_joint_model
        check_poses(joint, None, self.pose_guess)
        self._complete()
        check_joints(self.hand, self.motions)
        for contact in self.contacts:
            self.hand.frame(contact.frame)
        if self.reference is not None:
            check_reference(self.name, self.hand, self.reference)
        if self.x1 is not None:
            check_poses(joint, self.x1, None)
            check_bounds(self.name, self.full_system, self.x1_array)
            check_touch(self.name, self.full_system, self.contacts, self.x1_array)

    def __repr__(self) -> str:
        things = f"hand {self.hand.name!r}, object {self.object.name!r}, {len(self.contacts)} contacts"
        return f"<Problem {self.name!r}: {things}>"

    def _complete(self) -> None:
        """Add the joints that mimic others to what leaves them out, and put those stated where they must be."""
        mechanism = self.hand.mechanism
        if self.x1 is not None:
            joints = mechanism.completed(self.x1.joints, f"x1 of problem '{self.name}'")
            object.__setattr__(self, "x1", replace(self.x1, joints=joints))
        if self.reference is not None:
            reference = mechanism.completed(checked_posture(self.reference), "the reference posture")
            object.__setattr__(self, "reference", reference)
        if self.motions is not None:
            object.__setattr__(self, "motions", mechanism.completed_motions(self.motions))

    @property
    def object_joint_model(self) -> ObjectJoint:
        """How the object moves: the joint that ``object_joint`` names.

        Raises:
            GraspAtlasError: If there is no such joint.
        """
        return object_joint(self.object_joint)

    @property
    def parameter_names(self) -> tuple[str, ...]:
        """Names of the free patch parameters, the last numbers of x in their order: ``contact0_hand_u`` and so on."""
        return tuple(
            f"contact{i}_{side.name}_{parameter}"
            for i, contact in enumerate(self.contacts)
            for side in contact.sides
            for parameter in side.free
        )

    @cached_property
    def full_system(self) -> _core.GraspSystem:
        """The system F of all feasible grasps, no hand motion frozen: eq (9); joints that mimic others do."""
        check_freedom(self.name, self.hand, self.contacts, self.object_joint_model)
        return self._system(self.hand.mechanism.transmission)

    @property
    def bodies(self) -> tuple[Body, ...]:
        """All that is stated by URDF: hand, object, obstacles that are no planes, and the arm."""
        obstacles = [obstacle.body for obstacle in self.obstacles if obstacle.body is not None]
        return (self.hand, self.object, *obstacles, *(() if self.arm is None else (self.arm.robot,)))

    @cached_property
    def joint_units(self) -> Array:
        """Joint velocity that counts as one (nv,): a radian, or length_scale for prismatic joints."""
        return joint_units(self.hand, self.length_scale)

    @cached_property
    def torque_arm(self) -> float:
        """The length that divides torques where an index weighs them against forces [m].

        It is ``torque_length`` where that is stated, or else the largest distance from the object's origin at which a
        contact may touch the object. So it is the same for all grasps, whatever x1 is. It is 0 when all contacts lie at
        the origin.
        """
        if self.torque_length is not None:
            return self.torque_length
        return largest_arm(self.contacts, self.object_joint_model)

    @cached_property
    def full_dimension(self) -> int:
        """t: dimension of the manifold F of feasible grasps, from the rank of its Jacobian.

        That is the rank at x1; without x1 the largest at random configurations, in contact or not.
        """
        system, place = self.full_system, "at x1" if self.x1 is not None else "anywhere"
        if self.x1 is not None:
            points = [self.x1_array]
        else:
            points = random_points(system, self.reference_array, self.object_joint_model)
        rank = max(jacobian_rank(system.evaluate_jacobian(x)) for x in points)
        if rank < system.n_equations:
            raise GraspAtlasError(
                f"the {system.n_equations} contact equations of problem '{self.name}' have rank {rank} {place}: "
                "a contact is stated twice, or x1 is a singular posture (symmetric or straight ones often are); drop "
                "the redundant contact or bend some fingers"
            )
        return system.dimension

    @property
    def largest_dimension(self) -> int:
        """Largest possible k: t less the couplings, which are always frozen."""
        return self.full_dimension - (len(self.motions.couplings) if self.motions is not None else 0)

    def frozen_motions(self, dimension: int) -> int:
        """How many hand motions are frozen for a manifold of dimension k: s = t - k (eq 12).

        Raises:
            GraspAtlasError: If `dimension` is not between 1 and t, or there are no hand motions to freeze.
        """
        t = self.full_dimension
        if isinstance(dimension, bool) or not isinstance(dimension, int | np.integer) or not 1 <= dimension <= t:
            raise GraspAtlasError(
                f"dimension must be a whole number from 1 to {t}, the dimension of all grasps of problem "
                f"'{self.name}'; got {shown(dimension)}"
            )
        s = t - int(dimension)
        if s > 0 and self.motions is None:
            raise GraspAtlasError(
                f"problem '{self.name}' has no hand motions, so its dimension cannot be reduced; use dimension={t}"
            )
        if s >= len(self.hand.mechanism.actuated):
            raise GraspAtlasError(
                f"dimension {dimension} would freeze {s} hand motions, all that hand '{self.hand.name}' has"
            )
        if self.motions is not None:
            self.motions.check_frozen(s)
        return s

    def system(self, dimension: int, *, room: float = 0.0) -> _core.GraspSystem:
        """The system R of relevant grasps of this dimension: eqs (11) to (13).

        Args:
            dimension: k.
            room: Share of each range, of a joint or of a patch parameter, to keep off either of its ends, from 0 on and
                less than a half.
        """
        s = self.frozen_motions(dimension)
        mechanism = self.hand.mechanism
        if s == 0 or self.motions is None:
            return self._system(mechanism.transmission, room)
        return self._system(mechanism.constrained(self.motions).kept(s + len(mechanism.mimics)), room)

    def _system(self, motions: Array, room: float = 0.0) -> _core.GraspSystem:
        """The system that keeps these hand motions, columns of joint velocities (nv, p)."""
        return grasp_system(self.hand, self.contacts, self.object_joint_model, motions, self.length_scale, room)

    @cached_property
    def reference_posture(self) -> Mapping[str, float]:
        """Joint positions by name [rad or m] through which the hand motions that are kept pass; see ``reference``."""
        if self.reference is not None:
            return self.reference
        if self.x1 is not None:
            return self.x1.joints
        mechanism = self.hand.mechanism
        mean = dict(zip(self.motions.joints, self.motions.mean, strict=True)) if self.motions else {}
        ranges = mechanism.ranges(self.hand.limits_by_name)
        posture = {name: float(np.clip(mean.get(name, 0.0), *ends)) for name, ends in ranges.items()}
        return mechanism.completed(posture, "the mean posture")

    @cached_property
    def reference_array(self) -> Array:
        """The reference posture as a joint configuration (nq,)."""
        return read_only(posture_array(self.hand, self.reference_posture, "the reference posture"))

    @cached_property
    def x1_array(self) -> Array:
        """x1 as the vector [q_hand, q_object, free patch parameters], in Pinocchio's conventions.

        q_object is position and quaternion (x, y, z, w) of a free flyer, and (x, y, cos, sin) in the plane.

        Raises:
            GraspAtlasError: If the problem has no x1.
        """
        if self.x1 is None:
            raise GraspAtlasError(
                f"problem '{self.name}' has no first grasp x1: give one, or take one that is found, as in "
                "problem.at(graspatlas.find_grasps(problem)[0])"
            )
        x1 = first_grasp_to_array(self.x1, self.hand, self.contacts, self.object_joint_model, self.length_scale)
        return read_only(x1)

    def at(self, x: ArrayLike) -> Problem:
        """The same problem with another first grasp; the hand motions that are kept pass where they did.

        Without x1 and reference they pass where x has the hand, so that any feasible grasp will do; grasps found with
        hand motions frozen already lie on them.

        Args:
            x: A feasible grasp (size of x,), such as one of :func:`graspatlas.find_grasps`.

        Raises:
            GraspAtlasError: If x has another size, misses its contacts or breaks a limit.
        """
        size = self.full_system.configuration_size
        point = number_array(x, "x")
        if point.shape != (size,) or not np.isfinite(point).all():
            raise GraspAtlasError(f"a grasp of problem '{self.name}' has {size} finite numbers, got {point!r}")
        reference = self.reference if self.x1 is None else self.reference_posture
        return replace(self, x1=first_grasp_from_array(point, self.hand, self.object_joint_model), reference=reference)

    def start(self, dimension: int) -> Array:
        """x1 as the point from which the atlas of this dimension grows.

        Raises:
            GraspAtlasError: If there is no x1, or it lies off the hand motions kept, which pass through the reference.
        """
        x1 = self.x1_array
        off = float(np.abs(self.frozen_residual(x1, dimension)).max(initial=0.0))
        if off > FROZEN_TOLERANCE:
            raise GraspAtlasError(
                f"x1 of problem '{self.name}' is {off:.3g} rad off the {self.frozen_motions(dimension)} hand motions "
                "that are frozen at the reference posture, eq (13): leave out the reference, or x1"
            )
        return x1

    def frozen_residual(self, X: ArrayLike, dimension: int) -> Array:
        """Eq (13), E_s' (q_hand - reference), at grasps X (n, size of x): (n, s), zero on R."""
        s = self.frozen_motions(dimension)
        rows = np.atleast_2d(np.asarray(X, float))
        if s == 0 or self.motions is None:
            return np.zeros((len(rows), 0))
        return frozen_residual(self.hand, self.motions, self.reference_array, s, rows)

    def mimic_residual(self, X: ArrayLike) -> Array:
        """q_joint - multiplier q_driver - offset of the joints that mimic others, at grasps X: (n, m), zero on F."""
        return mimic_residual(self.hand, np.atleast_2d(np.asarray(X, float)))

    def to_dict(self) -> PlainTable:
        """The problem as plain data that :meth:`from_dict` reads, with the text of its URDFs."""
        body: PlainTable = {**self.object.to_dict(), "joint": self.object_joint}
        if self.pose_guess is not None:
            body["pose_guess"] = self.pose_guess.to_dict()
        table: PlainTable = {
            "name": self.name,
            "description": self.description,
            "source": self.source,
            "hand": self.hand.to_dict(),
            "object": body,
            "length_scale": self.length_scale,
            "contacts": [contact.to_dict() for contact in self.contacts],
            "hand_motions": self.motions.to_dict() if self.motions else None,
            "x1": self.x1.to_dict() if self.x1 is not None else None,
            "defaults": dict(self.defaults),
        }
        if self.requirements:
            table["requirements"] = [requirement.to_dict() for requirement in self.requirements]
        if self.obstacles:
            table["obstacles"] = [obstacle.to_dict() for obstacle in self.obstacles]
        if self.arm is not None:
            table["arm"] = self.arm.to_dict()
        if self.torque_length is not None:
            table["torque_length"] = self.torque_length
        if self.reference is not None:
            table["reference"] = dict(self.reference)
        return table

    @classmethod
    def from_dict(cls, data: StatedTable, folder: Path | None = None) -> Problem:
        """The problem that a problem file or :meth:`to_dict` describes.

        Args:
            data: The file's content.
            folder: Where relative paths of URDFs start.

        Raises:
            GraspAtlasError: If something is missing or wrong.
        """
        optional = (
            "description",
            "source",
            "length_scale",
            "hand_motions",
            "defaults",
            "requirements",
            "x1",
            "reference",
            "obstacles",
            "arm",
        )
        table = checked_table(data, "the problem", ("name", "hand", "object", "contacts"), (*optional, "torque_length"))
        body = dict(checked_table(table["object"], "the object", ("urdf",), None))
        object_joint, guess = str(body.pop("joint", "free_flyer")), body.pop("pose_guess", None)
        motions = table.get("hand_motions")
        if not isinstance(table["contacts"], list):
            raise GraspAtlasError("contacts must be a list of tables")
        return cls(
            name=str(table["name"]),
            hand=Hand.from_dict(table["hand"], folder),
            object=Body.from_dict(body, folder),
            object_joint=object_joint,
            contacts=tuple(Contact.from_dict(item) for item in table["contacts"]),
            x1=FirstGrasp.from_dict(table["x1"]) if table.get("x1") is not None else None,
            reference=table.get("reference"),
            pose_guess=PoseGuess.from_dict(guess) if guess is not None else None,
            motions=HandMotions.from_dict(motions) if motions else None,
            length_scale=number(table.get("length_scale", 0.01), "length_scale"),
            torque_length=table.get("torque_length"),
            defaults=dict(checked_table(table.get("defaults") or {}, "defaults", (), DEFAULTS)),
            requirements=tuple(map(requirement_from_dict, table.get("requirements") or ())),
            obstacles=tuple(Obstacle.from_dict(item, folder) for item in table.get("obstacles") or ()),
            arm=Arm.from_dict(table["arm"], folder) if table.get("arm") is not None else None,
            description=str(table.get("description", "")),
            source=str(table.get("source", "")),
        )
