"""A grasp problem: hand, object, contacts, hand motions, a first grasp (Sections II and III of the paper)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graspatlas import _core
from graspatlas.errors import GraspAtlasError, unknown_name
from graspatlas.hand.hand import Body, Hand
from graspatlas.hand.motions import HandMotions
from graspatlas.patches import Patch
from graspatlas.problem.contacts import Contact
from graspatlas.problem.first_grasp import FirstGrasp, first_grasp_from_array, first_grasp_to_array, posture_array
from graspatlas.problem.pose_guess import PoseGuess
from graspatlas.problem.torque_lengths import largest_arm
from graspatlas.requirements.screening import Requirement, requirement_from_dict
from graspatlas.support.pickling import Light
from graspatlas.support.validation import checked_instance, checked_table, number, number_array, read_only, shown

__all__ = ["Problem"]

Array = NDArray[np.float64]

#: How far a first grasp may miss a contact, since it is projected onto the contacts anyway [m], [rad].
CONTACT_TOLERANCE = 1e-3
NORMAL_TOLERANCE = 0.05
#: Smallest and largest length that may count as much as one radian [m].
LENGTH_SCALES = (1e-6, 1e6)
#: Ways in which the object can move.
OBJECT_JOINTS = ("free_flyer", "planar")
#: Options of `optimize` that a problem may give.
DEFAULTS = ("dimension", "radius", "epsilon", "quality")
#: How far a first grasp may break a joint limit or leave a patch [rad or m].
LIMIT_TOLERANCE = 1e-9
#: How far a first grasp may be off the hand motions that are frozen at the reference posture [rad].
FROZEN_TOLERANCE = 1e-9
#: Random configurations at which the rank of the contact equations is looked at when there is no x1.
RANK_TRIES = 5


@dataclass(frozen=True, eq=False)
class Problem(Light):
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
    requirements: tuple[Requirement, ...] = ()
    description: str = ""
    source: str = ""
    pose_guess: PoseGuess | None = None
    torque_length: float | None = None

    def __post_init__(self) -> None:
        self._check_types()
        object.__setattr__(self, "contacts", tuple(self.contacts))
        object.__setattr__(self, "requirements", tuple(self.requirements))
        if not self.contacts:
            raise GraspAtlasError(f"problem '{self.name}' has no contact")
        low, high = LENGTH_SCALES
        if not low <= self.length_scale <= high:
            raise GraspAtlasError(f"length_scale must lie between {low:g} and {high:g} m, got {self.length_scale}")
        if self.torque_length is not None and not 0.0 < self.torque_length < np.inf:
            raise GraspAtlasError(f"torque_length must be positive, got {self.torque_length}")
        if self.object_joint not in OBJECT_JOINTS:
            raise unknown_name("object joint", self.object_joint, OBJECT_JOINTS)
        if self.pose_guess is not None and self.object_joint == "planar":
            self.pose_guess.check_in_plane()
        self._complete()
        self._check_joints()
        for contact in self.contacts:
            self.hand.frame(contact.frame)
        self._check_reference()
        if self.x1 is not None:
            self._check_x1(self.x1)

    def __repr__(self) -> str:
        things = f"hand {self.hand.name!r}, object {self.object.name!r}, {len(self.contacts)} contacts"
        return f"<Problem {self.name!r}: {things}>"

    def _check_types(self) -> None:
        checked_instance(self.hand, Hand, "hand", "Hand.from_urdf")
        checked_instance(self.object, Body, "object", "Body.from_urdf")
        checked_instance(self.contacts, (list, tuple), "contacts")
        for contact in self.contacts:
            checked_instance(contact, Contact, "a contact")
        checked_instance(self.x1, (FirstGrasp, type(None)), "x1")
        checked_instance(self.pose_guess, (PoseGuess, type(None)), "pose_guess")
        checked_instance(self.motions, (HandMotions, type(None)), "motions", "HandMotions.from_samples")
        checked_table(self.defaults, "defaults", (), DEFAULTS)
        number(self.length_scale, "length_scale")
        if self.torque_length is not None:
            object.__setattr__(self, "torque_length", float(number(self.torque_length, "torque_length")))

    def _complete(self) -> None:
        """Add the joints that mimic others to what leaves them out, and put those stated where they must be."""
        mechanism = self.hand.mechanism
        if self.x1 is not None:
            joints = mechanism.completed(self.x1.joints, f"x1 of problem '{self.name}'")
            object.__setattr__(self, "x1", replace(self.x1, joints=joints))
        if self.reference is not None:
            stated = checked_table(self.reference, "the reference posture", (), None)
            named = {joint: number(value, f"joint '{joint}' of the reference") for joint, value in stated.items()}
            object.__setattr__(self, "reference", mechanism.completed(named, "the reference posture"))
        if self.motions is not None:
            object.__setattr__(self, "motions", mechanism.completed_motions(self.motions))

    def _check_joints(self) -> None:
        for joint in self.hand.model.hand_joints:
            if joint.v_size != 1:
                raise GraspAtlasError(
                    f"joint '{joint.name}' of hand '{self.hand.name}' has {joint.v_size} degrees of freedom; "
                    "a hand's joints must have one each"
                )
        if self.motions and set(self.motions.joints) != set(self.hand.joints):
            odd = sorted(set(self.motions.joints) ^ set(self.hand.joints))[0]
            raise GraspAtlasError(
                f"the hand motions and hand '{self.hand.name}' do not have the same joints: see '{odd}'"
            )
        if self.motions:
            self.hand.mechanism.constrained(self.motions)

    def _check_reference(self) -> None:
        if self.reference is None:
            return
        if not np.isfinite(list(self.reference.values())).all():
            raise GraspAtlasError("the reference posture holds a number that is not finite")
        q, (lower, upper) = self.reference_array, self.hand.joint_limits
        for joint in self.hand.model.hand_joints:
            at = joint.q_index
            if joint.q_size == 1 and not lower[at] - LIMIT_TOLERANCE <= q[at] <= upper[at] + LIMIT_TOLERANCE:
                raise GraspAtlasError(
                    f"the reference posture of problem '{self.name}' has joint '{joint.name}' at {q[at]:.4g}, outside "
                    f"its limits [{lower[at]:.4g}, {upper[at]:.4g}]"
                )

    def _check_x1(self, x1: FirstGrasp) -> None:
        x, y, _, _ = x1.object_quat_xyzw
        if self.object_joint == "planar" and max(abs(x1.object_xyz[2]), abs(x), abs(y)) > 1e-9:
            raise GraspAtlasError(
                "in a planar problem x1's object lies in the x-y plane: z = 0, and turned about z only"
            )
        slack = self.full_system.slack(self.x1_array)
        if slack.size and slack.min() < -LIMIT_TOLERANCE:
            broken = [
                f"{name} by {-s:.3g}"
                for name, s in zip(self.full_system.bound_names, slack, strict=True)
                if s < -LIMIT_TOLERANCE
            ]
            raise GraspAtlasError(
                f"x1 of problem '{self.name}' breaks the {', the '.join(broken)} [rad or length_scale]"
            )
        arrays = self.full_system.grasp_arrays(self.x1_array[None])
        with np.errstate(over="ignore"):
            gaps = np.linalg.norm(arrays["hand_points"] - arrays["object_points"], axis=2)[0]
        cosines = np.sum(arrays["hand_normals"] * arrays["object_normals"], axis=2)[0]
        angles = np.arccos(np.clip(-cosines, -1.0, 1.0))
        if not ((gaps <= CONTACT_TOLERANCE).all() and (angles <= NORMAL_TOLERANCE).all()):
            rows = ", ".join(
                f"{contact.frame}: {1000.0 * gap:.3g} mm, {np.degrees(angle):.3g} degrees"
                for contact, gap, angle in zip(self.contacts, gaps, angles, strict=True)
            )
            raise GraspAtlasError(
                f"x1 of problem '{self.name}' misses its contacts ({rows}); at most {1000 * CONTACT_TOLERANCE:g} mm "
                f"and {np.degrees(NORMAL_TOLERANCE):.2g} degrees are allowed: correct the object's pose or the joints"
            )

    @cached_property
    def full_system(self) -> _core.GraspSystem:
        """The system F of all feasible grasps, no hand motion frozen: eq (9); joints that mimic others do."""
        unknowns = len(self.hand.mechanism.driven) + (6 if self.object_joint == "free_flyer" else 3)
        unknowns += sum(len(contact.free()) for contact in self.contacts)
        equations = len(self.contacts) * (5 if self.object_joint == "free_flyer" else 3)
        if equations >= unknowns:
            raise GraspAtlasError(
                f"problem '{self.name}' has {unknowns} unknowns and {equations} contact equations, which leave "
                "no freedom: free some patch parameters or drop a contact"
            )
        return self._system(self.hand.mechanism.A)

    @cached_property
    def joint_units(self) -> Array:
        """Joint velocity that counts as one [nv]: a radian, or length_scale for prismatic joints."""
        units = np.ones(self.hand.model.hand_v_size)
        for joint in self.hand.model.hand_joints:
            if joint.prismatic:
                units[joint.v_index] = self.length_scale
        return read_only(units)

    @cached_property
    def torque_arm(self) -> float:
        """The length that divides torques where an index weighs them against forces [m].

        It is ``torque_length`` where that is stated, or else the largest distance from the object's origin at which a
        contact may touch the object. So it is the same for all grasps, whatever x1 is. It is 0 when all contacts lie at
        the origin.
        """
        if self.torque_length is not None:
            return self.torque_length
        return largest_arm(self.contacts, self.object_joint == "planar")

    @cached_property
    def full_dimension(self) -> int:
        """t: dimension of the manifold F of feasible grasps, from the rank of its Jacobian.

        That is the rank at x1; without x1 the largest at random configurations, in contact or not.
        """
        system, place = self.full_system, "at x1" if self.x1 is not None else "anywhere"
        points = [self.x1_array] if self.x1 is not None else self._random_points(RANK_TRIES)
        rank = max(_rank(system.evaluate_jacobian(x)) for x in points)
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

    def _random_points(self, count: int) -> list[Array]:
        """Configurations round the reference posture that touch nothing; their bounds are not looked at."""
        system, rng = self.full_system, np.random.default_rng(0)
        pose = [0.0, 0.0, 1.0, 0.0] if self.object_joint == "planar" else [0.0] * 6 + [1.0]
        x = np.r_[self.reference_array, pose, np.zeros(system.n_parameters)]
        return [system.integrate(x, rng.normal(size=system.tangent_size)) for _ in range(count)]

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
        if s >= len(self.hand.mechanism.driven):
            raise GraspAtlasError(
                f"dimension {dimension} would freeze {s} hand motions, all that hand '{self.hand.name}' has"
            )
        if self.motions is not None:
            self.motions.check_frozen(s)
        return s

    def system(self, dimension: int) -> _core.GraspSystem:
        """The system R of relevant grasps of this dimension: eqs (11) to (13)."""
        s = self.frozen_motions(dimension)
        mechanism = self.hand.mechanism
        if s == 0 or self.motions is None:
            return self._system(mechanism.A)
        return self._system(mechanism.constrained(self.motions).kept(s + len(mechanism.mimics)))

    def _system(self, motions: Array) -> _core.GraspSystem:
        """The system that keeps these hand motions, columns of joint velocities [nv, p]."""
        model, mechanism = _core.Model(self.hand.tree, self.object_joint), self.hand.mechanism
        if mechanism.mimics or (self.joint_units != 1.0).any():
            orthonormal, R = np.linalg.qr(motions / self.joint_units[:, None])
            motions = self.joint_units[:, None] * orthonormal * np.sign(np.diag(R))
        sides = []
        for contact in self.contacts:
            joint, T = self.hand.frame(contact.frame)
            hand = self._side(joint, T, contact.hand, contact.hand_frozen)
            body = self._side(model.object_joint, np.eye(4), contact.object, contact.frozen)
            sides.append((hand, body))
        lower, upper = self.hand.binding_limits
        return _core.GraspSystem(model, sides, motions, self.length_scale, list(lower), list(upper), drives=mechanism.A)

    @staticmethod
    def _side(joint: int, T: Array, patch: Patch, frozen: Mapping[str, float]) -> _core.ContactSide:
        parameters = []
        for name in ("u", "v"):
            free = name in patch.parameters and name not in frozen
            interval = patch.interval(name) if free else None
            low, high = interval or (-np.pi, np.pi)
            value = float(frozen.get(name, 0.0))
            parameters.append(_core.PatchParameter(free, value, free and interval is None, low, high))
        return _core.ContactSide(joint, T, patch.core(), *parameters)

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
        """The reference posture as a joint configuration [nq]."""
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
        x1 = first_grasp_to_array(self.x1, self.hand, self.contacts, self.object_joint, self.length_scale)
        return read_only(x1)

    def at(self, x: ArrayLike) -> Problem:
        """The same problem with another first grasp; the hand motions that are kept pass where they did.

        Without x1 and reference they pass where x has the hand, so that any feasible grasp will do; grasps found with
        hand motions frozen already lie on them.

        Args:
            x: A feasible grasp [size of x], such as one of :func:`graspatlas.find_grasps`.

        Raises:
            GraspAtlasError: If x has another size, misses its contacts or breaks a limit.
        """
        size = self.full_system.configuration_size
        point = number_array(x, "x")
        if point.shape != (size,) or not np.isfinite(point).all():
            raise GraspAtlasError(f"a grasp of problem '{self.name}' has {size} finite numbers, got {point!r}")
        reference = self.reference if self.x1 is None else self.reference_posture
        return replace(self, x1=first_grasp_from_array(point, self.hand, self.object_joint), reference=reference)

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
        """Eq (13), E_s' (q_hand - reference), at grasps X [n, size of x]: [n, s], zero on R."""
        s = self.frozen_motions(dimension)
        rows = np.atleast_2d(np.asarray(X, float))
        if s == 0 or self.motions is None:
            return np.zeros((len(rows), 0))
        mechanism, q = self.hand.mechanism, self.reference_array
        E_s = mechanism.constrained(self.motions).frozen(s + len(mechanism.mimics))
        residuals = np.array([self.hand.joint_steps(q, x[: len(q)]) @ E_s for x in rows])
        # A continuous joint may have gone round: of all its turns, the one that fits.
        turning = [joint.v_index for joint in self.hand.model.hand_joints if joint.q_size == 2 and joint.v_size == 1]
        turns = np.array(list(product((0, -1, 1), repeat=len(turning)))) * 2.0 * np.pi
        candidates = residuals[:, None, :] + turns @ E_s[turning]
        fitting = np.abs(candidates).max(axis=2).argmin(axis=1)
        return np.asarray(candidates[np.arange(len(rows)), fitting])

    def mimic_residual(self, X: ArrayLike) -> Array:
        """q_joint - multiplier q_driver - offset of the joints that mimic others, at grasps X: [n, m], zero on F."""
        size = self.hand.model.hand_q_size
        named = [self.hand.joint_positions(x[:size]) for x in np.atleast_2d(np.asarray(X, float))]
        joints = self.hand.joints
        return self.hand.mechanism.residual(
            np.array([[q[name] for name in joints] for q in named]).reshape(-1, len(joints))
        )

    def to_dict(self) -> dict[str, Any]:
        """The problem as plain data that :meth:`from_dict` reads, with the text of its URDFs."""
        table: dict[str, Any] = {
            "name": self.name,
            "description": self.description,
            "source": self.source,
            "hand": self.hand.to_dict(),
            "object": {**self.object.to_dict(), "joint": self.object_joint},
            "length_scale": self.length_scale,
            "contacts": [contact.to_dict() for contact in self.contacts],
            "hand_motions": self.motions.to_dict() if self.motions else None,
            "x1": self.x1.to_dict() if self.x1 is not None else None,
            "defaults": dict(self.defaults),
        }
        if self.requirements:
            table["requirements"] = [requirement.to_dict() for requirement in self.requirements]
        if self.torque_length is not None:
            table["torque_length"] = self.torque_length
        if self.reference is not None:
            table["reference"] = dict(self.reference)
        if self.pose_guess is not None:
            table["object"]["pose_guess"] = self.pose_guess.to_dict()
        return table

    @classmethod
    def from_dict(cls, data: Mapping[str, Any], folder: Path | None = None) -> Problem:
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
            "torque_length",
        )
        table = checked_table(data, "the problem", ("name", "hand", "object", "contacts"), optional)
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
            description=str(table.get("description", "")),
            source=str(table.get("source", "")),
        )


def _rank(J: Array) -> int:
    singular = np.linalg.svd(J, compute_uv=False)
    return int((singular > 1e-8 * singular[0]).sum())
