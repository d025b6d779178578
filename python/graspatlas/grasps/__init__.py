"""Grasps, one or many, and everything a quality index may read of them."""

from graspatlas.grasps.grasp import Grasp
from graspatlas.grasps.grasps import Grasps

__all__ = ["Grasp", "Grasps"]
