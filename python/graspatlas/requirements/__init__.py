"""What an accepted grasp must meet: force closure, no collision, distance from joint limits, reach."""

from graspatlas.problem.requirement import REQUIREMENTS, parse_requirement, requirement_from_dict
from graspatlas.requirements.base import Requirement, RequirementLike, requirement_name
from graspatlas.requirements.collision_free import CollisionFree
from graspatlas.requirements.force_closure import ForceClosure
from graspatlas.requirements.holding_force import HoldingForce
from graspatlas.requirements.joint_margin import JointMargin
from graspatlas.requirements.reachable import Reachable
from graspatlas.requirements.screening import check_requirements, screen

#: The earlier name of :data:`RequirementLike`.
Require = RequirementLike

__all__ = [
    "REQUIREMENTS",
    "CollisionFree",
    "ForceClosure",
    "HoldingForce",
    "JointMargin",
    "Reachable",
    "Require",
    "Requirement",
    "RequirementLike",
    "check_requirements",
    "parse_requirement",
    "requirement_from_dict",
    "requirement_name",
    "screen",
]
