"""Bodies that the user states by URDF: the hand, and the object it holds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from importlib import resources
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from graspatlas import _core
from graspatlas.errors import GraspAtlasError, unknown_name
from graspatlas.tables import checked_table, numbers

__all__ = ["Body", "Hand", "robots_folder"]

Array = NDArray[np.float64]


def robots_folder() -> Path:
    """Folder of the hands and objects that come with the package."""
    installed = Path(str(resources.files("graspatlas"))) / "robots"
    return installed if installed.is_dir() else Path(__file__).resolve().parents[2] / "robots"


def _find(path: str | Path, folder: Path | None) -> Path:
    """A file by its own path, beside `folder`, or among the robots of the package."""
    wanted = Path(path)
    places = [wanted] if wanted.is_absolute() else [(folder or Path()) / wanted, robots_folder() / wanted]
    for place in places:
        if place.is_file():
            return place
    looked = " and ".join(str(place) for place in places)
    raise GraspAtlasError(f"file '{path}' does not exist; looked for it at {looked}")


def _check_xml(name: str, text: str) -> None:
    try:
        root = ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        raise GraspAtlasError(f"the URDF of '{name}' is not XML: {error}") from None
    if root.tag != "robot":
        raise GraspAtlasError(f"the URDF of '{name}' must hold a <robot>, not a <{root.tag}>")


@dataclass(frozen=True)
class Body:
    """A thing described by a URDF.

    Attributes:
        name: Its name.
        urdf: The URDF's text.
        urdf_path: Where it was read, as stated.
        package_dirs: Folders in which ``package://`` paths of meshes are looked up.
        srdf: Text of an SRDF with pairs of links that may touch, or nothing.
    """

    name: str
    urdf: str
    urdf_path: str = ""
    package_dirs: tuple[str, ...] = ()
    srdf: str = ""

    def __post_init__(self) -> None:
        _check_xml(self.name, self.urdf)

    @classmethod
    def _read(
        cls,
        urdf: str | Path,
        name: str | None,
        srdf: str | Path | None,
        folder: Path | None,
    ) -> dict[str, object]:
        path = _find(urdf, folder)
        try:
            text = path.read_text(encoding="utf-8")
            srdf_text = _find(srdf, folder).read_text(encoding="utf-8") if srdf else ""
        except (OSError, UnicodeDecodeError) as error:
            raise GraspAtlasError(f"cannot read '{urdf}': {error}") from None
        return {
            "name": name or path.stem,
            "urdf": text,
            "urdf_path": str(urdf),
            "package_dirs": (str(path.parent), str(path.parent.parent), str(robots_folder())),
            "srdf": srdf_text,
        }

    @classmethod
    def from_urdf(
        cls,
        urdf: str | Path,
        *,
        name: str | None = None,
        srdf: str | Path | None = None,
        folder: Path | None = None,
    ) -> Body:
        """Read a body from a URDF file.

        Args:
            urdf: Path of the file; a relative one is looked up in `folder`, then in the robots of the package.
            name: Name to give it; the file's by default.
            srdf: Path of an SRDF file.
            folder: Where relative paths start; the current folder by default.

        Raises:
            GraspAtlasError: If a file is missing or cannot be read.
        """
        return cls(**cls._read(urdf, name, srdf, folder))  # type: ignore[arg-type]

    def to_dict(self) -> dict[str, Any]:
        """The body as plain data, with the text of its URDF."""
        return {"name": self.name, "urdf": self.urdf_path, "urdf_text": self.urdf, "srdf_text": self.srdf}

    @classmethod
    def _arguments(cls, data: Mapping[str, Any], folder: Path | None) -> dict[str, object]:
        """Arguments from a table: read from its URDF file, or from the text that a stored problem carries."""
        table = checked_table(data, f"a {cls.__name__.lower()}", ("urdf",), ("name", "srdf", "urdf_text", "srdf_text"))
        path, name = str(table["urdf"]), table.get("name")
        if not table.get("urdf_text"):
            return cls._read(path, name, table.get("srdf"), folder)
        try:
            package_dirs = cls._read(path, name, None, folder)["package_dirs"]
        except GraspAtlasError:
            package_dirs = (str(robots_folder()),)
        return {
            "name": str(name),
            "urdf": str(table["urdf_text"]),
            "urdf_path": path,
            "package_dirs": package_dirs,
            "srdf": str(table.get("srdf_text") or ""),
        }

    @classmethod
    def from_dict(cls, data: Mapping[str, Any], folder: Path | None = None) -> Body:
        """The body that a problem file or :meth:`to_dict` describes.

        Args:
            data: ``urdf``, and perhaps ``name`` and ``srdf``.
            folder: Where relative paths start.

        Raises:
            GraspAtlasError: If something is missing or wrong.
        """
        return cls(**cls._arguments(data, folder))  # type: ignore[arg-type]


@dataclass(frozen=True)
class Hand(Body):
    """A robotic hand; the root of its URDF is the palm, and the world.

    Attributes:
        limits: Joint limits that replace the URDF's, by joint name: (lower, upper) [rad or m].
    """

    limits: dict[str, tuple[float, float]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        super().__post_init__()
        for joint in self.limits:
            if joint not in self.joints:
                raise unknown_name("joint", joint, self.joints, f"in hand '{self.name}'")
            if (
                len(numbers(self.limits[joint], f"limits of joint '{joint}'")) != 2
                or not self.limits[joint][0] < self.limits[joint][1]
            ):
                raise GraspAtlasError(f"limits of joint '{joint}' must be (lower, upper), got {self.limits[joint]}")
        for info in self.model.hand_joints:
            if info.name in self.limits and info.q_size != 1:
                raise GraspAtlasError(f"joint '{info.name}' is continuous and has no limits; make it revolute")

    @classmethod
    def from_urdf(
        cls,
        urdf: str | Path,
        *,
        name: str | None = None,
        srdf: str | Path | None = None,
        folder: Path | None = None,
        limits: dict[str, tuple[float, float]] | None = None,
    ) -> Hand:
        """Read a hand from a URDF file; see :meth:`Body.from_urdf`."""
        return cls(**cls._read(urdf, name, srdf, folder), limits=dict(limits or {}))  # type: ignore[arg-type]

    def to_dict(self) -> dict[str, Any]:
        """The hand as plain data, with the text of its URDF."""
        return {**super().to_dict(), "limits": {name: list(pair) for name, pair in self.limits.items()}}

    @classmethod
    def from_dict(cls, data: Mapping[str, Any], folder: Path | None = None) -> Hand:
        """The hand that a problem file or :meth:`to_dict` describes; see :meth:`Body.from_dict`."""
        table = dict(checked_table(data, "a hand", ("urdf",), None))
        stated = checked_table(table.pop("limits", None) or {}, "limits", (), None)
        limits = {name: numbers(pair, f"limits of joint '{name}'") for name, pair in stated.items()}
        return cls(**cls._arguments(table, folder), limits=limits)  # type: ignore[arg-type]

    @cached_property
    def model(self) -> _core.Model:
        """The hand alone, as a kinematic tree."""
        if "<mimic" in self.urdf:
            raise GraspAtlasError(
                f"hand '{self.name}' has a joint that mimics another; coupled joints are not supported: drop "
                "the joint's <mimic> and state the coupling by the hand motions"
            )
        try:
            return _core.Model(self.urdf, "none")
        except GraspAtlasError as error:
            raise GraspAtlasError(f"hand '{self.name}' ({self.urdf_path or 'URDF text'}): {error}") from None

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the moving joints, in the order of q."""
        return tuple(joint.name for joint in self.model.hand_joints)

    @property
    def frames(self) -> tuple[str, ...]:
        """Names of the links and frames that a contact can sit on."""
        return tuple(self.model.frames)

    def frame(self, name: str) -> tuple[int, Array]:
        """Joint index and placement of a frame in that joint [4, 4].

        Raises:
            GraspAtlasError: If the hand has no such frame; the message names the nearest one.
        """
        frames = self.model.frames
        if name not in frames:
            raise unknown_name("frame", name, frames, f"in hand '{self.name}'")
        joint, T = frames[name]
        return joint, np.asarray(T)

    @cached_property
    def joint_limits(self) -> tuple[Array, Array]:
        """Lower and upper limits [nq each], the URDF's where `limits` does not replace them."""
        lower, upper = np.array(self.model.lower_limits), np.array(self.model.upper_limits)
        for joint in self.model.hand_joints:
            if joint.name in self.limits:
                lower[joint.q_index], upper[joint.q_index] = self.limits[joint.name]
        return lower, upper

    def joint_positions(self, q: NDArray[np.float64]) -> dict[str, float]:
        """Position of each joint with one degree of freedom [rad or m], from q [nq]."""
        positions = {}
        for joint in self.model.hand_joints:
            at = joint.q_index
            if joint.q_size == 1:
                positions[joint.name] = float(q[at])
            elif joint.v_size == 1:
                positions[joint.name] = float(np.arctan2(q[at + 1], q[at]))
        return positions

    def link_placements(self, q: NDArray[np.float64]) -> dict[str, Array]:
        """T_palm_link [4, 4] of every link and frame at joint configuration q [nq]."""
        return {name: np.asarray(T) for name, T in self.model.frame_placements(np.asarray(q, float)).items()}
