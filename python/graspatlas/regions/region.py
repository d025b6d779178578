"""A region of an object's surface."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from graspatlas.patches.base import Patch, Vector3
from graspatlas.regions.sampling import on_triangles
from graspatlas.support.arrays import Array, IntArray
from graspatlas.support.validation import PlainTable, whole

__all__ = ["Region"]


@dataclass(frozen=True, eq=False)
class Region:
    """A smooth part of a mesh with the patch that fits it, in the mesh's frame.

    Attributes:
        name: Kind of the patch and number in the order of areas, such as ``"cylinder_1"``; the insides of cylinders and
            other round surfaces are ``"inner_cylinder_1"`` and so on.
        patch: Its patch, with the normal outwards and intervals of u and v that cover the region.
        inner: The same patch over the largest rectangle of u and v that lies on the region: the corners of a patch that
            covers a round region lie beside it.
        area: Area [m2].
        error: Largest and root-mean-square distance of the region from the patch [m].
        filled: Share of the patch's rectangle of u and v that the region fills.
        faces: Numbers of its faces in the mesh that was given (m,).
        center: Centroid of the surface [m]; inside the body where the region bends about it.
        normal: Mean outward normal; zero where normals cancel, as all around a can.
        corners: Corners of the faces (m, 3, 3) [m].
    """

    name: str
    patch: Patch
    inner: Patch
    area: float
    error: tuple[float, float]
    filled: float
    faces: IntArray = field(repr=False)
    center: Vector3 = (0.0, 0.0, 0.0)
    normal: Vector3 = (0.0, 0.0, 0.0)
    corners: Array = field(repr=False, default_factory=lambda: np.zeros((0, 3, 3)))

    @property
    def kind(self) -> str:
        """Type of the patch."""
        return self.patch.kind

    def sample(self, n: int, rng: np.random.Generator | None = None) -> tuple[Array, Array]:
        """Points spread evenly over the region, on the mesh itself.

        Args:
            n: How many.
            rng: Where chance comes from; always the same by default.

        Returns:
            Points (n, 3) [m] and the outward unit normals of the faces that they lie on (n, 3).

        Raises:
            GraspAtlasError: If n is no whole number above 0.
        """
        count = whole(n, "n")
        cross = np.cross(self.corners[:, 1] - self.corners[:, 0], self.corners[:, 2] - self.corners[:, 0])
        lengths = np.linalg.norm(cross, axis=1)
        points, which = on_triangles(self.corners, 0.5 * lengths, count, rng or np.random.default_rng(0))
        return points, np.asarray(cross[which] / lengths[which, None])

    def to_dict(self) -> PlainTable:
        """The region as plain data, without its faces."""
        return {
            "name": self.name,
            "area": self.area,
            "error": {"largest": self.error[0], "rms": self.error[1]},
            "filled": self.filled,
            "center": list(self.center),
            "normal": list(self.normal),
            "patch": self.patch.to_dict(),
            "inner": self.inner.to_dict(),
        }
