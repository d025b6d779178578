"""A grasp problem: hand, object, contacts, hand motions and a first grasp (Sections II and III of the paper)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graspatlas import _core
from graspatlas.contacts import Contact, FirstGrasp
from graspatlas.errors import GraspAtlasError, unknown_name
from graspatlas.hand import Body, Hand
from graspatlas.motions import HandMotions
from graspatlas.patches import Patch
from graspatlas.tables import checked_instance, checked_table, number, shown

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


@dataclass(frozen=True, eq=False)
class Problem:
    """All that defines the set of relevant grasps, and defaults for its atlas.

    Attributes:
        name: Its name.
        hand: The hand.
        object: The object.
        contacts: The contacts, at least one.
        x1: A feasible first grasp.
        motions: Principal hand motions; without them only the full dimension t can be traced.
        object_joint: How the object moves: ``"free_flyer"``, or ``"planar"`` for problems in the palm's x-y plane.
        length_scale: Length that counts as much as one radian [m].
        defaults: ``dimension``, ``radius``, ``epsilon`` and ``quality`` to use when the caller names none.
        description, source: For people.

    Raises:
        GraspAtlasError: If a contact names no frame of the hand, or x1 misses its contacts or breaks a limit.
    """

    name: str
    hand: Hand
    object: Body
    contacts: tuple[Contact, ...]
    x1: FirstGrasp
    motions: HandMotions | None = None
    object_joint: str = "free_flyer"
    length_scale: float = 0.01
    defaults: Mapping[str, Any] = field(default_factory=dict)
    description: str = ""
    source: str = ""

    def __post_init__(self) -> None:
        self._check_types()
        object.__setattr__(self, "contacts", tuple(self.contacts))
        if not self.contacts:
            raise GraspAtlasError(f"problem '{self.name}' has no contact")
        low, high = LENGTH_SCALES
        if not low <= self.length_scale <= high:
            raise GraspAtlasError(f"length_scale must lie between {low:g} and {high:g} m, got {self.length_scale}")
        if self.object_joint not in OBJECT_JOINTS:
            raise unknown_name("object joint", self.object_joint, OBJECT_JOINTS)
        self._check_joints()
        self._check_plane()
        for contact in self.contacts:
            self.hand.frame(contact.frame)
        self._check_x1()

    def _check_types(self) -> None:
        checked_instance(self.hand, Hand, "hand", "Hand.from_urdf")
        checked_instance(self.object, Body, "object", "Body.from_urdf")
        checked_instance(self.contacts, (list, tuple), "contacts")
        for contact in self.contacts:
            checked_instance(contact, Contact, "a contact")
        checked_instance(self.x1, FirstGrasp, "x1")
        checked_instance(self.motions, (HandMotions, type(None)), "motions", "HandMotions.from_samples")
        checked_table(self.defaults, "defaults", (), DEFAULTS)
        number(self.length_scale, "length_scale")

    def _check_joints(self) -> None:
        for name in self.x1.joints:
            if name not in self.hand.joints:
                raise unknown_name("joint", name, self.hand.joints, f"in hand '{self.hand.name}'")
        for joint in self.hand.model.hand_joints:
            if joint.v_size != 1:
                raise GraspAtlasError(
                    f"joint '{joint.name}' of hand '{self.hand.name}' has {joint.v_size} degrees of freedom; "
                    "a hand's joints must have one each"
                )
        missing = [name for name in self.hand.joints if name not in self.x1.joints]
        if missing:
            raise GraspAtlasError(f"x1 gives no position for joint '{missing[0]}' of hand '{self.hand.name}'")
        if self.motions and set(self.motions.joints) != set(self.hand.joints):
            odd = sorted(set(self.motions.joints) ^ set(self.hand.joints))[0]
            raise GraspAtlasError(
                f"the hand motions and hand '{self.hand.name}' do not have the same joints: see '{odd}'"
            )

    def _check_plane(self) -> None:
        x, y, _, _ = self.x1.object_quat_xyzw
        if self.object_joint == "planar" and max(abs(self.x1.object_xyz[2]), abs(x), abs(y)) > 1e-9:
            raise GraspAtlasError(
                "in a planar problem x1's object lies in the x-y plane: z = 0, and turned about z only"
            )

    def _check_x1(self) -> None:
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
        """The system F of all feasible grasps, no hand motion frozen: eq (9)."""
        unknowns = self.hand.model.hand_v_size + (6 if self.object_joint == "free_flyer" else 3)
        unknowns += sum(len(contact.free()) for contact in self.contacts)
        equations = len(self.contacts) * (5 if self.object_joint == "free_flyer" else 3)
        if equations >= unknowns:
            raise GraspAtlasError(
                f"problem '{self.name}' has {unknowns} unknowns and {equations} contact equations, which leave "
                "no freedom: free some patch parameters or drop a contact"
            )
        return self._system(np.eye(self.hand.model.hand_v_size))

    @cached_property
    def _joint_units(self) -> Array:
        """Joint velocity that counts as one [nv]: a radian, or length_scale for prismatic joints."""
        units = np.ones(self.hand.model.hand_v_size)
        for joint in self.hand.model.hand_joints:
            if joint.prismatic:
                units[joint.v_index] = self.length_scale
        return units

    @cached_property
    def full_dimension(self) -> int:
        """t: dimension of the manifold F of feasible grasps at x1, from the rank of its Jacobian."""
        system = self.full_system
        singular = np.linalg.svd(system.evaluate_jacobian(self.x1_array), compute_uv=False)
        rank = int((singular > 1e-8 * singular[0]).sum())
        if rank < system.n_equations:
            raise GraspAtlasError(
                f"the {system.n_equations} contact equations of problem '{self.name}' have rank {rank} at x1: "
                "a contact is stated twice, or x1 is a singular posture (symmetric or straight ones often are); drop "
                "the redundant contact or bend some fingers"
            )
        return system.dimension

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
        if s >= self.hand.model.hand_v_size:
            raise GraspAtlasError(
                f"dimension {dimension} would freeze {s} hand motions, all that hand '{self.hand.name}' has"
            )
        return s

    def system(self, dimension: int) -> _core.GraspSystem:
        """The system R of relevant grasps of this dimension: eqs (11) to (13)."""
        s = self.frozen_motions(dimension)
        if s == 0 or self.motions is None:
            return self._system(np.eye(self.hand.model.hand_v_size))
        return self._system(self.motions.reordered(self.hand.joints).kept(s))

    def _system(self, motions: Array) -> _core.GraspSystem:
        """The system that keeps these hand motions, columns of joint velocities [nv, p]."""
        model = _core.Model(self.hand.urdf, self.object_joint)
        if (self._joint_units != 1.0).any():
            orthonormal, R = np.linalg.qr(motions / self._joint_units[:, None])
            motions = self._joint_units[:, None] * orthonormal * np.sign(np.diag(R))
        sides = []
        for contact, parameters in zip(self.contacts, self._x1_parameters, strict=True):
            joint, T = self.hand.frame(contact.frame)
            hand = self._side(joint, T, contact.hand, contact.hand_frozen, parameters[0])
            body = self._side(model.object_joint, np.eye(4), contact.object, contact.frozen, parameters[1])
            sides.append((hand, body))
        lower, upper = self.hand.joint_limits
        return _core.GraspSystem(model, sides, motions, self.length_scale, list(lower), list(upper))

    @staticmethod
    def _side(
        joint: int, T: Array, patch: Patch, frozen: Mapping[str, float], at_x1: tuple[float, float]
    ) -> _core.ContactSide:
        parameters = []
        for name, value in zip(("u", "v"), at_x1, strict=True):
            free = name in patch.parameters and name not in frozen
            interval = patch.interval(name) if free else None
            low, high = interval or (-np.pi, np.pi)
            parameters.append(_core.PatchParameter(free, value, free and interval is None, low, high))
        return _core.ContactSide(joint, T, patch.core(), *parameters)

    @cached_property
    def _x1_parameters(self) -> list[tuple[tuple[float, float], tuple[float, float]]]:
        """(u, v) of the hand's and of the object's patch of each contact at x1."""
        given = iter(self.x1.parameters) if self.x1.parameters is not None else None
        T_object = self._T_object
        q = self._q_hand
        places = self.hand.link_placements(q)
        out = []
        for contact in self.contacts:
            T_frame = places[contact.frame]
            hand_guess = contact.hand.locate(_apply(_inverse(T_frame), T_object[:3, 3]))
            hand = self._parameters(contact.hand, contact.hand_frozen, hand_guess, given)
            touch = _apply(T_frame, contact.hand.point(*hand))
            body_guess = contact.object.locate(_apply(_inverse(T_object), touch))
            out.append((hand, self._parameters(contact.object, contact.frozen, body_guess, given)))
        if given is not None and next(given, None) is not None:
            raise GraspAtlasError(f"x1 gives {len(self.x1.parameters or ())} patch parameters, more than are free")
        return out

    @staticmethod
    def _parameters(
        patch: Patch, frozen: Mapping[str, float], guess: tuple[float, float], given: Any
    ) -> tuple[float, float]:
        values = []
        for name, value in zip(("u", "v"), guess, strict=True):
            if name in frozen:
                values.append(float(frozen[name]))
            elif name in patch.parameters and given is not None:
                number = next(given, None)
                if number is None:
                    raise GraspAtlasError("x1 gives fewer patch parameters than are free")
                values.append(float(number))
            else:
                values.append(value)
        return (values[0], values[1])

    @cached_property
    def _q_hand(self) -> Array:
        q = np.array(self.hand.model.neutral, float)
        for joint in self.hand.model.hand_joints:
            value = self.x1.joints[joint.name]
            if joint.q_size == 2:
                q[joint.q_index : joint.q_index + 2] = np.cos(value), np.sin(value)
            else:
                q[joint.q_index] = value
        return q

    @cached_property
    def _T_object(self) -> Array:
        T = np.eye(4)
        x, y, z, w = self.x1.object_quat_xyzw
        v = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        T[:3, :3] = np.eye(3) + 2.0 * w * v + 2.0 * v @ v
        T[:3, 3] = self.x1.object_xyz
        return T

    @cached_property
    def x1_array(self) -> Array:
        """x1 as the vector [q_hand, q_object, free patch parameters], in Pinocchio's conventions.

        q_object is position and quaternion (x, y, z, w) of a free flyer, and (x, y, cos, sin) in the plane.
        """
        free = []
        for contact, (hand, body) in zip(self.contacts, self._x1_parameters, strict=True):
            for patch, frozen, values in (
                (contact.hand, contact.hand_frozen, hand),
                (contact.object, contact.frozen, body),
            ):
                free += [values["uv".index(name)] for name in patch.parameters if name not in frozen]
        if self.object_joint == "planar":
            _, _, z, w = self.x1.object_quat_xyzw
            pose = [*self.x1.object_xyz[:2], w * w - z * z, 2.0 * w * z]
        else:
            pose = [*self.x1.object_xyz, *self.x1.object_quat_xyzw]
        return np.array([*self._q_hand, *pose, *free])

    def frozen_residual(self, X: ArrayLike, dimension: int) -> Array:
        """Eq (13), E_s' (q_hand - q_hand,1), at grasps X [n, size of x]: [n, s], zero on R."""
        s = self.frozen_motions(dimension)
        rows = np.atleast_2d(np.asarray(X, float))
        if s == 0 or self.motions is None:
            return np.zeros((len(rows), 0))
        E_s = self.motions.reordered(self.hand.joints).frozen(s)
        difference = self.full_system.difference
        nv = self.hand.model.hand_v_size
        residuals = np.array([(self._joint_units * difference(self.x1_array, x)[:nv]) @ E_s for x in rows])
        # A continuous joint may have gone round: of all its turns, the one that fits.
        turning = [joint.v_index for joint in self.hand.model.hand_joints if joint.q_size == 2 and joint.v_size == 1]
        turns = np.array(list(product((0, -1, 1), repeat=len(turning)))) * 2.0 * np.pi
        candidates = residuals[:, None, :] + turns @ E_s[turning]
        fitting = np.abs(candidates).max(axis=2).argmin(axis=1)
        return np.asarray(candidates[np.arange(len(rows)), fitting])

    def to_dict(self) -> dict[str, Any]:
        """The problem as plain data that :meth:`from_dict` reads, with the text of its URDFs."""
        return {
            "name": self.name,
            "description": self.description,
            "source": self.source,
            "hand": self.hand.to_dict(),
            "object": {**self.object.to_dict(), "joint": self.object_joint},
            "length_scale": self.length_scale,
            "contacts": [contact.to_dict() for contact in self.contacts],
            "hand_motions": self.motions.to_dict() if self.motions else None,
            "x1": self.x1.to_dict(),
            "defaults": dict(self.defaults),
        }

    @classmethod
    def from_dict(cls, data: Mapping[str, Any], folder: Path | None = None) -> Problem:
        """The problem that a problem file or :meth:`to_dict` describes.

        Args:
            data: The file's content.
            folder: Where relative paths of URDFs start.

        Raises:
            GraspAtlasError: If something is missing or wrong.
        """
        optional = ("description", "source", "length_scale", "hand_motions", "defaults")
        table = checked_table(data, "the problem", ("name", "hand", "object", "contacts", "x1"), optional)
        body = dict(checked_table(table["object"], "the object", ("urdf",), None))
        object_joint = str(body.pop("joint", "free_flyer"))
        motions = table.get("hand_motions")
        if not isinstance(table["contacts"], list):
            raise GraspAtlasError("contacts must be a list of tables")
        return cls(
            name=str(table["name"]),
            hand=Hand.from_dict(table["hand"], folder),
            object=Body.from_dict(body, folder),
            object_joint=object_joint,
            contacts=tuple(Contact.from_dict(item) for item in table["contacts"]),
            x1=FirstGrasp.from_dict(table["x1"]),
            motions=HandMotions.from_dict(motions) if motions else None,
            length_scale=number(table.get("length_scale", 0.01), "length_scale"),
            defaults=dict(checked_table(table.get("defaults") or {}, "defaults", (), DEFAULTS)),
            description=str(table.get("description", "")),
            source=str(table.get("source", "")),
        )


def _apply(T: Array, point: ArrayLike) -> Array:
    return np.asarray(T[:3, :3] @ np.asarray(point) + T[:3, 3])


def _inverse(T: Array) -> Array:
    inverse = np.eye(4)
    inverse[:3, :3] = T[:3, :3].T
    inverse[:3, 3] = -T[:3, :3].T @ T[:3, 3]
    return inverse
