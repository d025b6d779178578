"""Loads the compiled core, and says what is in the way when libraries of another installation take its own's place."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

__all__ = ["in_the_way"]

#: Libraries whose file names carry no version, so that another one may be taken for ours.
LIBRARIES = ("libpinocchio_default", "libpinocchio_parsers", "libpinocchio_collision", "libcoal")


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


def _load() -> None:
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


_load()
