"""The regions of a mesh."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np

from graspatlas.errors import GraspAtlasError, unknown_name
from graspatlas.meshes.reading import AnyMesh
from graspatlas.meshes.repair import Repair, Scale, repaired_triangles
from graspatlas.meshes.triangles import TriangleMesh
from graspatlas.patches.base import Interval, Patch
from graspatlas.regions.covering import CELLS, PER_CELL, covering, within
from graspatlas.regions.cutting import Cutting, Part
from graspatlas.regions.region import Region
from graspatlas.regions.sampling import on_triangles
from graspatlas.regions.surfaces import Surface, vector
from graspatlas.support.arrays import Array
from graspatlas.support.validation import positive

__all__ = ["check_unit", "find_regions", "region_named", "regions_of"]

#: Tolerance by default, as a share of the diagonal of the box around the mesh.
TOLERANCE = 0.006
#: Faces at a larger angle are cut apart [rad]: 35 degrees.
CREASE = float(np.radians(35.0))
#: Least area of a region, as a share of the mesh's.
SMALLEST = 0.005
#: Largest tolerance, as a share of the diagonal.
COARSEST = 0.2
#: Areas nearer to one another than this share count as equal when regions are numbered.
SAME_AREA = 0.01


def find_regions(
    mesh: AnyMesh,
    *,
    scale: Scale | None = None,
    tolerance: float | None = None,
    crease: float = CREASE,
    smallest: float = SMALLEST,
) -> tuple[Region, ...]:
    """Cut a mesh into smooth regions, each with the simplest patch that fits it.

    The mesh is repaired (:func:`graspatlas.meshes.repaired`), its normals are smoothed, and it is cut at its creases. A
    piece that no surface fits is searched for planes, cylinders, spheres and cones that parts of it lie on, and what
    remains, being bent, is cut by its normals until splines fit. A surface fits when 98 % of the area lie within the
    tolerance, and 95 % of the normals within 25 degrees; faces that miss it by more than half as much again are left
    out. Nothing depends on chance.

    Args:
        mesh: A file that trimesh reads (STL, OBJ, PLY, OFF, ...), or a ``trimesh.Trimesh``.
        scale: From the mesh's unit to metres, one number or three along x, y and z; 1 by default, and then a mesh that
            is too large or too small to be grasped is refused.
        tolerance: Largest distance of a region from its patch [m]; 0.6 % of the mesh's diagonal by default. Small
            regions have less: 5 % of the side of a square of their area.
        crease: Neighbouring faces whose smoothed normals make a larger angle are cut apart [rad].
        smallest: Least area of a region as a share of the mesh's.

    Returns:
        The regions, the largest first.

    Raises:
        GraspAtlasError: If trimesh is missing, the mesh cannot be read or repaired, seems to be in another unit, or has
            no region that a patch fits; or an argument is wrong.
    """
    whole, report = repaired_triangles(mesh, 1.0 if scale is None else scale)
    if scale is None:
        check_unit(report)
    return regions_of(whole, tolerance=tolerance, crease=crease, smallest=smallest)


def check_unit(report: Repair) -> None:
    """Refuse a mesh that seems to be in another unit than metres.

    Raises:
        GraspAtlasError: If it does, with the scale to state.
    """
    if report.unit_doubt():
        raise GraspAtlasError(report.unit_doubt())


def regions_of(
    mesh: TriangleMesh, *, tolerance: float | None = None, crease: float = CREASE, smallest: float = SMALLEST
) -> tuple[Region, ...]:
    """:func:`find_regions` of a mesh that is repaired already."""
    positive(crease, "crease", np.pi)
    positive(smallest, "smallest", 1.0)
    limit = TOLERANCE * mesh.diagonal if tolerance is None else positive(tolerance, "tolerance")
    if limit > COARSEST * mesh.diagonal:
        raise GraspAtlasError(
            f"tolerance {limit:g} m is more than a fifth of the mesh's diagonal, {mesh.diagonal:.3g} m: choose a "
            "smaller one"
        )
    cutting = Cutting(mesh, limit, crease, smallest * float(mesh.areas.sum()))
    found = [region for part in cutting.parts() if (region := _region(mesh, part)) is not None]
    if not found:
        raise GraspAtlasError(
            "no part of the mesh is smooth enough for a patch within the tolerance of "
            f"{1e3 * limit:.3g} mm: choose a larger tolerance, or a mesh with less noise"
        )
    return _named(found, mesh.diagonal)


def region_named(regions: tuple[Region, ...], name: str) -> Region:
    """The region of a name.

    Raises:
        GraspAtlasError: If there is none; with the names that there are.
    """
    for region in regions:
        if region.name == name:
            return region
    raise unknown_name("region", name, [region.name for region in regions], "one of the mesh's")


def _region(mesh: TriangleMesh, part: Part) -> Region | None:
    """The region of a part of a mesh; None where no patch of it is regular."""
    faces = part.faces
    corners, areas = mesh.corners[faces], mesh.areas[faces]
    points, _ = on_triangles(corners, areas, CELLS**2 * PER_CELL, np.random.default_rng(0))
    places = np.concatenate([points, corners.reshape(-1, 3)])
    surface = part.surface.centered(places)
    u, v = covering(surface, places)
    inner_u, inner_v, filled = within(surface, points, u, v)
    try:
        patch, inner = _patch(surface, u, v), _patch(surface, inner_u, inner_v)
    except GraspAtlasError:
        return None
    gaps = np.abs(surface.distances(places))
    return Region(
        name=("inner_" if surface.concave else "") + surface.kind,
        patch=patch,
        inner=inner,
        area=float(areas.sum()),
        error=(float(gaps.max()), float(np.sqrt(np.mean(gaps[: len(points)] ** 2)))),
        filled=filled,
        faces=mesh.source[faces],
        center=vector(_mean(mesh.centers[faces], areas)),
        normal=vector(_direction(_mean(mesh.normals[faces], areas))),
        corners=corners,
    )


def _patch(surface: Surface, u: Interval | None, v: Interval | None) -> Patch:
    return surface.patch(u, v if v is not None else (-np.pi, np.pi))


def _mean(values: Array, weights: Array) -> Array:
    return np.asarray(weights @ values / weights.sum())


def _direction(mean: Array) -> Array:
    """A mean of unit vectors made one, or zero where they cancel."""
    length = float(np.linalg.norm(mean))
    return mean / length if length > 0.05 else np.zeros(3)


def _named(regions: list[Region], diagonal: float) -> tuple[Region, ...]:
    """Regions by area, those of about the same area by their places from above, with numbers for each kind."""
    ordered = sorted(regions, key=lambda region: -region.area)
    groups: list[list[Region]] = []
    for region in ordered:
        if groups and region.area > (1.0 - SAME_AREA) * groups[-1][0].area:
            groups[-1].append(region)
        else:
            groups.append([region])

    def place(region: Region) -> tuple[int, ...]:
        return tuple(-round(1e3 * c / diagonal) for c in reversed(region.center))

    counts: Counter[str] = Counter()
    named = []
    for region in (r for group in groups for r in sorted(group, key=place)):
        counts[region.name] += 1
        named.append(replace(region, name=f"{region.name}_{counts[region.name]}"))
    return tuple(named)
