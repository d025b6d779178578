"""The requirements by their names: those of the package enter themselves when they are imported, which is done here."""

from __future__ import annotations

import graspatlas.requirements.collision_free
import graspatlas.requirements.force_closure
import graspatlas.requirements.holding_force
import graspatlas.requirements.joint_margin
import graspatlas.requirements.reachable  # noqa: F401
from graspatlas.problem.requirement import REQUIREMENTS, parse_requirement, requirement_from_dict

__all__ = ["REQUIREMENTS", "parse_requirement", "requirement_from_dict"]
