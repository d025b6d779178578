"""Paths between grasps that never let go, as dense sequences on the manifold.

::

    path = ga.shortest_path(result, 0, accepted=True)     # from chart 0 to the best, through grasps that hold only
    path.length, path.x, path.grasps, path.qualities      # every point keeps all contacts
    path.save_csv("path.csv")                             # a joint trajectory
    ga.export_html(path, "path.html")                     # a page with a slider

:mod:`graspatlas.paths.shortest_path` finds them.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from graspatlas.atlas.atlas import Atlas
from graspatlas.grasps.grasps import Grasps
from graspatlas.paths.time_parametrization import URDF, passing_times
from graspatlas.quality.evaluation import INDICES, evaluate
from graspatlas.requirements.lost import Lost
from graspatlas.result.grasp_atlas import GraspAtlas
from graspatlas.storage.columns import joined, pose_columns
from graspatlas.storage.files import write_csv
from graspatlas.support.arrays import Array, BoolArray, IntArray
from graspatlas.support.notebooks import Displayed
from graspatlas.support.pickling import Light
from graspatlas.support.renamed import renamed_attribute

__all__ = ["GraspPath", "Path"]


@dataclass(frozen=True, eq=False)
class Path(Light, Displayed):
    """A path on a manifold, as points so close together that one may go from each to the next.

    Attributes:
        atlas: The atlas that it lies on.
        x: Its points [n, configuration_size].
        arc_length: Length up to each point [n], units of the tangent space (for grasps rad, and lengths divided by the
            problem's `length_scale`).
        residuals: Largest entry of ``|R(x)|`` at each point [n].
        tight: True when it is as short as its neighbours allow; False when shortening was interrupted or given up. It
            is a valid path in either case.
    """

    atlas: Atlas
    x: Array
    arc_length: Array
    residuals: Array
    tight: bool

    def __repr__(self) -> str:
        return f"<{type(self).__name__} of {len(self)} points, length {self.length:.6g}>"

    def __len__(self) -> int:
        return len(self.x)

    @property
    def length(self) -> float:
        """Its length [units of the tangent space]."""
        return float(self.arc_length[-1])

    @cached_property
    def charts(self) -> IntArray:
        """Chart that each point lies in [n], or the nearest one; -1 where there is none."""
        return np.array([self.atlas.locate(x)[0] for x in self.x], np.int64)

    def save_csv(self, path: str | os.PathLike[str]) -> None:
        """Write the path as a table, one row a point.

        The columns are ``arc_length`` and the numbers of x, ``x0``, ``x1`` and so on. The file is written beside its
        place and renamed, so that it is never seen half written.

        Args:
            path: Such as ``"path.csv"``; an existing file is replaced.

        Raises:
            GraspAtlasError: If the file cannot be written.
        """
        write_csv(path, self._columns())

    def _columns(self) -> dict[str, Array]:
        """Columns of the table by name, each [n]."""
        return {"arc_length": self.arc_length, **{f"x{i}": column for i, column in enumerate(self.x.T)}}


@dataclass(frozen=True, eq=False)
class GraspPath(Path):
    """A path from grasp to grasp; the contacts are kept at every point.

    Attributes:
        result: The result that it lies on; see :class:`Path` for the others.
    """

    result: GraspAtlas
    __repr__ = Path.__repr__

    @cached_property
    def grasps(self) -> Grasps:
        """Its points as grasps [n]."""
        return Grasps(self.result.problem, self.x)

    @cached_property
    def qualities(self) -> Array:
        """The result's index at each point [n].

        Raises:
            GraspAtlasError: If the index was a callable, which is not stored with a result.
        """
        return evaluate(self.result.quality, self.grasps)

    @cached_property
    def accepted(self) -> BoolArray:
        """Whether each point meets the result's requirements [n].

        Raises:
            GraspAtlasError: If a requirement was a callable, which is not stored with a result.
        """
        return self.result.meets(self.x)

    feasible = renamed_attribute("feasible", "accepted")

    @property
    def knows_quality(self) -> bool:
        """False when the index was a callable that was lost when the result was stored."""
        return callable(self.result.quality) or self.result.quality in INDICES

    @property
    def knows_requirements(self) -> bool:
        """False when a requirement was a callable that was lost when the result was stored."""
        return not any(isinstance(requirement, Lost) for requirement in self.result.requirements)

    @cached_property
    def joint_positions(self) -> dict[str, Array]:
        """Joint positions by name, [n] each [rad or m]; none jumps, so a continuous joint may leave [-pi, pi]."""
        hand, positions = self.result.problem.hand, self.grasps.joint_positions
        turning = {joint.name for joint in hand.model.hand_joints if joint.q_size == 2}
        return {name: np.unwrap(values) if name in turning else values for name, values in positions.items()}

    def times(self, joint_speed: float | str = URDF) -> Array:
        """When each point is passed, no joint faster than it may be [n], seconds; accelerations are not limited.

        Args:
            joint_speed: Largest speed of every joint [rad/s or m/s], or ``"urdf"`` for the velocity limits of the
                hand's URDF, which also hold when a larger number is given. Every step takes a microsecond at least.

        Raises:
            GraspAtlasError: If `joint_speed` is neither, or the URDF states no limit for a joint and is to be followed.
        """
        return passing_times(self.result.problem.hand, self.joint_positions, joint_speed)

    def save_csv(self, path: str | os.PathLike[str], *, joint_speed: float | str | None = None) -> None:
        """Write the path as a joint trajectory, one row a point.

        The columns are ``arc_length`` [units of the tangent space], the hand's joints by name [rad or m], the pose of
        the object in the palm's frame, ``object_x``, ``object_y``, ``object_z`` [m], ``object_qx``, ``object_qy``,
        ``object_qz``, ``object_qw`` (unit quaternion), and ``quality``, which is left out where the index was lost.
        ``time`` [s] comes first when a joint speed is given; see :meth:`times`. No column jumps: a continuous joint may
        leave [-pi, pi], and the quaternion does not change its sign.

        Args:
            path: Such as ``"path.csv"``; an existing file is replaced.
            joint_speed: Largest speed of every joint [rad/s or m/s], or ``"urdf"``; without it there are no times.

        Raises:
            GraspAtlasError: If the file cannot be written, `joint_speed` makes no sense, or a joint has the name of
                another column.
        """
        timed = {} if joint_speed is None else {"time": self.times(joint_speed)}
        write_csv(path, joined(timed, self._columns()))

    def _columns(self) -> dict[str, Array]:
        quaternions = _steady(self.grasps.object_quat_xyzw)
        rest = pose_columns("object", self.grasps.object_xyz, quaternions)
        if self.knows_quality:
            rest["quality"] = self.qualities
        return joined({"arc_length": self.arc_length}, self.joint_positions, rest)


def _steady(quaternions: Array) -> Array:
    """Quaternions [n, 4], each with the sign that is nearer to the one before."""
    turned = np.sum(quaternions[1:] * quaternions[:-1], axis=1) < 0.0
    signs = np.cumprod(np.where(turned, -1.0, 1.0))
    return np.concatenate([quaternions[:1], signs[:, None] * quaternions[1:]])
