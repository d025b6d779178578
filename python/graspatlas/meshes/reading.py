"""Meshes from files and from trimesh, checked to be triangles with finite corners."""

from __future__ import annotations

import importlib
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, TypeAlias, Union

import numpy as np

from graspatlas.errors import GraspAtlasError
from graspatlas.storage.files import is_file
from graspatlas.support.arrays import Array, IntArray

if TYPE_CHECKING:
    import trimesh

__all__ = ["AnyMesh", "read_mesh", "trimesh_library"]

#: A file that trimesh reads, or what trimesh has read.
AnyMesh: TypeAlias = Union[str, Path, "trimesh.Trimesh"]
#: A mesh with more faces is refused: it would take gigabytes.
MOST_FACES = 10_000_000
#: Vertices are nearer to the origin than this [units of the mesh].
LARGEST = 1e9


def trimesh_library() -> ModuleType:
    """The optional package trimesh.

    Raises:
        GraspAtlasError: If it is not installed.
    """
    try:
        return importlib.import_module("trimesh")
    except ImportError:
        raise GraspAtlasError("reading a mesh needs trimesh; install it: pip install graspatlas[mesh]") from None


def read_mesh(mesh: AnyMesh) -> tuple[Array, IntArray]:
    """Vertices (n, 3) and faces (m, 3) of a mesh as they are stated.

    Args:
        mesh: A file that trimesh reads (STL, OBJ, PLY, OFF, ...), or a ``trimesh.Trimesh``.

    Raises:
        GraspAtlasError: If trimesh is not installed, there is no such file, or it holds no mesh of triangles with
            finite corners.
    """
    trimesh = trimesh_library()
    name = f"mesh '{mesh}'" if isinstance(mesh, str | Path) else "the mesh"
    if isinstance(mesh, str | Path):
        path = Path(mesh)
        if not is_file(path):
            raise GraspAtlasError(f"there is no mesh file '{path}'; correct the path")
        try:
            mesh = trimesh.load_mesh(path, process=False)
        except Exception as error:  # whatever the reader of that format raises
            raise GraspAtlasError(f"cannot read mesh file '{path}': {error}") from None
    if not isinstance(mesh, trimesh.Trimesh):
        raise GraspAtlasError(f"mesh must be a file with one mesh or a trimesh.Trimesh, got {type(mesh).__name__}")
    vertices, faces = np.asarray(mesh.vertices, float), np.asarray(mesh.faces, np.int64)
    if len(faces) == 0:
        raise GraspAtlasError(f"{name} has no faces, or vertices that are not finite; look at it in a mesh viewer")
    if len(faces) > MOST_FACES:
        raise GraspAtlasError(f"{name} has {len(faces)} faces, at most {MOST_FACES} are taken: simplify it first")
    if not (np.abs(vertices[faces.ravel()]) < LARGEST).all():
        raise GraspAtlasError(f"{name} has no faces, or vertices that are not finite; look at it in a mesh viewer")
    return vertices, faces
