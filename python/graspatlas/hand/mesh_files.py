"""Mesh files of a URDF: looked at before a collision library does, which takes NaN for a place, and known again."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING
from xml.etree import ElementTree

import numpy as np

from graspatlas.errors import GraspAtlasError
from graspatlas.hand.embedded_meshes import mesh_folders
from graspatlas.hand.robot_files import PACKAGE
from graspatlas.hand.urdf_checks import LARGEST
from graspatlas.storage.files import is_file, read_text
from graspatlas.support.arrays import Array

if TYPE_CHECKING:
    from graspatlas.hand.body import Body

__all__ = ["check_meshes", "mesh_corners", "meshes_digest"]

#: Before the triangles of a binary STL file: a header, and their number [bytes].
_STL_HEADER = 84
#: A triangle of a binary STL file.
_STL_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def check_meshes(body: Body) -> None:
    """Make sure that the STL and OBJ files which a body's URDF names hold places, and enough of them for a triangle.

    Args:
        body: The body; files that are not there are passed over, since whoever reads them says so.

    Raises:
        GraspAtlasError: If one holds a number that is not finite, or nothing but a point or a line.
    """
    for path in _paths(body):
        _check(body.name, path)


def meshes_digest(bodies: Iterable[Body]) -> str:
    """SHA-256 of the mesh files that the URDFs of bodies name, by which a file that was saved anew is told.

    Args:
        bodies: The bodies; files that are not there are passed over.

    Raises:
        GraspAtlasError: If a file cannot be read.
    """
    digest = hashlib.sha256()
    for body in bodies:
        for path in _paths(body):
            try:
                digest.update(hashlib.sha256(path.read_bytes()).digest())
            except OSError as error:
                raise _unreadable(path, body.name, error) from None
    return digest.hexdigest()


def _paths(body: Body) -> list[Path]:
    """The mesh files of a body that are there, in the order of their names."""
    folders = mesh_folders(body)
    names = sorted({str(mesh.get("filename")) for mesh in ElementTree.fromstring(body.urdf).iter("mesh")})
    return [path for name in names if (path := _path(name, folders)) is not None]


def _path(name: str, folders: tuple[str, ...]) -> Path | None:
    """Where a mesh is found, as Pinocchio looks for it."""
    if name.startswith(PACKAGE):
        places = [Path(folder) / name[len(PACKAGE) :] for folder in folders]
    else:
        places = [Path(name.removeprefix("file://"))]
    return next((place for place in places if is_file(place)), None)


def _unreadable(path: Path, body: str, error: Exception) -> GraspAtlasError:
    return GraspAtlasError(f"mesh '{path}' of '{body}' cannot be read: {error}")


def _check(body: str, path: Path) -> None:
    try:
        corners = mesh_corners(path)
    except (OSError, ValueError) as error:
        raise _unreadable(path, body, error) from None
    if corners is None:
        return
    sound = (np.abs(corners) < LARGEST).all(axis=1)
    if not sound.all():
        first = ", ".join(f"{number:g}" for number in corners[np.flatnonzero(~sound)[0]])
        raise GraspAtlasError(
            f"mesh '{path}' of '{body}' has {(~sound).sum()} corners that are not finite numbers, such as ({first}): "
            "save it again"
        )
    spread = corners - corners.mean(axis=0) if len(corners) else np.zeros((1, 3))
    sizes = np.linalg.svd(spread.T @ spread, compute_uv=False) ** 0.5
    if not sizes[1] > 1e-9 * sizes[0]:
        raise GraspAtlasError(f"mesh '{path}' of '{body}' has no area: its corners lie in one point or line")


def mesh_corners(path: Path) -> Array | None:
    """Corners of the triangles of a mesh (n, 3), in its own unit; None where the format is not known here."""
    kind = path.suffix.lower()
    if kind == ".stl":
        return _stl_corners(path)
    if kind != ".obj":
        return None
    rows = [line.split()[1:4] for line in read_text(path).splitlines() if line.startswith("v ")]
    return np.array(rows, float).reshape(-1, 3)


def _stl_corners(path: Path) -> Array | None:
    """Corners in an STL file, binary or text; None where it is neither, which whoever reads it says."""
    size = path.stat().st_size
    with path.open("rb") as stream:
        head = stream.read(_STL_HEADER)
        count = int.from_bytes(head[80:84], "little")
        if len(head) == _STL_HEADER and size == _STL_HEADER + count * _STL_TRIANGLE.itemsize:
            return np.fromfile(stream, _STL_TRIANGLE, count)["corners"].reshape(-1, 3).astype(float)
    if not head.lstrip().startswith(b"solid"):
        return None
    words = read_text(path, "latin-1").split()  # of the file, whose lines may be broken anywhere
    rows = [words[i + 1 : i + 4] for i, word in enumerate(words) if word == "vertex"]
    return np.array(rows, float).reshape(-1, 3)
