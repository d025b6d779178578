"""Grasps, one or many, and everything a quality index may read of them."""

from graspatlas.grasps.grasps import (
    Grasp,
    Grasps,
)

__all__ = [
    "Grasp",
    "Grasps",
]
