"""Paths from grasp to grasp that keep all contacts."""

from graspatlas.paths.path import (
    GraspPath,
    Path,
)

__all__ = [
    "GraspPath",
    "Path",
]
