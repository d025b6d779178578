"""The search for feasible grasps where none is known."""

from graspatlas.search.grasp_search import (
    MAX_TRIES,
    GraspSearch,
    find_grasps,
    with_first_grasp,
)

__all__ = [
    "MAX_TRIES",
    "GraspSearch",
    "find_grasps",
    "with_first_grasp",
]
