"""Postures of a hand from the positions of its actuated joints, for many postures at a time."""

from __future__ import annotations

import numpy as np

from graspatlas.hand.hand import Hand
from graspatlas.support.arrays import Array

__all__ = ["Actuation"]


class Actuation:
    """The maps between actuated joints z, joint positions A z + b and configurations q of a hand.

    Args:
        hand: The hand; each of its joints has one degree of freedom.

    Attributes:
        hand: The hand.
        names: Names of the actuated joints (d,).
        lower, upper: Where each can be, given its limits and those of the joints that mimic it (d,), rad and m.
    """

    def __init__(self, hand: Hand) -> None:
        mechanism, joints = hand.mechanism, hand.model.hand_joints
        self.hand = hand
        self.names = mechanism.actuated
        ranges = mechanism.ranges(hand.limits_by_name)
        self.lower, self.upper = np.array([ranges[name] for name in self.names]).reshape(-1, 2).T
        self._A, self._b, self._size = np.asarray(mechanism.transmission), mechanism.b, hand.model.hand_q_size
        self._places = np.array([hand.joints.index(name) for name in self.names], np.intp)
        self._first = np.array([joint.q_index for joint in joints], np.intp)
        self._turning = np.array([joint.q_size == 2 for joint in joints], bool)

    def positions(self, q: Array) -> Array:
        """Positions (n, h) of all joints at configurations q (n, nq); of continuous joints in [-pi, pi]."""
        positions = q[:, self._first]
        cosines = self._first[self._turning]
        positions[:, self._turning] = np.arctan2(q[:, cosines + 1], q[:, cosines])
        return np.asarray(positions)

    def unwrapped(self, positions: Array) -> Array:
        """Positions (n, h) along a path, those of continuous joints without jumps."""
        smooth = np.array(positions, float)
        smooth[:, self._turning] = np.unwrap(positions[:, self._turning], axis=0)
        return np.asarray(smooth)

    def actuated(self, positions: Array) -> Array:
        """Positions (n, d) of the actuated joints among those of all joints (n, h)."""
        return np.asarray(positions[:, self._places])

    def full(self, z: Array) -> Array:
        """Positions (n, h) of all joints where the actuated ones are at z (n, d)."""
        return np.asarray(z @ self._A.T + self._b)

    def q(self, z: Array) -> Array:
        """Configurations (n, nq) where the actuated joints are at z (n, d)."""
        positions, q = self.full(z), np.empty((len(z), self._size))
        q[:, self._first] = positions
        cosines = self._first[self._turning]
        turns = positions[:, self._turning]
        q[:, cosines], q[:, cosines + 1] = np.cos(turns), np.sin(turns)
        return np.asarray(q)
