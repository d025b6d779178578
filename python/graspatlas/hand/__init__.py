"""The robotic hand: its URDF, its mechanism, its hand motions; and rigid bodies."""

from graspatlas.hand.hand import (
    Body,
    Hand,
    robots_folder,
)

__all__ = [
    "Body",
    "Hand",
    "robots_folder",
]
