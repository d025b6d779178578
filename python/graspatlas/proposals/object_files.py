"""A mesh as a body: its repaired surface to look at, convex pieces to collide with, and where its mass is."""

from __future__ import annotations

import importlib
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING
from xml.sax.saxutils import quoteattr

import numpy as np

from graspatlas.hand.body import Body
from graspatlas.meshes.reading import trimesh_library
from graspatlas.storage.files import replaced, writable_folder

if TYPE_CHECKING:
    import trimesh

__all__ = ["write_object"]

#: How concave the pieces may be, as CoACD measures it, and how many there may be.
CONCAVITY, MOST_PIECES = 0.03, 32
#: What CoACD spends on a cut, and how finely it closes a surface that has holes: a tenth of the time that it takes by
#: itself, for pieces that are as good.
EFFORT = {"mcts_iterations": 20, "mcts_nodes": 10, "mcts_max_depth": 2, "preprocess_resolution": 25, "resolution": 1000}
#: Faces with which CoACD works well; larger meshes are thinned for it alone.
MOST_FACES = 20_000
#: Closed surfaces that are cut one by one, at most.
MOST_PARTS = 8
#: Density of water [kg/m3]; what is held is about as heavy, hollow things less.
DENSITY = 1000.0
#: Mass where the mesh has no volume [kg].
MASS = 0.1


def write_object(mesh: trimesh.Trimesh, name: str, folder: Path) -> tuple[Body, str]:
    """Write ``object.urdf`` and its meshes, and read it.

    A mesh that is not convex is cut into convex pieces where CoACD is installed, which both collision checks and
    simulators need; without it, it is a surface to collide with.

    Args:
        mesh: The mesh, repaired, in metres.
        name: Name of the object.
        folder: Where to write.

    Returns:
        The body, and what was done in one sentence.

    Raises:
        GraspAtlasError: If files cannot be written.
    """
    meshes = writable_folder(folder / "meshes")
    _write_mesh(mesh, meshes / "object.obj")
    pieces, note = _pieces(mesh)
    names = ["object.obj"]
    if pieces:
        names = [f"piece_{i:02}.obj" for i in range(1, len(pieces) + 1)]
        for piece, file in zip(pieces, names, strict=True):
            _write_mesh(piece, meshes / file)
    solid = mesh if mesh.is_watertight and mesh.volume > 0.0 else mesh.convex_hull
    with replaced(folder / "object.urdf") as stream:
        stream.write(_urdf(name, solid, names).encode("utf-8"))
    return Body.from_urdf(folder / "object.urdf", name=name), note


def _write_mesh(mesh: trimesh.Trimesh, path: Path) -> None:
    vertices = (f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in np.asarray(mesh.vertices).tolist())
    faces = (f"f {a} {b} {c}" for a, b, c in (np.asarray(mesh.faces) + 1).tolist())
    with replaced(path) as stream:
        stream.write(("\n".join([*vertices, *faces]) + "\n").encode("ascii"))


def _urdf(name: str, solid: trimesh.Trimesh, collision: list[str]) -> str:
    """The URDF of a body whose meshes lie in the folder ``meshes`` beside it."""
    volume = abs(float(solid.volume))
    mass, center = (DENSITY * volume, solid.center_mass) if volume > 0.0 else (MASS, solid.centroid)
    tensor = DENSITY * np.asarray(solid.moment_inertia) if volume > 0.0 else np.eye(3) * 1e-4
    entries = {"ixx": tensor[0, 0], "ixy": tensor[0, 1], "ixz": tensor[0, 2]}
    entries.update({"iyy": tensor[1, 1], "iyz": tensor[1, 2], "izz": tensor[2, 2]})
    inertia = " ".join(f'{key}="{value:.6g}"' for key, value in entries.items())
    at = " ".join(f"{c:.9g}" for c in center)
    shapes = "\n".join(
        f'    <collision><geometry><mesh filename="meshes/{file}"/></geometry></collision>' for file in collision
    )
    return (
        f"<robot name={quoteattr(name)}>\n  <link name={quoteattr(name)}>\n"
        f'    <inertial><origin xyz="{at}"/><mass value="{mass:.6g}"/><inertia {inertia}/></inertial>\n'
        '    <visual><geometry><mesh filename="meshes/object.obj"/></geometry><material name="grey">'
        '<color rgba="0.72 0.74 0.78 1"/></material></visual>\n'
        f"{shapes}\n  </link>\n</robot>\n"
    )


def _pieces(mesh: trimesh.Trimesh) -> tuple[list[trimesh.Trimesh], str]:
    """Convex pieces of a mesh, none for one that is convex or where CoACD is missing; and what was done."""
    if mesh.is_convex:
        return [], "the mesh is convex"
    try:
        coacd = importlib.import_module("coacd")
    except ImportError:
        return [], (
            "the mesh is not convex and CoACD is missing, so that simulators cannot use it: pip install "
            "'graspatlas[mesh]'"
        )
    coacd.set_log_level("off")
    pieces: list[trimesh.Trimesh] = []
    with _silence():
        for part in _parts(mesh):
            if part.is_convex:
                pieces.append(part)
                continue
            thin = coacd.Mesh(np.asarray(part.vertices), np.asarray(part.faces))
            cut = coacd.run_coacd(thin, threshold=CONCAVITY, max_convex_hull=MOST_PIECES, seed=0, **EFFORT)
            pieces += [trimesh_library().Trimesh(vertices, faces).convex_hull for vertices, faces in cut]
    return pieces, f"the mesh is not convex: cut into {len(pieces)} convex pieces"


def _parts(mesh: trimesh.Trimesh) -> list[trimesh.Trimesh]:
    """The closed surfaces that a mesh is made of, which may pass through each other; or the mesh, thinned."""
    thin = _thinned(mesh)
    parts = list(thin.split(only_watertight=True, repair=False))
    whole = sum(len(part.faces) for part in parts) == len(thin.faces)
    closed = whole and all(part.volume > 0.0 for part in parts)
    return parts if closed and len(parts) <= MOST_PARTS else [thin]


def _thinned(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    """A mesh with so few faces that it is cut in seconds."""
    if len(mesh.faces) <= MOST_FACES:
        return mesh
    try:
        return mesh.simplify_quadric_decimation(face_count=MOST_FACES)
    except ImportError:
        return mesh


@contextmanager
def _silence() -> Iterator[None]:
    """What a library's compiled code prints goes nowhere."""
    sys.stdout.flush()
    kept, nowhere = os.dup(1), os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    try:
        yield
    finally:
        os.dup2(kept, 1)
        os.close(kept)
        os.close(nowhere)
