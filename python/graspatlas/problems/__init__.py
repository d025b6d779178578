"""The bundled problems, and problem files of your own."""

from __future__ import annotations

from importlib import resources
from pathlib import Path

from graspatlas.errors import GraspAtlasError, unknown_name
from graspatlas.hand.robot_files import robots_folder
from graspatlas.problem.problem import Problem
from graspatlas.storage.files import is_file, read_text
from graspatlas.world.obstacle import Obstacle

__all__ = ["bundled_problems", "load_obstacles", "load_problem", "problem_text"]

#: Endings of problem files; JSON is a part of YAML.
ENDINGS = (".yaml", ".yml", ".json")


def bundled_problems() -> list[str]:
    """Names of the problems that come with the package."""
    folder = resources.files("graspatlas.problems")
    return sorted(entry.name[:-5] for entry in folder.iterdir() if entry.name.endswith(".yaml"))


def load_problem(name: str | Path) -> Problem:
    """Load a problem by its bundled name, or from a problem file.

    Args:
        name: Such as ``"schunk_can"``, or the path of a YAML or JSON file; see ``docs/problem_files.md``.

    Raises:
        GraspAtlasError: If there is no such problem, or its file is wrong: the message names line and field.
    """
    from graspatlas.problem_files import read_problem  # slow to import

    return read_problem(*problem_text(name))


def load_obstacles(path: str | Path) -> tuple[Obstacle, ...]:
    """Load the obstacles of a file that states them as a problem file does; whatever else it states is passed over.

    Args:
        path: A YAML or JSON file with ``obstacles:``.

    Raises:
        GraspAtlasError: If there is no such file, or it is wrong: the message names line and field.
    """
    from graspatlas.problem_files import read_obstacles  # slow to import

    file = Path(path)
    return read_obstacles(_text(file, "file of obstacles"), str(path), file.parent)


def problem_text(name: str | Path) -> tuple[str, str, Path]:
    """Text of a problem file, its name, and the folder where its relative paths start.

    Args:
        name: A bundled name or a path.

    Raises:
        GraspAtlasError: If there is no such problem, or its file cannot be read.
    """
    if str(name) in bundled_problems():
        text = (resources.files("graspatlas.problems") / f"{name}.yaml").read_text(encoding="utf-8")
        return text, f"{name}.yaml", robots_folder()
    path = Path(name)
    if path.suffix not in ENDINGS and not is_file(path):
        raise unknown_name("problem", name, bundled_problems())
    return _text(path, "problem file"), str(name), path.parent


def _text(path: Path, what: str) -> str:
    try:
        return read_text(path)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise GraspAtlasError(f"cannot read {what} '{path}': {reason}; correct the path") from None
