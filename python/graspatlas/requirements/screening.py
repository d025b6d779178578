"""Which grasps meet all requirements."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from graspatlas.errors import GraspAtlasError
from graspatlas.grasps.grasps import Grasps
from graspatlas.problem.requirement import REQUIREMENTS
from graspatlas.requirements.base import Requirement, RequirementLike, asked, requirement_name
from graspatlas.support.arrays import BoolArray
from graspatlas.support.validation import checked_instance, shown

__all__ = ["check_requirements", "screen"]


def check_requirements(requirements: Sequence[RequirementLike]) -> None:
    """Make sure that requirements are a list or tuple of named ones and functions.

    Raises:
        GraspAtlasError: If they are not.
    """
    checked_instance(requirements, (list, tuple), "require")
    for requirement in requirements:
        if not isinstance(requirement, Requirement) and not callable(requirement):
            raise GraspAtlasError(
                f"a requirement is one of {', '.join(REQUIREMENTS)} or a function of a grasp, not "
                f"{shown(requirement)}; requirements.parse_requirement reads text"
            )


def screen(requirements: Sequence[RequirementLike], grasps: Grasps) -> tuple[BoolArray, dict[str, int]]:
    """Which grasps meet all requirements, the cheapest checked first and only for the grasps that are left.

    Args:
        requirements: The requirements.
        grasps: The grasps.

    Returns:
        Flags (n,), and how many grasps each requirement rejected.

    Raises:
        GraspAtlasError: If a function raises or returns anything but True and False; see
            :mod:`graspatlas.grasps.callables`.
    """
    check_requirements(requirements)
    left = np.arange(len(grasps))
    rejected: dict[str, int] = {}
    for requirement in sorted(requirements, key=lambda r: r.cost if isinstance(r, Requirement) else 1):
        met = np.zeros(0, bool)
        if len(left):
            met = asked(requirement, Grasps(grasps.problem, grasps.x[left], grasps.system, grasps.charts[left]))
        rejected[requirement_name(requirement)] = int((~met).sum())
        left = left[met]
    flags = np.zeros(len(grasps), bool)
    flags[left] = True
    return flags, rejected
