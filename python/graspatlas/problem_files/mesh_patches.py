"""Patches that a problem file states by a mesh: they are made ordinary ones when the file is read."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from graspatlas.errors import GraspAtlasError
from graspatlas.hand.body import Body
from graspatlas.hand.robot_files import find_file
from graspatlas.hand.urdf import origin_of, root_link
from graspatlas.patches.base import Patch
from graspatlas.patches.registry import patch_from_dict

__all__ = ["MADE_OF_MESHES", "PatchesOfMeshes"]

#: Types of patches that are stated by a mesh.
MADE_OF_MESHES = ("mesh_patch", "region")
#: How many meshes are kept with their regions: contacts of one problem mostly lie on one.
MOST_KEPT = 8


@dataclass(frozen=True)
class MeshSource:
    """A mesh and where it is.

    Attributes:
        path: Its file.
        changed: When the file was written, so that a new one is read again [ns].
        scale: From its unit to metres along x, y and z; None where nothing is said of it.
        T: Its placement in the frame of the patch, rows of a matrix (3, 4).
    """

    path: Path
    changed: int
    scale: tuple[float, float, float] | None
    T: tuple[tuple[float, ...], ...] = ((1.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0))


@dataclass(frozen=True)
class PatchesOfMeshes:
    """Makes patches from what a file states.

    Attributes:
        folder: Where relative paths start.
        package_paths: Folders in which ``package://`` paths are looked up.
        object: The object, whose own mesh is meant where none is named.
        scaled: Whether the file states the scale of the object's mesh.
    """

    folder: Path | None
    package_paths: tuple[str, ...]
    object: Body
    scaled: bool

    def patch(self, stated: Mapping[str, Any], *, on_object: bool) -> Patch:
        """The patch that a table states.

        Raises:
            GraspAtlasError: If it makes none: no such mesh or region, a place off the mesh, too bent for one patch, ...
        """
        kind = stated["type"]
        if kind not in MADE_OF_MESHES:
            return patch_from_dict(stated)
        source = self._source(stated, on_object)
        if kind == "region":
            from graspatlas.regions.find import region_named

            region = region_named(_regions(source, stated.get("tolerance")), str(stated["name"]))
            return region.patch if stated.get("whole") else region.inner
        options = {name: stated[name] for name in ("u_axis", "control_points", "tolerance") if name in stated}
        from graspatlas.patches.mesh_fit import patch_from_mesh

        return patch_from_mesh(_mesh(source), stated["center"], stated["size"], **options)[0]

    def _source(self, stated: Mapping[str, Any], on_object: bool) -> MeshSource:
        """The mesh that a table names, or the object's."""
        if stated.get("mesh") is not None:
            path = find_file(stated["mesh"], self.folder, self.package_paths)
            return MeshSource(path.resolve(), path.stat().st_mtime_ns, _triple(stated.get("scale")))
        if not on_object:
            raise GraspAtlasError(f"a {stated['type']} of the hand must name its mesh: mesh: FILE")
        if stated.get("scale") is not None:
            raise GraspAtlasError("scale is that of a mesh named here; that of the object's mesh stands under object")
        return _own_mesh(self.object, self.scaled)


def _triple(scale: float | list[float] | None) -> tuple[float, float, float] | None:
    if scale is None:
        return None
    x, y, z = scale if isinstance(scale, list) else [scale] * 3
    return (float(x), float(y), float(z))


def _own_mesh(body: Body, scaled: bool) -> MeshSource:
    """The one mesh of an object's root link: that which is seen, or else that which collides."""
    root = root_link(body.urdf)
    link = next(link for link in ElementTree.fromstring(body.urdf).iter("link") if link.get("name") == root)
    for shapes in ("visual", "collision"):
        found = [(shape, mesh) for shape in link.iter(shapes) for mesh in shape.iter("mesh")]
        if len(found) == 1:
            shape, mesh = found[0]
            factors = [float(word) for word in str(mesh.get("scale", "1 1 1")).split()]
            path = find_file(str(mesh.get("filename")).removeprefix("file://"), None, body.package_dirs)
            rotation, shift = origin_of(shape)
            T = tuple(tuple(map(float, row)) for row in np.column_stack([rotation, shift]))
            known = scaled or (mesh.get("scale") is not None and factors != [1.0, 1.0, 1.0])
            return MeshSource(path.resolve(), path.stat().st_mtime_ns, _triple(factors) if known else None, T)
    raise GraspAtlasError(
        f"the object '{body.name}' has no mesh, or more than one, in link '{root}': name the one that is meant, "
        "mesh: FILE"
    )


@lru_cache(maxsize=MOST_KEPT)
def _mesh(source: MeshSource) -> Any:
    """The mesh in the frame of the patch, in metres."""
    from graspatlas.meshes.repair import repaired
    from graspatlas.regions.find import check_unit

    mesh, report = repaired(source.path, scale=source.scale or 1.0)
    if source.scale is None:
        check_unit(report)
    mesh.apply_transform(np.vstack([np.array(source.T), [0.0, 0.0, 0.0, 1.0]]))
    return mesh


@lru_cache(maxsize=MOST_KEPT)
def _regions(source: MeshSource, tolerance: float | None) -> Any:
    """The regions of a mesh."""
    from graspatlas.regions.find import find_regions

    return find_regions(_mesh(source), scale=1.0, tolerance=tolerance)
