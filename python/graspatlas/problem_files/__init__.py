"""Problem files: grasp problems in YAML, their schema, and errors that name file, line and field."""

from graspatlas.problem_files.faults import ProblemFileError
from graspatlas.problem_files.reading import read_problem
from graspatlas.problem_files.schema import json_schema

__all__ = ["ProblemFileError", "json_schema", "read_problem"]
