"""The joint between palm and object: how the object moves, freely in space or in the palm's x-y plane."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from graspatlas import _core
from graspatlas.errors import unknown_name
from graspatlas.numerics.rotations import quaternions_from_matrices
from graspatlas.support.arrays import Array

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

__all__ = ["FREE_FLYER", "PLANAR", "ObjectJoint", "Quaternion", "Vector3", "object_joint"]

Vector3 = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]

#: How far out of the palm's x-y plane an object may be that moves in this plane [m, or quaternion's x and y].
IN_PLANE = 1e-9


class ObjectJoint(ABC):
    """How the object moves against the palm, and how x holds its pose: in Pinocchio's conventions for this joint.

    Attributes:
        name: What Pinocchio's joint is called here, and in problem files.
        planar: Whether the object stays in the palm's x-y plane.
        dof: Degrees of freedom: numbers of a velocity, and of a wrench.
        translations: How many of these are translations, or forces; they come first.
        contact_equations: How many equations a contact makes: points coincide, normals oppose.
        neutral: The pose numbers of an object at the palm's frame.
    """

    name: ClassVar[str]
    planar: ClassVar[bool]
    dof: ClassVar[int]
    translations: ClassVar[int]
    contact_equations: ClassVar[int]
    neutral: ClassVar[tuple[float, ...]]

    def __repr__(self) -> str:
        return f"<ObjectJoint {self.name!r}>"

    @property
    def size(self) -> int:
        """How many numbers of x hold the pose."""
        return len(self.neutral)

    def model(self, tree: str) -> _core.Model:
        """The kinematic tree of a hand with the object on this joint.

        Args:
            tree: URDF of the hand, as Pinocchio is to read it.

        Raises:
            GraspAtlasError: If the URDF cannot be read.
        """
        return _core.Model(tree, self.name)

    @abstractmethod
    def allows(self, xyz: Sequence[float], quat_xyzw: Sequence[float]) -> bool:
        """Whether the object can get to a pose: position (3,) in metres and unit quaternion (4,)."""

    @abstractmethod
    def from_quaternion(self, xyz: Sequence[float], quat_xyzw: Sequence[float]) -> list[float]:
        """The pose numbers (size,) of a pose that the joint allows: position (3,) in metres, unit quaternion (4,)."""

    @abstractmethod
    def to_quaternion(self, pose: Array) -> tuple[Vector3, Quaternion]:
        """Position (3,) in metres and unit quaternion (4,) of pose numbers (size,)."""

    @abstractmethod
    def to_rotation(self, pose: Array) -> tuple[Array, Rotation]:
        """Position (3,) in metres and rotation of pose numbers (size,)."""

    @abstractmethod
    def from_motion(self, R: Array, t: Array) -> Array:
        """The pose numbers (size,) of a rigid motion of the space that the object moves in.

        Args:
            R: Rotation (translations, translations).
            t: Translation (translations,), metres.
        """

    @abstractmethod
    def nearest(self, xyz: Array, rotation: Rotation) -> Array:
        """The pose numbers (size,) of the pose nearest to a position (3,) in metres and a rotation."""

    @abstractmethod
    def random_rotation(self, rng: np.random.Generator) -> Array:
        """A rotation (translations, translations) of the space that the object moves in; none in the plane."""


class _FreeFlyer(ObjectJoint):
    """The object moves freely; its pose is position and quaternion (x, y, z, w)."""

    name = "free_flyer"
    planar = False
    dof = 6
    translations = 3
    contact_equations = 5
    neutral = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)

    def allows(self, xyz: Sequence[float], quat_xyzw: Sequence[float]) -> bool:
        """True."""
        return True

    def from_quaternion(self, xyz: Sequence[float], quat_xyzw: Sequence[float]) -> list[float]:
        """The same numbers."""
        return [*xyz, *quat_xyzw]

    def to_quaternion(self, pose: Array) -> tuple[Vector3, Quaternion]:
        """The same numbers."""
        x, y, z, qx, qy, qz, qw = map(float, pose)
        return (x, y, z), (qx, qy, qz, qw)

    def to_rotation(self, pose: Array) -> tuple[Array, Rotation]:
        """Position and rotation of the quaternion."""
        from scipy.spatial.transform import Rotation  # slow to import

        return pose[:3], Rotation.from_quat(pose[3:])

    def from_motion(self, R: Array, t: Array) -> Array:
        """Translation and the rotation's quaternion."""
        return np.array([*t, *quaternions_from_matrices(R)[0]])

    def nearest(self, xyz: Array, rotation: Rotation) -> Array:
        """This pose itself."""
        return np.array([*xyz, *rotation.as_quat()])

    def random_rotation(self, rng: np.random.Generator) -> Array:
        """A rotation from the uniform distribution over all."""
        from scipy.spatial.transform import Rotation  # slow to import

        return np.asarray(Rotation.from_quat(rng.normal(size=4)).as_matrix())


class _Planar(ObjectJoint):
    """The object moves in the palm's x-y plane; its pose is (x, y, cos, sin)."""

    name = "planar"
    planar = True
    dof = 3
    translations = 2
    contact_equations = 3
    neutral = (0.0, 0.0, 1.0, 0.0)

    def allows(self, xyz: Sequence[float], quat_xyzw: Sequence[float]) -> bool:
        """Whether the pose lies in the plane, turned about z only."""
        x, y, _, _ = quat_xyzw
        return not max(abs(xyz[2]), abs(x), abs(y)) > IN_PLANE

    def from_quaternion(self, xyz: Sequence[float], quat_xyzw: Sequence[float]) -> list[float]:
        """Position, cosine and sine of twice the quaternion's angle."""
        _, _, z, w = quat_xyzw
        return [*xyz[:2], w * w - z * z, 2.0 * w * z]

    def to_quaternion(self, pose: Array) -> tuple[Vector3, Quaternion]:
        """Position with z = 0, quaternion of half the angle about z."""
        half = 0.5 * np.arctan2(pose[3], pose[2])
        return (float(pose[0]), float(pose[1]), 0.0), (0.0, 0.0, float(np.sin(half)), float(np.cos(half)))

    def to_rotation(self, pose: Array) -> tuple[Array, Rotation]:
        """Position with z = 0 and rotation about z."""
        from scipy.spatial.transform import Rotation  # slow to import

        return np.r_[pose[:2], 0.0], Rotation.from_rotvec([0.0, 0.0, np.arctan2(pose[3], pose[2])])

    def from_motion(self, R: Array, t: Array) -> Array:
        """Translation, cosine and sine."""
        return np.array([*t, R[0, 0], R[1, 0]])

    def nearest(self, xyz: Array, rotation: Rotation) -> Array:
        """Position and turn about z of the pose's shadow in the plane."""
        R = rotation.as_matrix()
        angle = np.arctan2(R[1, 0], R[0, 0])
        return np.array([*xyz[:2], np.cos(angle), np.sin(angle)])

    def random_rotation(self, rng: np.random.Generator) -> Array:
        """None: in the plane points leave no turn open."""
        return np.eye(2)


FREE_FLYER: ObjectJoint = _FreeFlyer()
PLANAR: ObjectJoint = _Planar()
_JOINTS = {joint.name: joint for joint in (FREE_FLYER, PLANAR)}


def object_joint(name: str) -> ObjectJoint:
    """The joint that a problem names: ``"free_flyer"`` or ``"planar"``.

    Raises:
        GraspAtlasError: If there is no such joint.
    """
    if not isinstance(name, str) or name not in _JOINTS:
        raise unknown_name("object joint", name, _JOINTS)
    return _JOINTS[name]
