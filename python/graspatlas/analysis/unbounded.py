"""Climbs on an index without a maximum, told from those that end on a peak.

Some indices grow without bound where a grasp becomes singular: a climb runs after them for ever, or ends where numbers
no longer tell points apart, and neither place is a best grasp. What tells such an end from a peak is how the index
falls off around it. On rings ten times as small each time, a peak levels off: from ring to ring a smooth one gains a
hundredth of what it gained before, a kink a tenth. An index that grows without bound gains as much again, or more, on
every ring.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np

from graspatlas.support.arrays import Array

__all__ = ["Model", "followed", "is_sharp", "levels_around", "never_levels_off", "rises_towards_one_point"]


#: Sizes of the rings, as shares of the chart radius.
RINGS = 10.0 ** -np.arange(1.0, 6.0)
#: Points of a ring, and the fewest of them that must be grasps.
RING_POINTS = 32
FEWEST = 8
#: Of what the index gained before, it gains more than this share on the next ring where it never levels off.
LASTING = 0.5
#: The index is larger than on the largest ring by more than this share of itself where it has run away.
RUN_AWAY = 0.5
#: A peak loses less than this share of its index on a ring as small as a climb's last steps.
SHARP = 0.1
#: A sharp place is followed until steps are as small as this share of the chart radius, in at most so many of them.
FINEST = 1e-7
MOST_STEPS = 200


class Model(Protocol):
    """A grasp and the tangent space around it, in coordinates w [k] with |w| = 1 at the trust radius."""

    Phi: Array

    def evaluate(self, W: Array) -> tuple[Array, Array]:
        """Gains [n] over the grasp, as shares of its index, and slacks [n, c] of the points above W [n, k]."""

    def better(self, W: Array) -> tuple[Array, float] | None:
        """The best of the points above W that meet everything, and its index, if that is larger."""


#: The surroundings of a grasp with this index, up to this trust radius.
ModelOf = Callable[[Array, float, float], Model]


def levels_around(model_of: ModelOf, x: Array, value: float, radius: float) -> Array:
    """Median of the index on each ring around a grasp, less the index there, as a share of it; NaN without grasps.

    Args:
        model_of: The surroundings of a grasp.
        x: The grasp [configuration_size].
        value: The index there.
        radius: Chart radius, of which the rings are shares.

    Returns:
        One value a ring, the largest ring first [5]; negative where the index is below that of the grasp.
    """
    levels = np.full(len(RINGS), np.nan)
    for i, share in enumerate(RINGS):
        model = model_of(x, value, share * radius)
        gains, slacks = model.evaluate(_ring(RING_POINTS, len(model.Phi), seed=0))
        there = (gains > -1.0) & (slacks >= 0.0).all(axis=1)
        if there.sum() >= FEWEST:
            levels[i] = np.median(gains[there])
    return levels


def is_sharp(levels: Array) -> bool:
    """True when the index falls at once around a grasp: where its climb ended there may be more."""
    return bool(levels[2] < -SHARP)


def never_levels_off(levels: Array) -> bool:
    """True when the index gains on all rings, down to the smallest."""
    return _lasts(levels[1:])


def rises_towards_one_point(levels: Array) -> bool:
    """True when the index gains on rings that are not smaller than a climb's last steps, while it still rises."""
    return _lasts(levels[:3])


def _lasts(levels: Array) -> bool:
    gains = np.diff(levels)
    return bool(levels[0] < -RUN_AWAY and gains[0] > 0.0 and (gains[1:] >= LASTING * gains[:-1]).all())


def followed(model_of: ModelOf, x: Array, value: float, radius: float) -> tuple[Array, float]:
    """Where ever smaller steps lead from a sharp place, and the index there: the best of a ring, or a smaller ring.

    Args:
        model_of: The surroundings of a grasp.
        x: Where to start [configuration_size].
        value: The index there.
        radius: Chart radius; the first ring has a hundredth of it.
    """
    trust_radius = RINGS[1] * radius
    for step in range(MOST_STEPS):
        model = model_of(x, value, trust_radius)
        found = model.better(_ring(8 * len(model.Phi), len(model.Phi), seed=step))
        if found is not None:
            x, value = found
        elif trust_radius <= FINEST * radius:
            break
        else:
            trust_radius *= 0.5
    return x, value


def _ring(count: int, k: int, seed: int) -> Array:
    """Directions [count, k], half of them opposite to the others."""
    W = np.random.default_rng(seed).normal(size=(count // 2, k))
    W /= np.linalg.norm(W, axis=1, keepdims=True)
    return np.concatenate([W, -W])
