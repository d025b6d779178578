"""How the links of a hand move when it closes: which joints flex, to which side, and where that takes a link.

A finger is the chain of joints from the palm to a link. Its flexors are the joints whose axes are parallel to that of
its last one, or nearly; they close to the side on which its end comes nearer to where the finger begins and to the
other fingers. Where they flex at the same rate, from a little before the middle of their ranges on, the velocity of a
link is the direction in which it closes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from xml.etree import ElementTree

import numpy as np

from graspatlas.hand.hand import Hand
from graspatlas.hand.urdf import SLIDING, TURNING
from graspatlas.support.arrays import Array

__all__ = ["Closing", "Joint"]

#: Axes are parallel, or nearly, where the cosine of their angle is at least this.
PARALLEL = 0.7
#: How far a joint without limits counts as turning to either side [rad].
QUARTER = 0.5 * np.pi
#: Where in their ranges the flexors are about to close round something, 0 being where they start.
FLEXED = 0.4


@dataclass(frozen=True)
class Joint:
    """A joint of the hand that moves.

    Attributes:
        name: Its name.
        number: Its number, which the shapes and frames that it carries name; the palm is 0.
        parent: Number of the joint before it.
        link: The link that it moves.
        axis: Its axis in that link (3,).
        slides: Whether it slides.
    """

    name: str
    number: int
    parent: int
    link: str
    axis: tuple[float, float, float]
    slides: bool


class Closing:
    """The way in which a hand closes.

    Args:
        hand: The hand.
        ends: Where links end, in the frames of the joints that carry them (3,), metres, by the joints' numbers.
    """

    def __init__(self, hand: Hand, ends: Mapping[int, Array]) -> None:
        self.hand, self._ends = hand, dict(ends)
        self.joints = {joint.number: joint for joint in _joints(hand)}
        self._ranges = {name: _range(*pair) for name, pair in hand.limits_by_name.items()}

    @cached_property
    def fingertips(self) -> tuple[int, ...]:
        """Numbers of the joints that move no other."""
        before = {joint.parent for joint in self.joints.values()}
        return tuple(number for number in self.joints if number not in before)

    def chain(self, number: int) -> list[Joint]:
        """The joints from the palm to a joint."""
        chain: list[Joint] = []
        while number in self.joints:
            chain.insert(0, self.joints[number])
            number = self.joints[number].parent
        return chain

    @cached_property
    def middle(self) -> dict[str, float]:
        """Positions of all joints in the middle of their ranges, those that mimic others where these have them."""
        return self._followed({name: 0.5 * (low + high) for name, (low, high) in self._ranges.items()})

    @cache  # noqa: B019  (lives as long as one search for pads)
    def about_to_close(self, number: int) -> dict[str, float]:
        """The middle posture with the flexors of a finger at :data:`FLEXED` of their ranges."""
        return self._followed({**self.middle, **self._flexed(self.rates(number), FLEXED)})

    def posture(self, share: float) -> dict[str, float]:
        """Positions of all joints with the fingers flexed by a share of their ranges, other joints in the middle."""
        flexed: dict[str, float] = {}
        for number in self.fingertips:
            flexed |= self._flexed(self.rates(number), share)
        return self._followed({**self.middle, **flexed})

    def placement(self, number: int, positions: Mapping[str, float]) -> Array:
        """T_palm_joint (4, 4) at a posture."""
        return self._placements(positions)[self.joints[number].link]

    def rates(self, number: int) -> dict[str, float]:
        """How fast the joints of a finger turn or slide where it closes, 1 for each that is driven, by name.

        Args:
            number: The last joint of the finger; nothing turns or slides where it is fixed to the palm.
        """
        if not self.chain(number):
            return {}
        rates = self._one_way(number)
        open_end, closed_end = (self._end(number, rates, side) for side in (-1.0, 1.0))
        return rates if closed_end < open_end else {name: -rate for name, rate in rates.items()}

    def direction(self, number: int, point: Array, *, last: bool = False) -> Array:
        """Unit vector in which a point of a link moves when its finger closes, in the joint's frame (3,).

        Args:
            number: The joint that carries the link.
            point: The point in the joint's frame (3,), metres.
            last: Whether that joint moves alone.
        """
        rates, posture = self.rates(number), self.about_to_close(number)
        T = self.placement(number, posture)
        at = T[:3, :3] @ point + T[:3, 3]
        velocity = np.zeros(3)
        for joint in self.chain(number)[-1:] if last else self.chain(number):
            if rate := rates.get(joint.name, 0.0):
                velocity += rate * self._velocity(joint, at, posture)
        turned = T[:3, :3].T @ velocity
        length = float(np.linalg.norm(turned))
        return turned / length if length > 0.0 else np.zeros(3)

    def _velocity(self, joint: Joint, point: Array, posture: Mapping[str, float]) -> Array:
        """Velocity of a point of the palm's frame (3,) when a joint moves at the unit rate, at a posture."""
        T = self.placement(joint.number, posture)
        axis = T[:3, :3] @ np.array(joint.axis)
        return axis if joint.slides else np.cross(axis, point - T[:3, 3])

    def _one_way(self, number: int) -> dict[str, float]:
        """Rates of the flexors of a finger, all to one side."""
        chain = self.chain(number)
        last = chain[-1]
        along = self._axis(last)
        followers = self.hand.mechanism.followers
        drivers: dict[str, float] = {}
        for joint in chain:
            cosine = float(self._axis(joint) @ along)
            if joint.slides != last.slides or abs(cosine) < PARALLEL:
                continue
            mimic = followers.get(joint.name)
            if mimic is None:
                drivers.setdefault(joint.name, np.sign(cosine))
            elif mimic.multiplier:
                drivers.setdefault(mimic.driver, np.sign(cosine * mimic.multiplier))
        rates = {name: rate for name, rate in drivers.items() if name in {joint.name for joint in chain}}
        for joint in chain:
            mimic = followers.get(joint.name)
            if mimic is not None and mimic.driver in drivers:
                rates[joint.name] = mimic.multiplier * drivers[mimic.driver]
        return rates

    def _axis(self, joint: Joint) -> Array:
        """Axis of a joint at the middle posture, in the palm's frame (3,)."""
        return np.asarray(self.placement(joint.number, self.middle)[:3, :3] @ np.array(joint.axis))

    def _end(self, number: int, rates: Mapping[str, float], side: float) -> float:
        """Distance of a finger's end from its beginning and from the other fingers, with its flexors at one end [m]."""
        flexed = self._flexed(rates, 0.5 * (1.0 + side))
        placements = self._placements(self._followed({**self.middle, **flexed}))
        rest = self._placements(self.middle)
        chain = self.chain(number)
        end = _at(placements[chain[-1].link], self._reach(number))
        others = [_at(rest[self.joints[n].link], self._reach(n)) for n in self.fingertips if n != number]
        goals = [placements[chain[0].link][:3, 3], *([np.mean(others, axis=0)] if others else [])]
        return float(sum(np.linalg.norm(end - goal) for goal in goals))

    def _flexed(self, rates: Mapping[str, float], share: float) -> dict[str, float]:
        """Positions of what drives joints that move at some rates, at a share of their ranges, 0 where they start."""
        followers, positions = self.hand.mechanism.followers, {}
        for name, rate in rates.items():
            mimic = followers.get(name)
            driver, towards = (name, rate) if mimic is None else (mimic.driver, rate * mimic.multiplier)
            low, high = self._ranges[driver]
            positions[driver] = low + (share if towards > 0.0 else 1.0 - share) * (high - low)
        return positions

    def _reach(self, number: int) -> Array:
        """Where a joint's link ends, in the joint's frame (3,), metres."""
        return self._ends.get(number, np.zeros(3))

    def _placements(self, positions: Mapping[str, float]) -> dict[str, Array]:
        return self.hand.link_placements(self.hand.configuration(positions))

    def _followed(self, positions: Mapping[str, float]) -> dict[str, float]:
        followers = self.hand.mechanism.followers
        return {
            name: followers[name].position(positions[followers[name].driver]) if name in followers else position
            for name, position in positions.items()
        }


def _at(T: Array, point: Array) -> Array:
    return np.asarray(T[:3, :3] @ point + T[:3, 3])


def _range(low: float, high: float) -> tuple[float, float]:
    """Where a joint can be, or where that has no ends, to both sides of 0."""
    low, high = (low if np.isfinite(low) else -QUARTER), (high if np.isfinite(high) else QUARTER)
    return low, high


def _joints(hand: Hand) -> Sequence[Joint]:
    """The moving joints of a hand."""
    root = ElementTree.fromstring(hand.tree)
    found = []
    for element in root.findall("joint"):
        kind = str(element.get("type"))
        parent, child = element.find("parent"), element.find("child")
        if kind not in TURNING + SLIDING or parent is None or child is None:
            continue
        link, axis = str(child.get("link")), element.find("axis")
        direction = np.array(
            [float(word) for word in (axis.get("xyz", "1 0 0") if axis is not None else "1 0 0").split()]
        )
        direction /= np.linalg.norm(direction)
        number, before = hand.frame(link)[0], hand.frame(str(parent.get("link")))[0]
        x, y, z = map(float, direction)
        found.append(Joint(str(element.get("name")), number, before, link, (x, y, z), kind in SLIDING))
    return found
