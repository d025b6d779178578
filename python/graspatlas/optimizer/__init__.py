"""The main job: from a problem to the globally best grasp, in one component or in all."""

from graspatlas.atlas.build import build_atlas
from graspatlas.optimizer.optimize import optimize

__all__ = ["build_atlas", "optimize"]
