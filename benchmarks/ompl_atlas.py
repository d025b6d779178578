"""A surface covered by OMPL's AtlasStateSpace: charts made while states are sampled, until its frontier is empty.

OMPL makes charts where a planner comes; it has no call that covers a manifold. Sampling near random states of the atlas
does so, and the atlas's own estimate says when no chart borders on unknown land.

Source: L. Jaillet and J. M. Porta, "Path Planning Under Kinematic Constraints by Rapidly Exploring Manifolds", 2013, on
which OMPL's space builds.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from ompl import base

#: As those of the other atlases: largest residual, and side of the ambient box.
TOLERANCE = 1e-9
BOX = 2.0
#: Samples between two looks at the frontier.
SAMPLES = 100


class _Constraint(base.Constraint):  # type: ignore[misc]
    def __init__(self, n: int, residual: Callable[[Any], Any], jacobian: Callable[[Any], Any]) -> None:
        super().__init__(n, 1, TOLERANCE)
        self.written = (residual, jacobian)

    def function(self, x: Any, out: Any) -> None:
        out[:] = self.written[0](x)

    def jacobian(self, x: Any, out: Any) -> None:
        out[:] = self.written[1](x)


@dataclass(frozen=True)
class OmplAtlas:
    """What OMPL made, and what processor time it took."""

    n_charts: int
    seconds: float
    frontier_percent: float


def cover(
    residual: Callable[[Any], Any],
    jacobian: Callable[[Any], Any],
    x0: Sequence[float],
    *,
    radius: float,
    epsilon: float,
    max_seconds: float = 30.0,
) -> OmplAtlas:
    """Cover the surface residual(x) = 0 through x0 with charts of a radius.

    Args:
        residual: One equation of x [n].
        jacobian: Its derivative [1, n].
        x0: A point on the surface.
        radius: OMPL's rho.
        epsilon: OMPL's epsilon, a length as in eq (17); alpha is the arc cosine of 1 - epsilon, as in eq (18).
        max_seconds: When to give up.
    """
    n = len(x0)
    ambient = base.RealVectorStateSpace(n)
    bounds = base.RealVectorBounds(n)
    bounds.setLow(-BOX)
    bounds.setHigh(BOX)
    ambient.setBounds(bounds)
    space = base.AtlasStateSpace(ambient, _Constraint(n, residual, jacobian))
    information = base.ConstrainedSpaceInformation(space)
    space.setRho(radius)
    space.setEpsilon(epsilon)
    space.setAlpha(float(np.arccos(1.0 - epsilon)))
    space.setDelta(0.5 * radius)
    space.setup()
    first, near = space.allocState(), space.allocState()
    first.copy(list(x0))
    start = time.process_time()
    space.anchorChart(first)
    sampler = space.allocStateSampler()
    frontier = 100.0
    while frontier > 0.0 and time.process_time() - start < max_seconds:
        for _ in range(SAMPLES):
            sampler.sampleUniform(first)
            sampler.sampleUniformNear(near, first, 2.0 * radius)
        frontier = space.estimateFrontierPercent()
    seconds = time.process_time() - start
    del information
    return OmplAtlas(space.getChartCount(), seconds, frontier)
