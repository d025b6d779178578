"""What stands round a hand and an object: poses, obstacles."""

from graspatlas.world.obstacle import Obstacle
from graspatlas.world.pose import Pose

__all__ = ["Obstacle", "Pose"]
