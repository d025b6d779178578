"""The robotic hand: its URDF, its mechanism, its hand motions; and rigid bodies."""

from graspatlas.hand.body import Body
from graspatlas.hand.hand import Hand
from graspatlas.hand.robot_files import robots_folder

__all__ = ["Body", "Hand", "robots_folder"]
