"""Why requirements reject a grasp, by how much, and which of rejected grasps is the nearest to being accepted.

The *shortfall* of a requirement is what a grasp lacks of it in the measure that climbs follow, of about the size of a
tangent coordinate: of force closure the margin, of the holding force the share of the force, of joints the angle [rad]
or way [m], of collisions the depth, or the distance that is missing, divided by the problem's length scale.

The *nearest* of rejected grasps is the one that the fewest named requirements reject; of those the one whose largest
shortfall is the smallest, one that cannot be measured being larger than all others; of equals the one of the largest
index. Functions of the user's have no shortfall, and are not asked again: they have rejected what the named
requirements accept and the result does not.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from graspatlas.collision.clash import Clash
from graspatlas.grasps.grasps import Grasps
from graspatlas.requirements.base import Requirement, RequirementLike, asked, requirement_name
from graspatlas.requirements.lost import kept
from graspatlas.support.arrays import Array, BoolArray, IndexArray, IntArray

__all__ = ["Rejection", "nearest", "rejections"]


@dataclass(frozen=True, eq=False)
class Rejection:
    """What one requirement has against a grasp.

    Attributes:
        requirement: The requirement as text.
        shortfall: What the grasp lacks of it, see :mod:`graspatlas.requirements.rejections`; NaN of a function,
            infinite where it cannot be measured.
        why: What it lacks in words, such as ``index_distal is 1.3 mm inside can``; nothing of a function.
        clash: The two shapes that collide, of a requirement that is about them.
    """

    requirement: str
    shortfall: float
    why: str = ""
    clash: Clash | None = None

    def __str__(self) -> str:
        return f"{self.requirement}: {self.why}" if self.why else self.requirement


def rejections(requirements: Sequence[RequirementLike], grasp: Grasps) -> tuple[Rejection, ...]:
    """What requirements have against a grasp that they do not accept.

    Args:
        requirements: The requirements.
        grasp: A batch of one grasp, which does not meet them all.
    """
    named = _named(requirements)
    found = [
        Rejection(str(each), float(each.shortfalls(grasp)[0]), each.lack(grasp), each.clash(grasp))
        for each in named
        if not asked(each, grasp)[0]
    ]
    functions = [requirement_name(each) for each in requirements if each not in named]
    return tuple(found) or tuple(Rejection(name, float("nan")) for name in functions)


def nearest(requirements: Sequence[RequirementLike], grasps: Grasps, values: Array) -> int:
    """Which of rejected grasps is the nearest to being accepted, see the top of this module.

    Args:
        requirements: The requirements.
        grasps: The grasps, at least one, of which none meets them all.
        values: The index at each (n,).
    """
    named = _named(requirements)
    rejected = np.array([~asked(each, grasps) for each in named], bool).reshape(len(named), len(grasps))
    counts = rejected.sum(axis=0)
    few = np.flatnonzero(counts == counts.min())
    unmeasured, largest = _shortfalls(named, rejected[:, few], grasps, few)
    return int(few[np.lexsort((-values[few], largest, unmeasured))[0]])


def _shortfalls(
    named: Sequence[Requirement], rejected: BoolArray, grasps: Grasps, chosen: IndexArray
) -> tuple[IntArray, Array]:
    """How many requirements reject each of m grasps unmeasured, and the largest of its other shortfalls."""
    unmeasured, largest = np.zeros(len(chosen), np.int64), np.zeros(len(chosen))
    for requirement, missed in zip(named, rejected, strict=True):
        rows = np.flatnonzero(missed)
        if len(rows):
            by = requirement.shortfalls(Grasps(grasps.problem, grasps.x[chosen[rows]], grasps.system))
            unmeasured[rows] += ~np.isfinite(by)
            largest[rows] = np.maximum(largest[rows], np.where(np.isfinite(by), by, 0.0))
    return unmeasured, largest


def _named(requirements: Sequence[RequirementLike]) -> list[Requirement]:
    return [each for each in kept(tuple(requirements)) if isinstance(each, Requirement)]
