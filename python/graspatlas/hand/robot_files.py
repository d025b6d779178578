"""Where the URDFs of hands are found: the package's own, example-robot-data and robot_descriptions."""

from __future__ import annotations

import importlib
import pkgutil
import sys
from functools import lru_cache
from importlib import resources
from pathlib import Path
from xml.etree import ElementTree

from graspatlas.errors import GraspAtlasError, unknown_name
from graspatlas.storage.files import is_file

__all__ = [
    "MJCF_ENDINGS",
    "bundled_hands",
    "described_names",
    "described_robot",
    "example_names",
    "example_robot",
    "find_file",
    "first_tag",
    "is_mjcf",
    "package_folders",
    "robots_folder",
]

PACKAGE = "package://"
#: Names of MJCF files end so.
MJCF_ENDINGS = (".mjcf", ".xml")


def robots_folder() -> Path:
    """Folder of the hands and objects that come with the package."""
    installed = Path(str(resources.files("graspatlas"))) / "robots"
    return installed if installed.is_dir() else Path(__file__).resolve().parents[3] / "robots"


@lru_cache(maxsize=1)
def _example_share() -> Path | None:
    """Folder that holds the package example-robot-data, or None when it is not installed."""
    shares = [*(Path(place) / "cmeel.prefix" / "share" for place in sys.path), Path(sys.prefix) / "share"]  # pip, conda
    return next((share for share in shares if (share / "example-robot-data").is_dir()), None)


@lru_cache(maxsize=1)
def _example_urdfs(share: Path) -> dict[str, str]:
    """The ``package://`` paths of all URDFs in example-robot-data, by the files' names without ending."""
    urdfs = sorted(share.glob("example-robot-data/robots/*/**/*.urdf"))
    return {path.stem: PACKAGE + path.relative_to(share).as_posix() for path in urdfs}


def package_folders(urdf: Path | None, stated: tuple[str, ...] = ()) -> tuple[str, ...]:
    """Folders in which ``package://`` paths are looked up, the stated ones first.

    Args:
        urdf: File of the URDF; its folder and the one above are looked into.
        stated: What the user names.
    """
    beside = () if urdf is None else (str(urdf.parent), str(urdf.parent.parent))
    share = _example_share()
    return (*stated, *beside, str(robots_folder()), *(() if share is None else (str(share),)))


def find_file(path: str | Path, folder: Path | None, stated: tuple[str, ...] = ()) -> Path:
    """A file by its own path, beside `folder`, among the robots of the package, or in a package's folder.

    Args:
        path: Absolute, relative, or ``package://...``.
        folder: Where relative paths start; the current folder by default.
        stated: Folders in which ``package://`` paths are looked up first.

    Raises:
        GraspAtlasError: If it is in none of these places.
    """
    wanted = Path(path)
    if str(path).startswith(PACKAGE):
        places = [Path(place) / str(path)[len(PACKAGE) :] for place in package_folders(None, stated)]
    elif wanted.is_absolute():
        places = [wanted]
    else:
        places = [(folder or Path()) / wanted, robots_folder() / wanted]
    for place in places:
        if is_file(place):
            return place
    if len(str(path)) > LONGEST_PATH or "\0" in str(path):
        raise GraspAtlasError(f"{str(path)!r:.60}... cannot be the path of a file: it is too long, or holds a null")
    looked = " and ".join(dict.fromkeys(map(str, places)))
    raise GraspAtlasError(f"file '{path}' does not exist; looked for it at {looked}")


def first_tag(path: str | Path) -> str:
    """Name of the first element of an XML file; empty where there is none."""
    try:
        with open(path, "rb") as stream:
            for _, element in ElementTree.iterparse(stream, events=("start",)):
                return str(element.tag)
    except (OSError, ElementTree.ParseError):
        pass
    return ""


def is_mjcf(path: str | Path) -> bool:
    """Whether a file is an MJCF: by its first element, or where that cannot be read by its name's ending."""
    tag = first_tag(path)
    return tag == "mujoco" if tag else Path(path).suffix.lower() in MJCF_ENDINGS


def bundled_hands() -> dict[str, str]:
    """The hands that come with the package: paths of their URDFs among its robots, by name."""
    folder = robots_folder()
    urdfs = sorted(folder.glob("*/*.urdf"))
    return {path.stem: path.relative_to(folder).as_posix() for path in urdfs if path.stem == path.parent.name}


def example_names() -> tuple[str, ...]:
    """Names of the URDFs in example-robot-data; none where that is not installed."""
    share = _example_share()
    return () if share is None else tuple(_example_urdfs(share))


def described_names() -> tuple[str, ...]:
    """Names of the robots in robot_descriptions; none where that is not installed."""
    try:
        listing = importlib.import_module("robot_descriptions")
    except ImportError:
        return ()
    modules = pkgutil.iter_modules(listing.__path__)
    return tuple(module.name for module in modules if module.name.endswith("_description"))


def example_robot(name: str) -> str:
    """The ``package://`` path of a URDF in example-robot-data.

    Args:
        name: The URDF's file name without ending, such as ``"allegro_right_hand"``.

    Raises:
        GraspAtlasError: If example-robot-data is not installed or has no such robot.
    """
    share = _example_share()
    if share is None:
        raise GraspAtlasError("example-robot-data is not installed: pip install example-robot-data")
    found = _example_urdfs(share)
    if name not in found:
        raise unknown_name("robot", name, found, "in example-robot-data")
    return found[name]


#: Paths that are longer are not quoted [characters].
LONGEST_PATH = 250
#: Longest reason that is quoted [characters].
REASON = 200


def described_robot(name: str) -> tuple[str, tuple[str, ...]]:
    """The URDF or MJCF of a robot of robot_descriptions, which fetches it on first use, and its package folders.

    Args:
        name: Such as ``"allegro_hand_description"``.

    Raises:
        GraspAtlasError: If robot_descriptions is not installed, has no such robot or cannot fetch it.
    """
    names = described_names()
    if not names:
        raise GraspAtlasError("robot_descriptions is not installed: pip install graspatlas[hands]")
    if name not in names:
        raise unknown_name("robot", name, names, "in robot_descriptions")
    try:
        module = importlib.import_module(f"robot_descriptions.{name}")
    except Exception as error:  # git, network and file errors of many kinds
        raise GraspAtlasError(
            f"robot_descriptions cannot fetch '{name}': {_last_words(error)}; it clones a repository on first "
            "use: try again with a connection, or give the path of a URDF instead"
        ) from None
    path = getattr(module, "URDF_PATH", None) or getattr(module, "MJCF_PATH", None)
    if path is None:
        raise GraspAtlasError(f"'{name}' of robot_descriptions has neither URDF nor MJCF")
    package = Path(module.PACKAGE_PATH)
    return str(path), tuple(map(str, dict.fromkeys((package.parent, package, module.REPOSITORY_PATH))))


def _last_words(error: Exception) -> str:
    """What git said in the end, such as that it knows no such host; or else the beginning of the error."""
    words = " ".join(str(error).split())
    _, found, last = words.rpartition("fatal: ")
    return last.strip("'\" ")[-REASON:] if found else words[:REASON]
