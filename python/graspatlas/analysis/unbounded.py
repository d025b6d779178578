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

from graspatlas import _core
from graspatlas.analysis.objective import Objective
from graspatlas.support.arrays import Array

__all__ = ["Around", "followed", "is_sharp", "levels_around", "never_levels_off", "rises_towards_one_point"]


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
#: What counts as better, relative to the index.
LEAST_GAIN = 1e-7
#: A sharp place is followed until steps are as small as this share of the chart radius, in at most so many of them.
FINEST = 1e-7
MOST_STEPS = 200


class Neighbourhood(Protocol):
    """A grasp and what is above the tangent space there, in coordinates w [k] with |w| = 1 at a radius."""

    Phi: Array

    def gains(self, W: Array) -> Array:
        """Gains over the grasp, as shares of its index, of the points above W [n, k] that meet everything [m]."""

    def better(self, W: Array) -> tuple[Array, float] | None:
        """The best of the points above W that meet everything, and its index, if that is larger."""


#: The surroundings of a grasp with this index, at this radius.
NeighbourhoodOf = Callable[[Array, float, float], Neighbourhood]


class Around:
    """The grasps around one; see :class:`Neighbourhood`.

    Args:
        objective: The index, and what grasps must meet.
        x: The grasp [configuration_size].
        value: The index there.
        radius: Of the ring |w| = 1 [units of the tangent space].
    """

    def __init__(self, objective: Objective, x: Array, value: float, radius: float) -> None:
        self.objective, self.x, self.value, self.radius = objective, x, value, radius
        self.scale = max(abs(value), 1e-12)
        J = objective.system.evaluate_jacobian(x)
        self.Phi = np.ascontiguousarray(np.linalg.svd(J)[2][len(J) :])

    def gains(self, W: Array) -> Array:
        """See :meth:`Neighbourhood.gains`."""
        return (self.objective.values(self._points(W)) - self.value) / self.scale

    def better(self, W: Array) -> tuple[Array, float] | None:
        """See :meth:`Neighbourhood.better`."""
        X = self._points(W)
        if not len(X):
            return None
        values = self.objective.values(X)
        top = int(values.argmax())
        return (X[top], float(values[top])) if values[top] > self.value + LEAST_GAIN * self.scale else None

    def _points(self, W: Array) -> Array:
        """Grasps above W that meet bounds and requirements, eqs (14) and (15) [m, configuration_size]."""
        above = [_core.project(self.objective.system, self.x, self.Phi, self.radius * w) for w in W]
        X = np.array([x for x in above if x is not None]).reshape(-1, len(self.x))
        return X[self.objective.meets(X)]


def levels_around(near: NeighbourhoodOf, x: Array, value: float, radius: float) -> Array:
    """Median of the index on each ring around a grasp, less the index there, as a share of it; NaN without grasps.

    Args:
        near: The surroundings of a grasp.
        x: The grasp [configuration_size].
        value: The index there.
        radius: Chart radius, of which the rings are shares.

    Returns:
        One value a ring, the largest ring first [5]; negative where the index is below that of the grasp.
    """
    levels = np.full(len(RINGS), np.nan)
    for i, share in enumerate(RINGS):
        around = near(x, value, share * radius)
        gains = around.gains(_ring(RING_POINTS, len(around.Phi), seed=0))
        if len(gains) >= FEWEST:
            levels[i] = np.median(gains)
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


def followed(near: NeighbourhoodOf, x: Array, value: float, radius: float) -> tuple[Array, float]:
    """Where ever smaller steps lead from a sharp place, and the index there: the best of a ring, or a smaller ring.

    Args:
        near: The surroundings of a grasp.
        x: Where to start [configuration_size].
        value: The index there.
        radius: Chart radius; the first ring has a hundredth of it.
    """
    ring = RINGS[1] * radius
    for step in range(MOST_STEPS):
        around = near(x, value, ring)
        found = around.better(_ring(8 * len(around.Phi), len(around.Phi), seed=step))
        if found is not None:
            x, value = found
        elif ring <= FINEST * radius:
            break
        else:
            ring *= 0.5
    return x, value


def _ring(count: int, k: int, seed: int) -> Array:
    """Directions [count, k], half of them opposite to the others."""
    W = np.random.default_rng(seed).normal(size=(count // 2, k))
    W /= np.linalg.norm(W, axis=1, keepdims=True)
    return np.concatenate([W, -W])
