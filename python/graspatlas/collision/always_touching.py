"""Links of a hand that touch one another in whatever posture: an SRDF for hands that come without one.

Collision shapes of neighbouring links overlap, and where a joint has two or three axes in one place those of links
farther apart do too. Collisions between them tell nothing of a grasp.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations
from xml.sax.saxutils import quoteattr

import numpy as np

from graspatlas.collision.checker import OBJECT, CollisionChecker
from graspatlas.hand.body import Body
from graspatlas.hand.hand import Hand
from graspatlas.patches.flat import Plane, Point
from graspatlas.problem.contacts import Contact
from graspatlas.problem.problem import Problem
from graspatlas.support.arrays import Array

__all__ = ["with_touching_links_allowed"]

#: Postures that are drawn, and the share of them in which links touch that always do.
POSTURES, ALWAYS = 300, 0.95
#: The first of them tell most pairs apart: those that touch in less than a half of them do not always touch.
FIRST, HALF = 30, 0.5
#: How far away the object is put that a collision checker needs [m].
FAR = 100.0
#: How far a joint without limits is turned to either side [rad].
HALF_TURN = np.pi


def with_touching_links_allowed(hand: Hand) -> tuple[Hand, tuple[tuple[str, str], ...]]:
    """The hand with an SRDF that lets links touch that do in nearly all postures; a hand that has an SRDF as it is.

    Args:
        hand: The hand; it needs collision shapes.

    Returns:
        The hand, and those pairs of its links that are not neighbours.

    Raises:
        GraspAtlasError: If the hand has no collision shape, or a mesh cannot be read.
    """
    if hand.srdf:
        return hand, ()
    plane, body = Plane(origin=(0.0, 0.0, 0.0), normal=(0.0, 0.0, 1.0)), Body.sphere("far", 0.001)
    point = Point(position=(0.0, 0.0, 0.0), normal=(0.0, 0.0, 1.0))
    problem = Problem("collisions", hand, body, (Contact(hand.frames[-1], point, plane),))
    checker = CollisionChecker(problem)
    chosen = [i for i, pair in enumerate(checker.pairs) if not any(name.startswith(OBJECT) for name in pair)]
    if not chosen:
        return hand, ()
    q = _postures(hand)
    pose = np.array(problem.object_joint_model.neutral)
    pose[0] = FAR
    X = np.hstack([q, np.broadcast_to(pose, (len(q), len(pose)))])
    often = (checker.clearances(X[:FIRST], chosen) < 0.0).mean(axis=0) >= HALF
    chosen = [pair for pair, touches in zip(chosen, often, strict=True) if touches]
    touching = (checker.clearances(X, chosen) < 0.0).mean(axis=0)
    links = {shape.name: shape.link for shape in checker.shapes}
    always = {
        tuple(sorted((links[a], links[b])))
        for (a, b), share in zip((checker.pairs[i] for i in chosen), touching, strict=True)
        if share >= ALWAYS
    }
    if not always:
        return hand, ()
    neighbours = {
        tuple(sorted((a.link, b.link)))
        for a, b in combinations([s for s in checker.shapes if not s.name.startswith(OBJECT)], 2)
        if a.parent_joint == b.joint or b.parent_joint == a.joint
    }
    lines = [
        f"  <disable_collisions link1={quoteattr(a)} link2={quoteattr(b)}/>" for a, b in sorted(always | neighbours)
    ]
    srdf = f"<robot name={quoteattr(hand.name)}>\n" + "\n".join(lines) + "\n</robot>\n"
    return replace(hand, srdf=srdf), tuple(sorted((str(a), str(b)) for a, b in always))


def _postures(hand: Hand) -> Array:
    """Postures drawn evenly within the limits (n, nq)."""
    rng = np.random.default_rng(0)
    mechanism, ranges = hand.mechanism, hand.mechanism.ranges(hand.limits_by_name)
    ends = np.array([ranges[name] for name in mechanism.actuated])
    lower, upper = np.where(np.isfinite(ends), ends, np.sign(ends) * HALF_TURN).T
    drawn = rng.uniform(lower, upper, (POSTURES, len(lower)))
    return np.array(
        [
            hand.configuration(mechanism.completed(dict(zip(mechanism.actuated, row, strict=True)), "a posture"))
            for row in drawn
        ]
    )
