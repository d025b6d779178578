"""The main job: from a problem to the globally best grasp, in one component or in all."""

from graspatlas.optimizer.optimize import (
    build_atlas,
    optimize,
)

__all__ = [
    "build_atlas",
    "optimize",
]
