"""Joints that mimic others: q_joint = multiplier q_driver + offset, as the ``<mimic>`` tags of a URDF say.

Such joints are coupled by the mechanism, so these equations hold on all feasible grasps F, and no choice of hand
motions frees them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from xml.etree import ElementTree

import numpy as np
from numpy.typing import ArrayLike

from graspatlas.errors import GraspAtlasError, unknown_name
from graspatlas.hand.motions import HandMotions
from graspatlas.support.arrays import Array
from graspatlas.support.pickling import Light
from graspatlas.support.renamed import renamed_attribute
from graspatlas.support.validation import read_only

__all__ = ["Mechanism", "Mimic", "read_mimics"]

#: How far a stated position of a joint that mimics another may be from where it must be, being rounded [rad or m].
STATED_TOLERANCE = 1e-3
#: Limits nearer to each other than this are the same [rad or m].
SAME_LIMIT = 1e-9


@dataclass(frozen=True)
class Mimic:
    """A joint whose position is multiplier times that of its driver, plus offset.

    Attributes:
        joint: Name of the joint that follows.
        driver: Name of the joint that it follows, itself no follower: chains are resolved.
        multiplier: Its motion for that of the driver [1, rad/m or m/rad].
        offset: Its position where the driver is at 0 [rad or m].
        turns: Both are continuous, so that positions are the same after a whole turn.
    """

    joint: str
    driver: str
    multiplier: float
    offset: float
    turns: bool = False

    def position(self, driver: float) -> float:
        """Position of the joint where the driver has this one [rad or m]."""
        return self.multiplier * driver + self.offset

    def __str__(self) -> str:
        offset = f" {'-' if self.offset < 0 else '+'} {abs(self.offset):g}" if self.offset else ""
        return f"{self.joint} = {self.multiplier:g} {self.driver}{offset}"


def read_mimics(root: ElementTree.Element) -> tuple[Mimic, ...]:
    """The joints of a URDF that mimic others, in the order of the text, each by the joint that drives it in the end.

    Args:
        root: The ``<robot>`` element.

    Raises:
        GraspAtlasError: If a joint mimics itself, one that there is not or that does not move, or a continuous one in
            a way that a whole turn does not repeat; or if a number of the tag is not a number.
    """
    joints = {str(joint.get("name")): joint for joint in root.findall("joint") if joint.get("type") != "fixed"}
    links = {name: _link(name, tag, joints) for name in joints if (tag := joints[name].find("mimic")) is not None}
    mimics = []
    for name in links:
        other, multiplier, offset, seen = name, 1.0, 0.0, {name}
        while other in links:
            other, factor, shift = links[other]
            multiplier, offset = multiplier * factor, multiplier * shift + offset
            if other in seen:
                raise GraspAtlasError(
                    f"joint '{name}' mimics '{links[name][0]}' in a cycle of joints: remove one of these mimics"
                )
            seen.add(other)
        turns = joints[other].get("type") == "continuous"
        mimics.append(Mimic(name, other, multiplier, offset, turns))
        _check_kinds(mimics[-1], *(str(joints[j].get("type")) for j in (name, other)))
    return tuple(mimics)


def _link(name: str, tag: ElementTree.Element, joints: Mapping[str, object]) -> tuple[str, float, float]:
    """What one tag says: the joint it names, multiplier and offset."""
    other = tag.get("joint")
    if other not in joints:
        raise unknown_name("joint", other, joints, f"one that moves, for joint '{name}' to mimic")
    values = []
    for attribute, default in (("multiplier", "1"), ("offset", "0")):
        text = tag.get(attribute, default)
        try:
            values.append(float(text))
        except ValueError:
            values.append(np.nan)
        if not np.isfinite(values[-1]):
            raise GraspAtlasError(f"the mimic {attribute} of joint '{name}' must be a finite number, got '{text}'")
    return str(other), values[0], values[1]


def _check_kinds(mimic: Mimic, kind: str, driver: str) -> None:
    for name, its in ((mimic.joint, kind), (mimic.driver, driver)):
        if its not in ("revolute", "continuous", "prismatic"):
            raise GraspAtlasError(
                f"joint '{mimic.joint}' mimics '{mimic.driver}', but '{name}' is {its}: both must turn or slide"
            )
    if driver == "continuous" and not (kind == "continuous" and abs(mimic.multiplier) == 1.0):
        raise GraspAtlasError(
            f"joint '{mimic.joint}' mimics '{mimic.driver}', which is continuous: that needs a continuous joint and a "
            f"multiplier of 1 or -1, or else every turn is another posture; make '{mimic.driver}' revolute, with limits"
        )


@dataclass(frozen=True)
class Mechanism(Light):
    """How the joints of a hand depend on the actuated ones: q = A q_actuated + b.

    Attributes:
        joints: Names of all joints, in the order of q (h,).
        mimics: The joints that mimic others, m of them.
    """

    joints: tuple[str, ...]
    mimics: tuple[Mimic, ...] = ()

    def __repr__(self) -> str:
        return f"<Mechanism of {len(self.joints)} joints, {len(self.mimics)} of which mimic others>"

    @cached_property
    def followers(self) -> Mapping[str, Mimic]:
        """What drives each joint that mimics another, by its name."""
        return {mimic.joint: mimic for mimic in self.mimics}

    @cached_property
    def actuated(self) -> tuple[str, ...]:
        """Names of the joints that mimic no other, in the order of q (d,), d = h - m."""
        return tuple(name for name in self.joints if name not in self.followers)

    @cached_property
    def transmission(self) -> Array:
        """A: joint velocities that the unit velocity of each actuated joint makes (h, d); its columns share no row."""
        A = np.zeros((len(self.joints), len(self.actuated)))
        for row, name in zip(A, self.joints, strict=True):
            mimic = self.followers.get(name)
            row[self.actuated.index(mimic.driver if mimic else name)] = mimic.multiplier if mimic else 1.0
        return read_only(A)

    driven = renamed_attribute("driven", "actuated")
    A = renamed_attribute("A", "transmission")

    @cached_property
    def b(self) -> Array:
        """Joint positions where all actuated joints are at 0 (h,), radians and metres."""
        offsets = [self.followers[name].offset if name in self.followers else 0.0 for name in self.joints]
        return read_only(np.array(offsets))

    @cached_property
    def rows(self) -> Array:
        """Coefficients (m, h) of q in q_joint - multiplier q_driver = offset."""
        rows = np.zeros((len(self.mimics), len(self.joints)))
        for row, mimic in zip(rows, self.mimics, strict=True):
            row[self.joints.index(mimic.joint)] = 1.0
            row[self.joints.index(mimic.driver)] = -mimic.multiplier
        return read_only(rows)

    def completed(self, positions: Mapping[str, float], what: str) -> dict[str, float]:
        """Positions of all joints [rad or m], of those that mimic others as their drivers have them.

        Args:
            positions: Positions by name; those of joints that mimic others may be missing, or rounded.
            what: What gives them, for messages.

        Raises:
            GraspAtlasError: If a joint that mimics another is stated elsewhere than its driver has it.
        """
        full = dict(positions)
        for mimic in self.mimics:
            if mimic.driver not in positions:
                continue  # whoever reads the posture says that it is missing
            must = mimic.position(float(positions[mimic.driver]))
            off = float(positions.get(mimic.joint, must)) - must
            if mimic.turns:
                off = float(np.angle(np.exp(1j * off)))
            if not abs(off) <= STATED_TOLERANCE:
                raise GraspAtlasError(
                    f"{what} has joint '{mimic.joint}' at {float(positions[mimic.joint]):.6g}, but it mimics: "
                    f"{mimic} = {must:.6g}; leave it out, or correct it"
                )
            full[mimic.joint] = must
        return full

    def residual(self, positions: ArrayLike) -> Array:
        """By how much joint positions (n, h) break the equations of the mimics (n, m), radians and metres."""
        offsets = np.array([mimic.offset for mimic in self.mimics])
        off = np.atleast_2d(np.asarray(positions, float)) @ self.rows.T - offsets
        turns = np.array([mimic.turns for mimic in self.mimics], bool)
        return np.asarray(np.where(turns, np.angle(np.exp(1j * off)), off))

    def completed_motions(self, motions: HandMotions) -> HandMotions:
        """Hand motions of all joints, from some that leave out joints that mimic others.

        Raises:
            GraspAtlasError: If they leave out a joint that drives another.
        """
        missing = [name for name in self.joints if name not in motions.joints and name in self.followers]
        if not missing:
            return motions
        for name in missing:
            if self.followers[name].driver not in motions.joints:
                return motions  # whoever checks the joints says that it is missing
        names = (*motions.joints, *missing)
        follow = np.vstack([np.eye(len(motions.joints)), np.zeros((len(missing), len(motions.joints)))])
        offsets = np.zeros(len(names))
        for i, name in enumerate(missing, len(motions.joints)):
            mimic = self.followers[name]
            follow[i, motions.joints.index(mimic.driver)], offsets[i] = mimic.multiplier, mimic.offset
        couplings = np.hstack([motions.couplings, np.zeros((len(motions.couplings), len(missing)))])
        covariance = follow @ motions.covariance @ follow.T
        return HandMotions(names, follow @ motions.mean + offsets, 0.5 * (covariance + covariance.T), couplings)

    def constrained(self, motions: HandMotions) -> HandMotions:
        """The hand motions, in the order of ``joints``, with the mimics before their couplings.

        Raises:
            GraspAtlasError: If a coupling follows from the mimics, or with them leaves nothing to move.
        """
        ordered = motions.reordered(self.joints)
        if not self.mimics:
            return ordered
        rows = np.vstack([self.rows, ordered.couplings])
        if np.linalg.matrix_rank(rows) < len(rows):
            raise GraspAtlasError(
                "a coupling of the hand motions follows from the joints that mimic others "
                f"({'; '.join(map(str, self.mimics))}) and the other couplings: drop it"
            )
        return HandMotions(self.joints, ordered.mean, ordered.covariance, rows)

    def ranges(self, limits: Mapping[str, tuple[float, float]]) -> dict[str, tuple[float, float]]:
        """Where each actuated joint can be, given its limits and those of the joints that mimic it [rad or m].

        Args:
            limits: Lower and upper limits of all joints, by name.

        Raises:
            GraspAtlasError: If the limits of a joint that mimics another leave that one no range.
        """
        ranges = {}
        for driver in self.actuated:
            (low, (of_low, _)), (high, (of_high, _)) = (self._tightest(driver, side, limits) for side in (0, 1))
            ranges[driver] = low, high
            if not low < high and {of_low, of_high} != {driver}:
                raise _no_range(self.followers[of_low if of_low != driver else of_high], limits)
        for mimic in self.mimics:
            lower, upper = limits[mimic.joint]
            if mimic.multiplier == 0.0 and not lower <= mimic.offset <= upper:
                raise _no_range(mimic, limits)
        return ranges

    def binding_limits(self, limits: Mapping[str, tuple[float, float]]) -> dict[str, tuple[float, float]]:
        """The limits that decide: of a joint and those that mimic it on each side the tightest, the others infinite.

        Args:
            limits: Lower and upper limits of all joints, by name [rad or m].
        """
        binding = {name: [-np.inf, np.inf] for name in limits}
        for driver in self.actuated:
            for side in (0, 1):
                _, (joint, its) = self._tightest(driver, side, limits)
                binding[joint][its] = limits[joint][its]
        return {name: (low, high) for name, (low, high) in binding.items()}

    def _tightest(
        self, driver: str, side: int, limits: Mapping[str, tuple[float, float]]
    ) -> tuple[float, tuple[str, int]]:
        """Lower (side 0) or upper end (1) of an actuated joint's range; whose limit that is, and which of its two."""
        tightest, owner = limits[driver][side], (driver, side)
        for mimic in self.mimics:
            if mimic.driver != driver or mimic.multiplier == 0.0:
                continue
            its = side if mimic.multiplier > 0.0 else 1 - side
            end = (limits[mimic.joint][its] - mimic.offset) / mimic.multiplier
            if end > tightest + SAME_LIMIT if side == 0 else end < tightest - SAME_LIMIT:
                tightest, owner = end, (mimic.joint, its)
        return tightest, owner


def _no_range(mimic: Mimic, limits: Mapping[str, tuple[float, float]]) -> GraspAtlasError:
    (lower, upper), (low, high) = limits[mimic.joint], limits[mimic.driver]
    return GraspAtlasError(
        f"joint '{mimic.joint}', limited to [{lower:.4g}, {upper:.4g}], mimics: {mimic}, where '{mimic.driver}' has "
        f"limits [{low:.4g}, {high:.4g}]; that leaves no range: correct limits, multiplier or offset"
    )
