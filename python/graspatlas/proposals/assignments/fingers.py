"""The hand of an assignment: some fingertips touch, the fingers of others are held open, and the wrist stays."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np

from graspatlas import _core
from graspatlas.errors import GraspAtlasError
from graspatlas.hand.hand import Hand
from graspatlas.pads.closing import Closing
from graspatlas.pads.find import find_pads
from graspatlas.pads.pad import Pad
from graspatlas.patches.base import Patch
from graspatlas.patches.flat import Plane, Point
from graspatlas.problem.assembly import grasp_system
from graspatlas.problem.contacts import Contact
from graspatlas.problem.object_joint import object_joint
from graspatlas.support.arrays import Array

__all__ = ["Fingers", "Grip", "grips"]

#: Open fingers stay this share of a joint's range off its end.
OFF_END = 0.1
#: How far a joint without limits is moved to either side [rad].
QUARTER = 0.5 * np.pi


@dataclass(frozen=True)
class Grip:
    """The fingertips that touch.

    Attributes:
        pads: Their pads.
        locked: Positions of the joints that do not move them [rad or m].
    """

    pads: tuple[Pad, ...]
    locked: Mapping[str, float]

    @property
    def name(self) -> str:
        """The links that touch."""
        return "+".join(pad.frame for pad in self.pads)


@dataclass(frozen=True, eq=False)
class Fingers:
    """A grip on a hand, and where its pads can be.

    Attributes:
        hand: The hand with all joints locked that do not move the pads.
        grip: The grip.
    """

    hand: Hand
    grip: Grip

    @cached_property
    def system(self) -> _core.GraspSystem:
        """Contacts of the pads with nothing in particular: what computes where they are."""
        floor = Plane(origin=(0.0, 0.0, 0.0), normal=(0.0, 0.0, 1.0))
        contacts = [Contact(pad.frame, touched(self.hand, pad), floor) for pad in self.grip.pads]
        return grasp_system(self.hand, contacts, object_joint("free_flyer"), self.hand.mechanism.transmission, 0.01)

    def postures(self, count: int, rng: np.random.Generator) -> Array:
        """Joint configurations, drawn evenly within the limits (count, nq)."""
        mechanism, ranges = self.hand.mechanism, self.hand.mechanism.ranges(self.hand.limits_by_name)
        lower, upper = np.array([_finite(*ranges[name]) for name in mechanism.actuated]).T
        positions = rng.uniform(lower, upper, (count, len(lower))) @ mechanism.transmission.T + mechanism.b
        q = np.zeros((count, self.hand.model.hand_q_size))
        for column, joint in zip(positions.T, self.hand.model.hand_joints, strict=True):
            if joint.q_size == 1:
                q[:, joint.q_index] = column
            else:
                q[:, joint.q_index], q[:, joint.q_index + 1] = np.cos(column), np.sin(column)
        return q

    def pads_at(self, q: Array) -> tuple[Array, Array]:
        """Points (n, m, 3) and outward normals (n, m, 3) of the pads at postures (n, nq), in the palm's frame."""
        rest = np.r_[object_joint("free_flyer").neutral, np.zeros(self.system.n_parameters)]
        arrays = self.system.grasp_arrays(np.hstack([q, np.broadcast_to(rest, (len(q), len(rest)))]))
        return arrays["hand_points"], arrays["hand_normals"]


def touched(hand: Hand, pad: Pad) -> Patch:
    """What of a pad touches: the middle, which a finger moves to where it is needed; but anywhere on a palm."""
    of_palm = hand.frame(pad.frame)[0] == 0
    return pad.patch if of_palm else Point(position=pad.position, normal=pad.normal)


def grips(hand: Hand, count: int | None = None, links: Sequence[str] | None = None) -> list[Fingers]:
    """All sets of so many fingertips of a hand.

    Args:
        hand: The hand.
        count: How many touch; three by default, or all where there are fewer.
        links: The links that may touch; the fingertips by default.

    Raises:
        GraspAtlasError: If the hand has too few, or no pad can be found.
    """
    pads = find_pads(hand, links)
    wanted = min(3, len(pads)) if count is None else count
    if wanted < 2:
        raise GraspAtlasError(
            f"a grasp takes two fingertips at least; hand '{hand.name}' has {len(pads)} with a pad, and {wanted} would "
            "touch: name more links, or ask for more fingers"
        )
    if wanted > len(pads):
        raise GraspAtlasError(
            f"{wanted} fingertips of hand '{hand.name}' cannot touch: it has {len(pads)} with a pad; name more "
            "links, or ask for fewer fingers"
        )
    closing = Closing(hand, {})
    chains = [{joint.name for joint in closing.chain(hand.frame(pad.frame)[0])} for pad in pads]
    before_all = set.intersection(*chains)
    found = []
    for chosen in combinations(range(len(pads)), wanted):
        moving = set.union(*(chains[i] for i in chosen)) - before_all
        if not moving:
            continue
        locked = _rest(hand, closing, [i for i in range(len(pads)) if i not in chosen], pads, moving)
        grip = Grip(tuple(pads[i] for i in chosen), locked)
        found.append(Fingers(hand.with_joints(locked=locked) if locked else hand, grip))
    return found


def _rest(
    hand: Hand, closing: Closing, others: Sequence[int], pads: Sequence[Pad], moving: set[str]
) -> dict[str, float]:
    """Where the joints are that do not move: those of other fingers open, all else as near to 0 as they can."""
    ranges = {name: _finite(*pair) for name, pair in hand.limits_by_name.items()}
    followers = hand.mechanism.followers
    driven = {followers[name].driver for name in moving if name in followers}
    still = [name for name in hand.joints if name not in moving | driven and name not in followers]
    positions = {name: float(np.clip(0.0, *ranges[name])) for name in still}
    for i in others:
        for name, rate in closing.rates(hand.frame(pads[i].frame)[0]).items():
            if name in positions and rate:
                low, high = ranges[name]
                off = OFF_END * (high - low)
                positions[name] = low + off if rate > 0.0 else high - off
    return positions


def _finite(low: float, high: float) -> tuple[float, float]:
    """A range, with ends where it has none."""
    return (low if np.isfinite(low) else -QUARTER), (high if np.isfinite(high) else QUARTER)
