"""Geoms of an MJCF as collision and visual shapes of a URDF."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from graspatlas.hand.embedded_meshes import embed_mesh
from graspatlas.hand.mesh_files import mesh_corners
from graspatlas.hand.mjcf.names import Names
from graspatlas.hand.robot_files import PACKAGE
from graspatlas.numerics.rotations import matrix_from_quaternion, rpy_from_matrix
from graspatlas.support.arrays import Array

if TYPE_CHECKING:
    import mujoco

__all__ = ["ShapeWriter", "collides", "pose"]

#: Geoms of these groups are seen; MuJoCo's viewer hides the others at first.
SEEN = 2
#: The colour that geoms have by default, where that of their material counts.
DEFAULT = (0.5, 0.5, 0.5, 1.0)
#: Corners of a mesh file and of the compiled mesh are the same when they differ by less than this share of its size.
SAME = 1e-4
#: The ball of radius 1 that is stretched to ellipsoids, among the robots of the package.
BALL = "shapes/ball.obj"
#: Mesh files that are named as they are.
KEPT = (".stl", ".obj")


def pose(position: Array, quaternion: Array) -> Array:
    """Placement (4, 4) of a position (3,) and a quaternion w x y z (4,)."""
    T = np.eye(4)
    T[:3, :3] = matrix_from_quaternion(quaternion[[1, 2, 3, 0]])
    T[:3, 3] = position
    return T


def collides(model: mujoco.MjModel, geom: int) -> bool:
    """Whether a geom takes part in contacts, by its bits or by a pair that names it."""
    paired = geom in model.pair_geom1 or geom in model.pair_geom2
    return bool(model.geom_contype[geom] or model.geom_conaffinity[geom] or paired)


class ShapeWriter:
    """Writes geoms into the links of a URDF.

    Args:
        model: The compiled model.
        library: The module ``mujoco``.
        path: File of the MJCF.
        names: Names of the geoms.
        robot: The ``<robot>``, which takes in meshes that no file holds.

    Attributes:
        notes: What is left out.
    """

    def __init__(self, model: mujoco.MjModel, library: Any, path: Path, names: Names, robot: Element) -> None:
        self._model, self._library, self._folder = model, library, path.resolve().parent
        self._names, self._robot = names, robot
        self._meshes: dict[int, tuple[str, Array, Array]] = {}
        self.notes: list[str] = []

    def add(self, link: Element, geom: int) -> None:
        """Add a geom to a link: as collision shape if it takes part in contacts, as visual one if it is seen."""
        found = self._geometry(geom)
        if found is None:
            self.notes.append(
                f"geom '{self._names.geom(geom)}' is a {self._kind(geom)}, which a hand cannot have: left out"
            )
            return
        kind, attributes, T = found
        solid = collides(self._model, geom)
        if solid:
            self._write(SubElement(link, "collision"), kind, attributes, T)
        if self._model.geom_group[geom] <= SEEN:
            visual = SubElement(link, "visual")
            self._write(visual, kind, attributes, T)
            material = SubElement(visual, "material", name=f"colour_{geom}")
            SubElement(material, "color", rgba=_words(self._colour(geom)))

    def _write(self, element: Element, kind: str, attributes: dict[str, str], T: Array) -> None:
        SubElement(element, "origin", xyz=_words(T[:3, 3]), rpy=_words(rpy_from_matrix(T[:3, :3])))
        SubElement(SubElement(element, "geometry"), kind, attributes)

    def _geometry(self, geom: int) -> tuple[str, dict[str, str], Array] | None:
        """Kind and attributes of a geom in a URDF, and its placement in the link (4, 4); None where URDF has none."""
        model = self._model
        a, b, c = (float(size) for size in model.geom_size[geom])
        T, kind = pose(model.geom_pos[geom], model.geom_quat[geom]), self._kind(geom)
        if kind == "sphere":
            return "sphere", {"radius": repr(a)}, T
        if kind in ("capsule", "cylinder"):
            return kind, {"radius": repr(a), "length": repr(2.0 * b)}, T
        if kind == "box":
            return "box", {"size": _words((2.0 * a, 2.0 * b, 2.0 * c))}, T
        if kind == "ellipsoid":
            return "mesh", {"filename": PACKAGE + BALL, "scale": _words((a, b, c))}, T
        if kind == "mesh":
            file, scale, offset = self._mesh(int(model.geom_dataid[geom]))
            return "mesh", {"filename": file, "scale": _words(scale)}, T @ offset
        return None

    def _kind(self, geom: int) -> str:
        """What kind of geom it is, such as box."""
        kind = self._library.mjtGeom(int(self._model.geom_type[geom]))
        return str(kind.name).removeprefix("mjGEOM_").lower()

    def _mesh(self, mesh: int) -> tuple[str, Array, Array]:
        """How a URDF names a mesh, its scale (3,), and where its file has the compiled mesh's origin, inverted (4, 4).

        MuJoCo moves meshes to their centre of mass and turns them to their principal axes.
        """
        if mesh not in self._meshes:
            model = self._model
            scale = np.asarray(model.mesh_scale[mesh], float)
            inverse: Array = np.linalg.inv(pose(model.mesh_pos[mesh], model.mesh_quat[mesh])).astype(float)
            first = int(model.mesh_vertadr[mesh])
            corners = np.asarray(model.mesh_vert[first : first + int(model.mesh_vertnum[mesh])], float)
            file = self._file(mesh)
            if file is not None and _are_same(file, scale, corners, inverse):
                self._meshes[mesh] = self._stated(file), scale, inverse
            else:
                start = int(model.mesh_faceadr[mesh])
                faces = np.asarray(model.mesh_face[start : start + int(model.mesh_facenum[mesh])], int)
                self._meshes[mesh] = embed_mesh(self._robot, corners, faces), np.ones(3), np.eye(4)
        return self._meshes[mesh]

    def _file(self, mesh: int) -> Path | None:
        """The file of a mesh, where it is of a kind that is read everywhere."""
        at = int(self._model.mesh_pathadr[mesh])
        if at < 0:
            return None
        stated = bytes(self._model.paths[at:]).split(b"\0", 1)[0].decode("utf-8", "replace")
        path = Path(stated) if Path(stated).is_absolute() else self._folder / stated
        return path if path.suffix.lower() in KEPT and path.is_file() else None

    def _stated(self, file: Path) -> str:
        """How a URDF names a file: relative to the folder of the MJCF or the one above, so that both can be moved."""
        file = file.resolve()
        for folder in (self._folder, self._folder.parent):
            if file.is_relative_to(folder) and folder != Path(folder.anchor):
                return PACKAGE + file.relative_to(folder).as_posix()
        return str(file)

    def _colour(self, geom: int) -> Array:
        """Red, green, blue and opacity of a geom (4,)."""
        own, material = np.asarray(self._model.geom_rgba[geom], float), int(self._model.geom_matid[geom])
        if material >= 0 and np.allclose(own, DEFAULT):
            return np.asarray(self._model.mat_rgba[material], float)
        return own


def _are_same(file: Path, scale: Array, corners: Array, inverse: Array) -> bool:
    """Whether a file holds the compiled corners (n, 3), before these were moved, in the same box."""
    try:
        stated = mesh_corners(file)
    except (OSError, ValueError):
        return False
    if stated is None or not len(stated):
        return False
    moved = (stated * scale) @ inverse[:3, :3].T + inverse[:3, 3]
    size = float(np.ptp(corners, axis=0).max())
    ends = [np.abs(end(moved) - end(corners)).max() for end in (_lowest, _highest)]
    return bool(max(ends) <= SAME * size)


def _lowest(points: Array) -> Array:
    return np.asarray(points.min(axis=0))


def _highest(points: Array) -> Array:
    return np.asarray(points.max(axis=0))


def _words(values: Iterable[float]) -> str:
    return " ".join(repr(float(value)) for value in values)
