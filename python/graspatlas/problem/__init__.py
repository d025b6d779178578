"""What the user states: hand, object, contacts, first grasp, requirements."""

from graspatlas.problem.problem import (
    Problem,
)

__all__ = [
    "Problem",
]
