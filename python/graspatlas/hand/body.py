"""Bodies that the user states by URDF: what hand and object have in common."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TypedDict

from graspatlas.errors import GraspAtlasError
from graspatlas.hand.robot_files import find_file, package_folders
from graspatlas.hand.urdf import box_urdf, center_of_mass, cylinder_urdf, sphere_urdf
from graspatlas.hand.urdf_checks import check_urdf
from graspatlas.storage.files import read_text
from graspatlas.support.arrays import Array
from graspatlas.support.pickling import Light
from graspatlas.support.validation import PlainTable, StatedTable, checked_table, read_only

__all__ = ["Body"]


class BodyFields(TypedDict):
    """The fields of a body."""

    name: str
    urdf: str
    urdf_path: str
    package_dirs: tuple[str, ...]
    srdf: str
    package_paths: tuple[str, ...]


@dataclass(frozen=True)
class Body(Light):
    """A thing described by a URDF.

    Attributes:
        name: Its name.
        urdf: The URDF's text.
        urdf_path: Where it was read, as stated.
        package_dirs: Folders in which ``package://`` paths of meshes are looked up.
        srdf: Text of an SRDF with pairs of links that may touch, or nothing.
        package_paths: Those of these folders that the user named.
    """

    name: str
    urdf: str
    urdf_path: str = ""
    package_dirs: tuple[str, ...] = ()
    srdf: str = ""
    package_paths: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        check_urdf(self.name, self.urdf)

    def __repr__(self) -> str:
        origin = self.urdf_path or f"a URDF of {len(self.urdf)} characters"
        return f"<{type(self).__name__} {self.name!r} of {origin}>"

    @property
    def tree(self) -> str:
        """The URDF as Pinocchio is to read it."""
        return self.urdf

    @cached_property
    def center_of_mass(self) -> Array:
        """Centre of mass by the ``<inertial>`` of the URDF, in the root link's frame (3,), metres.

        All joints are at 0. It is the origin where no mass is stated, which for the bodies that are made here is right.
        """
        try:
            return read_only(center_of_mass(self.urdf))
        except ValueError as error:
            raise GraspAtlasError(f"the <inertial> of '{self.name}' holds what is not a number: {error}") from None

    @classmethod
    def _read(
        cls,
        urdf: str | Path,
        name: str | None,
        srdf: str | Path | None,
        folder: Path | None,
        package_paths: Sequence[str | Path] = (),
    ) -> BodyFields:
        """What a body holds that is read from a URDF file."""
        stated = tuple(str((folder or Path()) / place) for place in package_paths)
        path = find_file(urdf, folder, stated)
        try:
            text = read_text(path)
            srdf_text = read_text(find_file(srdf, folder, stated)) if srdf else ""
        except (OSError, UnicodeDecodeError) as error:
            raise GraspAtlasError(f"cannot read '{urdf}': {error}") from None
        return {
            "name": name or path.stem,
            "urdf": text,
            "urdf_path": str(urdf),
            "package_dirs": package_folders(path, stated),
            "srdf": srdf_text,
            "package_paths": stated,
        }

    @classmethod
    def from_urdf(
        cls,
        urdf: str | Path,
        *,
        name: str | None = None,
        srdf: str | Path | None = None,
        folder: Path | None = None,
        package_paths: Sequence[str | Path] = (),
    ) -> Body:
        """Read a body from a URDF file.

        Args:
            urdf: Path of the file; a relative one is looked up in `folder`, then in the robots of the package, and a
                ``package://`` one in the package paths and in example-robot-data.
            name: Name to give it; the file's by default.
            srdf: Path of an SRDF file.
            folder: Where relative paths start; the current folder by default.
            package_paths: Folders in which ``package://`` paths are looked up first.

        Raises:
            GraspAtlasError: If a file is missing or cannot be read.
        """
        return cls(**cls._read(urdf, name, srdf, folder, package_paths))

    @staticmethod
    def sphere(name: str, radius: float) -> Body:
        """A solid sphere about its frame's origin.

        Args:
            name: Its name.
            radius: Its radius [m].

        Raises:
            GraspAtlasError: If the radius is not a positive number.
        """
        return Body(name, sphere_urdf(name, radius))

    @staticmethod
    def box(name: str, size: Sequence[float]) -> Body:
        """A solid box about its frame's origin.

        Args:
            name: Its name.
            size: Lengths of its edges along x, y and z (3,), metres.

        Raises:
            GraspAtlasError: If these are not three positive numbers.
        """
        return Body(name, box_urdf(name, size))

    @staticmethod
    def cylinder(name: str, radius: float, length: float) -> Body:
        """A solid cylinder about its frame's origin, its axis along z.

        Args:
            name: Its name.
            radius: Its radius [m].
            length: Its length [m].

        Raises:
            GraspAtlasError: If one of them is not a positive number.
        """
        return Body(name, cylinder_urdf(name, radius, length))

    def to_dict(self) -> PlainTable:
        """The body as plain data, with the text of its URDF."""
        table: PlainTable = {"name": self.name, "urdf": self.urdf_path}
        table |= {"urdf_text": self.urdf, "srdf_text": self.srdf}
        return {**table, "package_paths": list(self.package_paths)} if self.package_paths else table

    @classmethod
    def _arguments(cls, data: StatedTable, folder: Path | None) -> BodyFields:
        """Arguments from a table: read from its URDF file, or from the text that a stored problem carries."""
        optional = ("name", "srdf", "urdf_text", "srdf_text", "package_paths")
        table = checked_table(data, f"a {cls.__name__.lower()}", ("urdf",), optional)
        path, name, stated = str(table["urdf"]), table.get("name"), tuple(table.get("package_paths") or ())
        if not table.get("urdf_text"):
            return cls._read(path, name, table.get("srdf"), folder, stated)
        try:
            found: Path | None = find_file(path, folder, stated)
        except GraspAtlasError:
            found = None
        return {
            "name": str(name),
            "urdf": str(table["urdf_text"]),
            "urdf_path": path,
            "package_dirs": package_folders(found, stated),
            "srdf": str(table.get("srdf_text") or ""),
            "package_paths": stated,
        }

    @classmethod
    def from_dict(cls, data: StatedTable, folder: Path | None = None) -> Body:
        """The body that a problem file or :meth:`to_dict` describes.

        Args:
            data: ``urdf``, and perhaps ``name`` and ``srdf``.
            folder: Where relative paths start.

        Raises:
            GraspAtlasError: If something is missing or wrong.
        """
        return cls(**cls._arguments(data, folder))
