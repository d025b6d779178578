"""The bundled problems, and problem files of your own: JSON tables like those of `graspatlas.Problem.to_dict`."""

from __future__ import annotations

import json
from importlib import resources
from pathlib import Path

from graspatlas.errors import GraspAtlasError, unknown_name
from graspatlas.problem import Problem

__all__ = ["bundled_problems", "load_problem"]


def bundled_problems() -> list[str]:
    """Names of the problems that come with the package."""
    folder = resources.files("graspatlas.problems")
    return sorted(entry.name[:-5] for entry in folder.iterdir() if entry.name.endswith(".json"))


def load_problem(name: str | Path) -> Problem:
    """Load a problem by its bundled name, or from a problem file (JSON).

    Args:
        name: Such as ``"schunk_can"``, or a path that ends in ``.json``.

    Raises:
        GraspAtlasError: If there is no such problem, or its file is damaged or wrong.
    """
    folder: Path | None = None
    if str(name) in bundled_problems():
        text = (resources.files("graspatlas.problems") / f"{name}.json").read_text(encoding="utf-8")
    else:
        path = Path(name)
        if path.suffix != ".json" and not path.is_file():
            raise unknown_name("problem", name, bundled_problems())
        try:
            text = path.read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError) as error:
            reason = getattr(error, "strerror", None) or error
            raise GraspAtlasError(f"cannot read problem file '{path}': {reason}; correct the path") from None
        folder = path.parent
    try:
        data = json.loads(text)
    except json.JSONDecodeError as error:
        raise GraspAtlasError(f"problem file '{name}' is not JSON: {error}") from None
    try:
        return Problem.from_dict(data, folder)
    except GraspAtlasError as error:
        raise GraspAtlasError(f"problem file '{name}': {error}") from None
