"""Loads the compiled core, and says what is wrong with the libraries that it stands on.

C++ libraries fit the version that they were compiled with, and no other: their file names carry none, so this asks
which ones are installed, and what is in the way when libraries of another installation take their place.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from pathlib import Path

from graspatlas.version import __version__

__all__ = ["PINS", "in_the_way", "load", "other_versions"]

#: The distributions whose libraries the core is compiled with, and their versions; as in pyproject.toml.
PINS = {"libpinocchio": "4.1.0", "libcoal": "3.0.3", "eiquadprog": "1.3.2"}

#: Libraries whose file names carry no version, so that another one may be taken for ours.
LIBRARIES = ("libpinocchio_default", "libpinocchio_parsers", "libpinocchio_collision", "libcoal", "libeiquadprog")


def in_the_way(maps: str = "/proc/self/maps") -> list[Path]:
    """Libraries of other installations that this process has loaded, or would find by its environment.

    Args:
        maps: The file that lists what is loaded; where there is none, only the environment is looked at.
    """
    found = [path for path in [*_loaded(maps), *_on_the_path()] if path.name.split(".")[0] in LIBRARIES]
    return [path for path in dict.fromkeys(found) if path.parts[-3:-1] != ("cmeel.prefix", "lib")]


def _loaded(maps: str) -> Iterator[Path]:
    try:
        lines = Path(maps).read_text(errors="replace").splitlines()
    except OSError:
        return
    for line in lines:
        if "/" in line:
            yield Path(line[line.index("/") :])


def _on_the_path() -> Iterator[Path]:
    for folder in os.environ.get("LD_LIBRARY_PATH", "").split(os.pathsep):
        if folder and Path(folder).is_dir():
            yield from sorted(Path(folder).glob("lib*.so*"))


def other_versions() -> dict[str, str]:
    """Versions of the pinned distributions that are installed and not those that the core was compiled with, by name.

    What was not installed by pip, such as the libraries of conda, is not looked at.
    """
    found = {}
    for name, version in PINS.items():
        if any(os.path.isdir(os.path.join(place, f"{name}-{version}.dist-info")) for place in sys.path):
            continue
        from importlib import metadata  # slow to import

        try:
            installed = metadata.version(name)
        except metadata.PackageNotFoundError:
            continue
        if installed != version:
            found[name] = installed
    return found


def _check_versions() -> None:
    others = other_versions()
    if others:
        needed = " ".join(f"{name}=={PINS[name]}" for name in others)
        installed = " and ".join(f"{name} {version}" for name, version in others.items())
        raise ImportError(
            f"graspatlas {__version__} is compiled for {needed.replace('==', ' ')}, but {installed} is installed, "
            f"which its C++ core cannot use: pip install {needed}"
        )


def load() -> None:
    """Load the compiled core, before other libraries of its kind are loaded.

    Raises:
        ImportError: If its libraries are of other versions, or others are in the way: one line that says which.
    """
    _check_versions()
    try:
        import graspatlas._core  # noqa: F401
    except ImportError as error:
        others = in_the_way()
        if not others:
            raise
        names = ", ".join(map(str, others))
        raise ImportError(
            f"graspatlas cannot load its own Pinocchio and coal because of {names}: import graspatlas before what "
            f"loads these, or take their folder from LD_LIBRARY_PATH ({' '.join(str(error).split())})"
        ) from None
