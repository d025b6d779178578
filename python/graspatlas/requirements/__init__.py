"""What an accepted grasp must meet: force closure, no collision, distance from joint limits."""

from graspatlas.requirements.screening import (
    REQUIREMENTS,
    CollisionFree,
    ForceClosure,
    JointMargin,
    Require,
    Requirement,
    check_requirements,
    parse_requirement,
    requirement_from_dict,
    requirement_name,
    screen,
)

__all__ = [
    "REQUIREMENTS",
    "CollisionFree",
    "ForceClosure",
    "JointMargin",
    "Require",
    "Requirement",
    "check_requirements",
    "parse_requirement",
    "requirement_from_dict",
    "requirement_name",
    "screen",
]
