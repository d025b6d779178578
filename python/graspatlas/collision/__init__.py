"""Collision shapes of hand, object and obstacles, and their distances."""

from graspatlas.collision.checker import CollisionChecker, Nearest, collision_checker
from graspatlas.collision.problem_shapes import CollisionShapes, collision_shapes
from graspatlas.collision.shapes import Shape

__all__ = ["CollisionChecker", "CollisionShapes", "Nearest", "Shape", "collision_checker", "collision_shapes"]
