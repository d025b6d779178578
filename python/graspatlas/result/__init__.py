"""What the user gets: the atlas with its indices, the best grasp, its files and its verification."""

from graspatlas.result.result import (
    Result,
    load_result,
)

__all__ = [
    "Result",
    "load_result",
]
