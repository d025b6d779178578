"""Meshes within the text of a URDF, for those that no file holds: a hand that is stored has them with it.

A ``<mesh>`` names them ``package://graspatlas_embedded/NAME.obj``, and a ``<embedded_mesh name="NAME">`` of the
``<robot>``, which other programs pass over, holds the text of an OBJ file. They are written to a folder that lasts as
long as the process where a mesh is to be read.
"""

from __future__ import annotations

import atexit
import hashlib
import re
import shutil
import tempfile
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

from graspatlas.hand.robot_files import PACKAGE
from graspatlas.storage.files import replaced
from graspatlas.support.arrays import Array, IntArray

if TYPE_CHECKING:
    from graspatlas.hand.body import Body

__all__ = ["embed_mesh", "mesh_folders"]

TAG, FOLDER = "embedded_mesh", "graspatlas_embedded"
#: What names of embedded meshes look like.
_NAME = re.compile(r"[0-9a-f]{16}")


def embed_mesh(robot: Element, corners: Array, faces: IntArray) -> str:
    """Put a mesh into a URDF.

    Args:
        robot: The ``<robot>``.
        corners: Corners (n, 3), metres.
        faces: Numbers of the corners of each triangle (f, 3).

    Returns:
        The file name by which a ``<mesh>`` names it.
    """
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in corners.tolist()]
    text = "\n".join([*lines, *(f"f {a + 1} {b + 1} {c + 1}" for a, b, c in faces.tolist())])
    name = hashlib.sha256(text.encode()).hexdigest()[:16]
    if all(other.get("name") != name for other in robot.findall(TAG)):
        SubElement(robot, TAG, name=name).text = text
    return f"{PACKAGE}{FOLDER}/{name}.obj"


def mesh_folders(body: Body) -> tuple[str, ...]:
    """Folders in which the ``package://`` paths of a body's meshes are found, those that its URDF holds included."""
    if f"<{TAG}" not in body.urdf:
        return body.package_dirs
    for mesh in ElementTree.fromstring(body.urdf).findall(TAG):
        name = str(mesh.get("name"))
        target = _folder() / FOLDER / f"{name}.obj"
        if _NAME.fullmatch(name) and not target.exists():
            with replaced(target) as stream:
                stream.write((mesh.text or "").encode("utf-8"))
    return (str(_folder()), *body.package_dirs)


@lru_cache(maxsize=1)
def _folder() -> Path:
    """A folder that is removed when the process ends."""
    folder = Path(tempfile.mkdtemp(prefix="graspatlas-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    (folder / FOLDER).mkdir()
    return folder
