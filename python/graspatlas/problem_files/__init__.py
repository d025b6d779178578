"""Problem files: grasp problems in YAML, their schema, and errors that name file, line and field."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from graspatlas.problem_files.faults import ProblemFileError
    from graspatlas.problem_files.reading import read_obstacles, read_problem
    from graspatlas.problem_files.schema import json_schema

__all__ = ["ProblemFileError", "json_schema", "read_obstacles", "read_problem"]

#: Where names are defined; the schema takes longer to import than a list of problems to read.
_HOMES = {"ProblemFileError": "faults", "read_obstacles": "reading", "read_problem": "reading", "json_schema": "schema"}


def __getattr__(name: str) -> Any:
    """A public name, imported on first use."""
    if name not in _HOMES:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    return getattr(importlib.import_module(f"{__name__}.{_HOMES[name]}"), name)
