"""The posture of a hand just before it grasps: nothing touches, and all contact points are equally far off."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from graspatlas.errors import GraspAtlasError
from graspatlas.execution.actuation import Actuation
from graspatlas.execution.walk import Obstacle, Walk, is_there, walk_outwards
from graspatlas.execution.withdrawal import Withdrawal
from graspatlas.problem.problem import Problem
from graspatlas.support.arrays import Array
from graspatlas.support.progress import progress_bar
from graspatlas.support.validation import positive, read_only

__all__ = ["DISTANCE", "Pregrasp", "pregrasps"]

#: How far the contact points are off the object by default [m], and at most.
DISTANCE, LARGEST_DISTANCE = 0.01, 0.1
#: Depth to which a touching link may sink into the object on the way, as of CollisionFree [m].
TOUCH_DEPTH = 0.002
#: A joint this near its limit stands at it [rad or m].
AT_LIMIT = 1e-6
#: Grasps are withdrawn in batches of this size.
BATCH = 64


@dataclass(frozen=True, eq=False)
class Pregrasp:
    """The posture of a hand before a grasp, the object being where the grasp holds it; m contacts, h joints.

    Attributes:
        x: The grasp, with the hand in this posture [configuration_size]. The contact equations do not hold there.
        q: Joint configuration of the hand [nq].
        joint_positions: Position of each joint by name [rad or m]; of a continuous joint the angle in [-pi, pi].
        asked: How far the contact points were to be off the object [m].
        distances: How far they are: each contact point of the hand, which stays where it is in its link, along the
            object's outward normal at the contact [m], metres.
        reached: Whether all are at least as far off as asked, to 0.1 mm and a twentieth of it. If not, this is the
            farthest that the hand can get with all contact points equally far off.
        reason: Why not: the joint that stands at its limit, or what would collide; empty when reached.
        path: The grasp with the hand in each posture on the way out, from the grasp to this one
            [k, configuration_size].
        path_distances: How far the contact points are off there [k, m], metres.
        problem: The problem.
    """

    x: Array
    q: Array
    joint_positions: Mapping[str, float]
    asked: float
    distances: Array
    reached: bool
    reason: str
    path: Array
    path_distances: Array
    problem: Problem

    def __repr__(self) -> str:
        reached = f"{self.asked * 1e3:g} mm" if self.reached else self.reason
        return f"<Pregrasp of {self.problem.name!r}: {reached}>"

    __str__ = __repr__


def pregrasps(
    problem: Problem,
    X: Array,
    distance: float = DISTANCE,
    *,
    touch_depth: float = TOUCH_DEPTH,
    clearance: float = 0.0,
    progress: bool | None = None,
) -> list[Pregrasp]:
    """Postures of the hand before some grasps; see :meth:`graspatlas.Grasp.pregrasp`.

    Args:
        problem: The problem.
        X: The grasps [n, configuration_size].
        distance: See :meth:`graspatlas.Grasp.pregrasp`.
        touch_depth: See there.
        clearance: See there.
        progress: Show a progress bar; by default when standard error is a terminal.

    Raises:
        GraspAtlasError: If a number makes no sense, or hand or object has no collision shape.
    """
    for value, name in ((touch_depth, "touch_depth"), (clearance, "clearance")):
        if value != 0.0:
            positive(value, name, LARGEST_DISTANCE)
    asked = _Asked(checked_distance(distance), float(clearance))
    found: list[Pregrasp] = []
    with progress_bar("pregrasps", "grasps", len(X), progress) as bar:
        for start in range(0, len(X), BATCH):
            part = X[start : start + BATCH]
            withdrawal, walks = walk_outwards(problem, part, asked.distance, touch_depth, clearance)
            found += [_pregrasp(withdrawal, i, walk, asked) for i, walk in enumerate(walks)]
            bar.update(len(part))
    return found


def checked_distance(distance: float) -> float:
    """The distance of a pregrasp [m].

    Raises:
        GraspAtlasError: If it is no number above 0 and at most LARGEST_DISTANCE.
    """
    try:
        return positive(distance, "the distance of a pregrasp", LARGEST_DISTANCE)
    except GraspAtlasError as error:
        raise GraspAtlasError(f"{error}; it is in metres, {DISTANCE:g} by default") from None


@dataclass(frozen=True)
class _Asked:
    """How far off the contact points are to be, and what all other shapes must keep [m]."""

    distance: float
    clearance: float

    @property
    def collide(self) -> str:
        """What two shapes do that are too near."""
        return f"come nearer than {self.clearance:g} m" if self.clearance else "collide"


def _pregrasp(withdrawal: Withdrawal, row: int, walk: Walk, asked: _Asked) -> Pregrasp:
    hand, x, distances = withdrawal.problem.hand, walk.X[-1], walk.distances[-1]
    q = x[: hand.model.hand_q_size]
    reached = bool(is_there(distances[None], asked.distance)[0])
    return Pregrasp(
        x=read_only(x),
        q=read_only(q),
        joint_positions=hand.joint_positions(q),
        asked=asked.distance,
        distances=read_only(distances),
        reached=reached,
        reason="" if reached or walk.obstacle is None else _reason(withdrawal, row, walk.obstacle, distances, asked),
        path=read_only(walk.X),
        path_distances=read_only(walk.distances),
        problem=withdrawal.problem,
    )


def _reason(withdrawal: Withdrawal, row: int, obstacle: Obstacle, distances: Array, asked: _Asked) -> str:
    """In plain words how far the hand gets, and what ends it."""
    farther = f"the hand gets {max(float(distances.min()), 0.0) * 1e3:.1f} mm away"
    if obstacle.pair is not None:
        shapes = f"'{obstacle.pair[0]}' and '{obstacle.pair[1]}' {asked.collide}"
        if obstacle.target == 0.0:
            return f"{shapes} at the grasp already, and so small an opening does not part them"
        return f"{farther}: then {shapes}"
    contact = int(np.argmin(obstacle.distances))
    where = f"contact {contact} ('{withdrawal.problem.contacts[contact].frame}')"
    pressed = withdrawal.pressed(obstacle.z, obstacle.target, row)
    if pressed.max(initial=0.0) == 0.0:
        return f"{farther}: no joint moves {where} farther along the object's normal without the other contacts"
    driver = withdrawal.actuation.names[int(pressed.argmax())]
    return f"{farther}: {_limit(withdrawal.actuation, driver, obstacle.z)}, and {where} gets no farther"


def _limit(actuation: Actuation, driver: str, z: Array) -> str:
    """The limit at which an actuated joint stands, or a joint that mimics it."""
    hand = actuation.hand
    positions = dict(zip(hand.joints, actuation.full(z[None])[0], strict=True))
    for joint, (lower, upper) in hand.mechanism.binding_limits(hand.limits_by_name).items():
        mimic = hand.mechanism.followers.get(joint)
        if driver not in (joint, mimic.driver if mimic else joint):
            continue
        for limit, side in ((lower, "lower"), (upper, "upper")):
            if abs(positions[joint] - limit) < AT_LIMIT:
                return f"joint '{joint}' is at its {side} limit, {limit:.4g}"
    return f"joint '{driver}' is at its limit"
