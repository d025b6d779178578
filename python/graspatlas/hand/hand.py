"""The hand: a body with joints, of which some may mimic others."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from graspatlas import _core
from graspatlas.errors import GraspAtlasError, unknown_name
from graspatlas.hand.body import Body
from graspatlas.hand.mechanism import Mechanism
from graspatlas.hand.robot_files import find_file, package_folders
from graspatlas.hand.urdf import (
    effort_limits,
    joint_limits,
    joints_of_kind,
    lock_joints,
    mimics,
    moving_joints,
    with_followers_limited,
)
from graspatlas.hand.urdf_checks import LARGEST
from graspatlas.storage.files import read_text
from graspatlas.support.arrays import Array
from graspatlas.support.validation import PlainTable, StatedTable, checked_table, numbers, read_only

__all__ = ["Hand"]


@dataclass(frozen=True)
class Hand(Body):
    """A robotic hand; the root of its URDF is the palm, and the world.

    Attributes:
        limits: Joint limits that replace the URDF's, by joint name: (lower, upper) [rad or m].
    """

    limits: dict[str, tuple[float, float]] = field(default_factory=dict)
    __repr__ = Body.__repr__

    def __post_init__(self) -> None:
        super().__post_init__()
        for joint in self.limits:
            if joint not in self.joints:
                raise unknown_name("joint", joint, self.joints, f"in hand '{self.name}'")
            lower, upper = _limits_of(joint, self.limits[joint])
            if not lower < upper:
                raise GraspAtlasError(f"limits of joint '{joint}' must be (lower, upper), got {self.limits[joint]}")
            if any(LARGEST <= abs(end) < np.inf for end in (lower, upper)):
                raise GraspAtlasError(
                    f"limits of joint '{joint}' must be below {LARGEST:g} or infinite, got {self.limits[joint]}"
                )
        for info in self.model.hand_joints if self.limits else ():
            if info.name in self.limits and info.q_size != 1:
                raise GraspAtlasError(f"joint '{info.name}' is continuous and has no limits; make it revolute")

    @classmethod
    def from_urdf(
        cls,
        urdf: str | Path,
        *,
        name: str | None = None,
        srdf: str | Path | None = None,
        folder: Path | None = None,
        package_paths: Sequence[str | Path] = (),
        limits: dict[str, tuple[float, float]] | None = None,
    ) -> Hand:
        """Read a hand from a URDF file; see :meth:`Body.from_urdf`."""
        read = cls._read(urdf, name, srdf, folder, package_paths)
        return cls(**read, limits=dict(limits or {}))

    @classmethod
    def from_mjcf(
        cls,
        mjcf: str | Path,
        *,
        root: str | None = None,
        name: str | None = None,
        srdf: str | Path | None = None,
        folder: Path | None = None,
        limits: dict[str, tuple[float, float]] | None = None,
    ) -> Hand:
        """Read a hand from an MJCF file, by MuJoCo; it then stands in ``urdf`` and needs MuJoCo no more.

        Bodies become links, hinges and slides joints, linear couplings of two joints mimics, and sites frames. Geoms
        that take part in contacts become collision shapes, those of the groups 0 to 2 visual ones. What is left out is
        said by a ``RuntimeWarning``, in one line.

        Args:
            mjcf: Path of the file; a relative one is looked up in `folder`, then in the robots of the package.
            root: The body that is the palm; what is not below it is left out, and with it the joints that move it, such
                as those of a wrist. By default the last body before the fingers part.
            name: Name to give the hand; the file's by default.
            srdf: Path of an SRDF file with pairs of links that may touch. Without it they are those that the MJCF
                excludes, neighbours, and links that overlap in whatever posture.
            folder: Where relative paths start; the current folder by default.
            limits: Joint limits that replace those of the file [rad or m].

        Raises:
            GraspAtlasError: If MuJoCo is not installed, a file is missing or cannot be read, or the hand has something
                that it cannot have: a ball joint, a coupling that is not linear, no joint.
        """
        from graspatlas.hand.mjcf.convert import convert_mjcf  # needs MuJoCo's help

        path = find_file(mjcf, folder)
        found = convert_mjcf(path, root)
        if found.notes:
            warnings.warn(f"'{mjcf}': {'; '.join(found.notes)}", RuntimeWarning, stacklevel=2)
        pairs = read_text(find_file(srdf, folder)) if srdf else found.srdf
        return cls(
            name=name or path.stem,
            urdf=found.urdf,
            urdf_path=str(mjcf),
            package_dirs=package_folders(path),
            srdf=pairs,
            limits=dict(limits or {}),
        )

    def with_joints(self, moving: Sequence[str] | None = None, locked: Mapping[str, float] | None = None) -> Hand:
        """The hand with only some joints moving, the others locked.

        Args:
            moving: Names of the joints that move, and with them those that mimic them; by default all that are not
                locked.
            locked: Positions of the joints that do not [rad or m]; 0 where nothing is said. Those that mimic them are
                locked too.

        Raises:
            GraspAtlasError: If there is no such joint, a joint is both, a position lies outside its limits, or a joint
                mimics another that is not treated like it.
        """
        names, positions = moving_joints(self.urdf), dict(locked or {})
        for name in [*(moving or ()), *positions]:
            if name not in names:
                raise unknown_name("joint", name, names, f"one of hand '{self.name}' that moves")
        drivers = {mimic.joint: mimic.driver for mimic in mimics(self.urdf)}
        for name in moving or ():
            if name in positions:
                raise GraspAtlasError(f"joint '{name}' is among the joints that move and among the locked ones")
            if moving is not None and drivers.get(name, name) not in moving:
                raise GraspAtlasError(f"joint '{name}' mimics '{drivers[name]}': name that one among those that move")
        if moving is not None:
            still = [name for name in names if name not in moving and (name not in drivers or name in positions)]
            positions = {name: positions.get(name, 0.0) for name in still}
        if not positions:
            return self
        urdf = lock_joints(self.urdf, positions)
        limits = {name: pair for name, pair in self.limits.items() if name in moving_joints(urdf)}
        return replace(self, urdf=urdf, limits=limits)

    def with_limits_enlarged(self, by: float) -> Hand:
        """The hand with all limits of its revolute joints wider, those in ``limits`` as they are.

        Args:
            by: What is added at both ends [rad]; negative to make them narrower.

        Raises:
            GraspAtlasError: If a joint is left without a range.
        """
        wider = {name: (lower - by, upper + by) for name, (lower, upper) in joint_limits(self.urdf).items()}
        return replace(self, limits={**wider, **self.limits})

    def to_dict(self) -> PlainTable:
        """The hand as plain data, with the text of its URDF."""
        return {**super().to_dict(), "limits": {name: list(pair) for name, pair in self.limits.items()}}

    @classmethod
    def from_dict(cls, data: StatedTable, folder: Path | None = None) -> Hand:
        """The hand that a problem file or :meth:`to_dict` describes; see :meth:`Body.from_dict`."""
        table = dict(checked_table(data, "a hand", (), None))
        stated = checked_table(table.pop("limits", None) or {}, "limits", (), None)
        limits = {name: _limits_of(name, pair) for name, pair in stated.items()}
        if "mjcf" in table:
            table = dict(checked_table(table, "a hand", ("mjcf",), ("name", "root", "srdf")))
            return cls.from_mjcf(**table, folder=folder, limits=limits)
        return cls(**cls._arguments(table, folder), limits=limits)

    @cached_property
    def model(self) -> _core.Model:
        """The hand alone, as a kinematic tree."""
        try:
            return _core.Model(self.tree, "none")
        except GraspAtlasError as error:
            raise GraspAtlasError(f"hand '{self.name}' ({self.urdf_path or 'URDF text'}): {error}") from None

    @cached_property
    def tree(self) -> str:
        """The URDF as Pinocchio is to read it: what mimics a joint with limits does not go round."""
        return with_followers_limited(self.urdf)

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the moving joints, in the order of q."""
        return tuple(joint.name for joint in self.model.hand_joints)

    @cached_property
    def mechanism(self) -> Mechanism:
        """How the joints depend on those that drive them, by the ``<mimic>`` tags of the URDF.

        Raises:
            GraspAtlasError: If a tag is wrong, or limits leave a joint no range.
        """
        mechanism = Mechanism(self.joints, mimics(self.urdf))
        mechanism.ranges(self.limits_by_name)
        return mechanism

    @property
    def frames(self) -> tuple[str, ...]:
        """Names of the links and frames that a contact can sit on."""
        return tuple(self.model.frames)

    def frame(self, name: str) -> tuple[int, Array]:
        """Joint index and placement of a frame in that joint (4, 4).

        Raises:
            GraspAtlasError: If the hand has no such frame; the message names the nearest one.
        """
        frames = self.model.frames
        if name not in frames:
            raise unknown_name("frame", name, frames, f"in hand '{self.name}'")
        joint, T = frames[name]
        return joint, np.asarray(T)

    @cached_property
    def joint_limits(self) -> tuple[Array, Array]:
        """Lower and upper limits (nq,) each, the URDF's where `limits` does not replace them.

        Continuous joints, whose cosine and sine stand in q, have infinite ones.
        """
        lower, upper = np.array(self.model.lower_limits), np.array(self.model.upper_limits)
        continuous = joints_of_kind(self.urdf, "continuous")
        for joint in self.model.hand_joints:
            if joint.name in continuous:
                lower[joint.q_index], upper[joint.q_index] = -np.inf, np.inf
            if joint.q_size == 2:
                lower[joint.q_index : joint.q_index + 2] = -np.inf
                upper[joint.q_index : joint.q_index + 2] = np.inf
            if joint.name in self.limits:
                lower[joint.q_index], upper[joint.q_index] = self.limits[joint.name]
        return read_only(lower), read_only(upper)

    @property
    def limits_by_name(self) -> dict[str, tuple[float, float]]:
        """Lower and upper limit of each joint [rad or m]."""
        lower, upper = self.joint_limits
        return {j.name: (float(lower[j.q_index]), float(upper[j.q_index])) for j in self.model.hand_joints}

    @property
    def efforts_by_name(self) -> dict[str, float]:
        """Largest torque or force of the joints that state one, ``<limit effort>`` in the URDF [N m or N].

        An effort of 0 counts as not stated. Of joints that mimic others that of the driver is the one that matters.
        """
        efforts = effort_limits(self.urdf)
        return {name: efforts[name] for name in self.joints if name in efforts}

    @property
    def binding_limits(self) -> tuple[Array, Array]:
        """The joint limits (nq,) each without those that follow from others, because joints mimic others."""
        lower, upper = (limits.copy() for limits in self.joint_limits)
        binding = self.mechanism.binding_limits(self.limits_by_name)
        for joint in self.model.hand_joints:
            lower[joint.q_index], upper[joint.q_index] = binding[joint.name]
        return lower, upper

    def joint_steps(self, q0: Array, q1: Array) -> Array:
        """Step of each joint from q0 (nq,) to q1 (nq,): (nv,), radians and metres; the shorter way round."""
        steps = np.zeros(self.model.hand_v_size)
        for joint in self.model.hand_joints:
            a, b = (q[joint.q_index : joint.q_index + joint.q_size] for q in (q0, q1))
            turn = joint.q_size == 2
            step = np.arctan2(a[0] * b[1] - a[1] * b[0], a[0] * b[0] + a[1] * b[1]) if turn else b[0] - a[0]
            steps[joint.v_index] = step
        return steps

    def joint_positions(self, q: Array) -> dict[str, float]:
        """Position of each joint with one degree of freedom [rad or m], from q (nq,)."""
        return {name: float(position) for name, position in self.joint_columns(q).items()}

    def joint_columns(self, q: Array) -> dict[str, Array]:
        """The same of many joint configurations q (..., nq): (...) of each joint."""
        columns = {}
        for joint in self.model.hand_joints:
            at = joint.q_index
            if joint.q_size == 1:
                columns[joint.name] = np.array(q[..., at], float)
            elif joint.v_size == 1:
                columns[joint.name] = np.asarray(np.arctan2(q[..., at + 1], q[..., at]))
        return columns

    def configuration(self, positions: Mapping[str, float]) -> Array:
        """The joint configuration q (nq,) of joint positions by name [rad or m]; see :meth:`joint_positions`."""
        q = np.zeros(self.model.hand_q_size)
        for joint in self.model.hand_joints:
            at, position = joint.q_index, positions[joint.name]
            q[at : at + joint.q_size] = position if joint.q_size == 1 else (np.cos(position), np.sin(position))
        return q

    def link_placements(self, q: Array) -> dict[str, Array]:
        """T_palm_link (4, 4) of every link and frame at joint configuration q (nq,)."""
        return {name: np.asarray(T) for name, T in self.model.frame_placements(np.asarray(q, float)).items()}


def _limits_of(joint: str, pair: object) -> tuple[float, float]:
    """Two numbers, the limits of a joint [rad or m].

    Raises:
        GraspAtlasError: If they are not.
    """
    ends = numbers(pair, f"limits of joint '{joint}'")
    if len(ends) != 2:
        raise GraspAtlasError(f"limits of joint '{joint}' must be (lower, upper), got {pair}")
    return ends[0], ends[1]
