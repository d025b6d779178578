"""Postures of an arm that bring the hand to its grasps."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from graspatlas import _core
from graspatlas.errors import GraspAtlasError
from graspatlas.reach.carried_hand import ArmScene, CarriedHand
from graspatlas.support.arrays import Array, BoolArray
from graspatlas.support.pickling import Light
from graspatlas.support.progress import progress_bar
from graspatlas.support.validation import read_only
from graspatlas.support.words import Word

if TYPE_CHECKING:
    from graspatlas.problem.problem import Problem
    from graspatlas.world.arm import Arm

__all__ = ["ArmReach", "Reach", "ReachStatus", "arm_reach"]

#: Grasps are looked at in batches of this size, on all cores.
BATCH = 1024
#: Starts of the inverse kinematics for each grasp, and the random postures from which they are taken: those with the
#: flange nearest to where it has to be.
SEEDS, POSTURES = 24, 2048


class ReachStatus(Word):
    """What the search for a posture of the arm found."""

    FOUND = "found"
    NO_POSTURE = "no posture found"
    HITS = "each posture found hits something"


#: By the numbers of the core.
STATUSES = (ReachStatus.FOUND, ReachStatus.NO_POSTURE, ReachStatus.HITS)


@dataclass(frozen=True, eq=False)
class Reach(Light):
    """Where an arm can bring the hand, for n grasps.

    Attributes:
        arm: The arm.
        q: Configurations of the robot (n, nq), in the order of its joints; NaN where no posture was found.
        statuses: What was found for each grasp (n,).
        hits: Where each posture found hits something, the two shapes that the first of them brings too near; else None
            (n,).
    """

    arm: Arm
    q: Array
    statuses: tuple[ReachStatus, ...]
    hits: tuple[tuple[str, str] | None, ...]

    def __repr__(self) -> str:
        return f"<Reach of {self.arm.name!r}: {int(self.found.sum())} of {len(self.statuses)} grasps>"

    @cached_property
    def found(self) -> BoolArray:
        """Whether a posture of the arm was found (n,). False is no proof that there is none."""
        return read_only(np.array([status is ReachStatus.FOUND for status in self.statuses], bool))

    @cached_property
    def positions(self) -> dict[str, Array]:
        """Position of each joint that moves the flange, by name, (n,) each [rad or m]; NaN where none was found."""
        columns = self.arm.robot.joint_columns(self.q)
        return {name: columns[name] for name in self.arm.joints}


class ArmReach:
    """Finds postures of a problem's arm that bring the hand to grasps, within joint limits and without collision.

    Inverse kinematics starts from random postures, those with the flange nearest to where it has to be, and the first
    posture found that hits nothing counts. What is found for a grasp is a function of the grasp alone. Where nothing is
    found that is no proof that there is nothing.

    Collisions are those of the arm with itself, the hand, the object and the obstacles; see
    :class:`graspatlas.reach.carried_hand.ArmScene`. The way to the posture is not looked at.

    Args:
        problem: The problem, with an arm; all things need collision shapes.
        clearance: Distance that the arm's links must keep from the hand, the object and obstacles [m].

    Attributes:
        scene: The shapes, and the pairs that are looked at.
        both: Arm and hand as one mechanism.
        collisions: The compiled checker of the pairs, for configurations of both.

    Raises:
        GraspAtlasError: If the problem has no arm, or a thing no collision shape.
    """

    def __init__(self, problem: Problem, clearance: float = 0.0) -> None:
        if problem.arm is None:
            raise GraspAtlasError(f"problem '{problem.name}' has no arm; state one: see graspatlas.Arm")
        self._arm = arm = problem.arm
        self.both = both = CarriedHand.of(arm, problem.hand)
        self.scene = ArmScene.of(problem, both)
        shapes = [shape.as_tuple() for shape in self.scene.shapes]
        required = self.scene.required(clearance)
        self.collisions = _core.CollisionBatch(both.model, shapes, self.scene.pairs, required)
        (joint, T_joint_flange), (lower, upper) = arm.robot.frame(arm.flange), arm.robot.joint_limits
        self._batch = _core.ReachBatch(
            arm.robot.model,
            joint,
            T_joint_flange,
            list(lower),
            list(upper),
            self.collisions,
            both.arm_at,
            both.hand_at,
            SEEDS,
            POSTURES,
        )

    def look(self, q: ArrayLike, T_palm_object: ArrayLike) -> Reach:
        """Look for postures of the arm.

        Args:
            q: Joint configurations of the hand (n, nq).
            T_palm_object: Poses of the object in the palm's frame (n, 4, 4).
        """
        hand = np.ascontiguousarray(np.atleast_2d(np.asarray(q, float)))
        targets = self.flange_targets(T_palm_object)
        found = []
        with progress_bar("arm", "grasps", len(hand)) as bar:
            for start in range(0, max(len(hand), 1), BATCH):
                found.append(self._batch.solve(targets[start : start + BATCH], hand[start : start + BATCH]))
                bar.update(len(found[-1]["statuses"]))
        names = self.scene.names
        return Reach(
            self._arm,
            read_only(np.concatenate([part["q"] for part in found])),
            tuple(STATUSES[number] for part in found for number in part["statuses"]),
            tuple(names[pair] if pair >= 0 else None for part in found for pair in part["pairs"]),
        )

    def flange_targets(self, T_palm_object: ArrayLike) -> Array:
        """Where the flange has to be in the base's frame (n, 4, 4), for poses of the object in the palm's frame."""
        T_object_palm = np.linalg.inv(np.asarray(T_palm_object, float).reshape(-1, 4, 4))
        return np.asarray(self._arm.T_base_object @ T_object_palm @ np.linalg.inv(self._arm.T_flange_palm))


@lru_cache(maxsize=8)
def arm_reach(problem: Problem, clearance: float = 0.0) -> ArmReach:
    """The search of a problem's arm, of the last ones kept: reading the shapes takes longer than many grasps.

    Args and errors are those of :class:`ArmReach`.
    """
    return ArmReach(problem, clearance)
