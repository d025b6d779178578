"""What stands round a hand and an object: poses, obstacles, arms."""

from graspatlas.world.arm import Arm
from graspatlas.world.obstacle import Obstacle
from graspatlas.world.pose import Pose

__all__ = ["Arm", "Obstacle", "Pose"]
