"""Charts as polygons: from tangent spaces into configuration space, and from there into three coordinates."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from graspatlas.atlas.atlas import Atlas
from graspatlas.atlas.status import Closed
from graspatlas.errors import GraspAtlasError
from graspatlas.grasps.grasps import Grasps
from graspatlas.problem.problem import Problem
from graspatlas.support.arrays import Array, BoolArray, IntArray

__all__ = [
    "Coordinates",
    "chart_polygons",
    "default_coordinates",
    "object_pose",
    "open_charts",
    "polygon_corners",
    "principal",
]


@dataclass(frozen=True)
class Coordinates:
    """Three coordinates of configurations, in which an atlas is drawn.

    Attributes:
        labels: What stands at the axes, with units.
        of: Coordinates [n, 3] of configurations [n, configuration_size].
        equal: True when all three have one unit, so that they are drawn to one scale.
    """

    labels: tuple[str, str, str]
    of: Callable[[Array], Array]
    equal: bool = True


def default_coordinates(atlas: Atlas) -> Coordinates:
    """The numbers of a configuration where there are three, else principal coordinates."""
    if atlas.system.configuration_size == 3:
        return Coordinates(("$x$", "$y$", "$z$"), lambda X: X)
    return principal(atlas)


def object_pose(problem: Problem) -> Coordinates:
    """Position [mm] and angle [degrees] of the object of a planar problem; the angle is counted from that at x1.

    Grasps that hold the object in one pose with other joint angles fall on one point.
    """
    start = Grasps(problem, problem.x1_array).T_palm_object[0]

    def of(X: Array) -> Array:
        T = Grasps(problem, X).T_palm_object
        turned = np.einsum("ji,njk->nik", start[:3, :3], T[:, :3, :3])
        angle = np.degrees(np.arctan2(turned[:, 1, 0], turned[:, 0, 0]))
        return np.column_stack([1e3 * T[:, 0, 3], 1e3 * T[:, 1, 3], angle])

    return Coordinates(("object $x$ [mm]", "object $y$ [mm]", "object angle [deg]"), of, equal=False)


def principal(atlas: Atlas) -> Coordinates:
    """Principal coordinates of the chart centres, in the metric of the atlas [rad, and lengths in length scales].

    The axes are named p1 to p3, with the share of the centres' variance along each.
    """
    system = atlas.system

    def images(X: Array) -> Array:
        return np.array([system.embed(x) for x in X])

    centers = images(atlas.centers)
    mean = centers.mean(axis=0)
    _, variances, directions = np.linalg.svd(centers - mean, full_matrices=False)
    shares = variances**2 / max(float((variances**2).sum()), 1e-300)
    axes = np.zeros((3, len(mean)))
    axes[: min(3, len(directions))] = directions[:3]
    axes *= np.where(axes[np.arange(3), np.abs(axes).argmax(axis=1)] < 0.0, -1.0, 1.0)[:, None]
    labels = [f"$p_{i + 1}$ ({100.0 * share:.0f} %)" for i, share in enumerate(shares[:3])]
    labels += [""] * (3 - len(labels))
    return Coordinates((labels[0], labels[1], labels[2]), lambda X: (images(X) - mean) @ axes.T)


def chart_polygons(atlas: Atlas, coordinates: Coordinates) -> list[Array]:
    """Polygon of each chart of a surface, corners in order round it, in three coordinates [v, 3].

    Args:
        atlas: An atlas of dimension 2.
        coordinates: The coordinates.

    Raises:
        GraspAtlasError: If the atlas is no surface.
    """
    if atlas.dimension != 2:
        raise GraspAtlasError(
            f"charts are polygons when k = 2, this atlas has k = {atlas.dimension}; trace it with dimension=2"
        )
    corners, owners = polygon_corners(atlas)
    integrate, centers = atlas.system.integrate, atlas.centers
    steps = np.einsum("vk,vkt->vt", corners, atlas.bases[owners])
    places = coordinates.of(np.array([integrate(centers[i], v) for i, v in zip(owners, steps, strict=True)]))
    ends = atlas.vertex_start
    if not coordinates.equal:  # the third is an angle in degrees: no polygon is torn where it jumps
        for a, b in pairwise(ends):
            places[a:b, 2] = np.unwrap(places[a:b, 2], period=360.0)
    return [places[a:b] for a, b in pairwise(ends)]


def polygon_corners(atlas: Atlas) -> tuple[Array, IntArray]:
    """Corners of all charts of a surface in their tangent spaces [v, 2], in order round each, and their charts [v]."""
    owners = _owners(atlas)
    order = np.lexsort((np.arctan2(atlas.vertices[:, 1], atlas.vertices[:, 0]), owners))
    return atlas.vertices[order], owners


def open_charts(atlas: Atlas) -> BoolArray:
    """Which charts are under expansion: a vertex lies outside the ball, and no step from there was refused [n]."""
    beyond = (np.linalg.norm(atlas.vertices, axis=1) > atlas.radius) & (atlas.vertex_closed == Closed.OPEN.value)
    found = np.zeros(atlas.n_charts, bool)
    found[_owners(atlas)[beyond]] = True
    return found


def _owners(atlas: Atlas) -> IntArray:
    """The chart of each vertex [v]."""
    return np.repeat(np.arange(atlas.n_charts), np.diff(atlas.vertex_start))
