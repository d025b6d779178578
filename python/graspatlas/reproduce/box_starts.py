"""Multi-start local optimisation of a grasp, without an atlas: SLSQP of SciPy on the contact equations themselves.

The unknowns are tangent coordinates v at x1. Equations, bounds and their derivatives come from `problem.system`, so
that SLSQP has exact slopes of the constraints and pays compiled prices; the index's slope is by central differences, in
one batch. Starts are uniform in the box that the atlas has found the feasible grasps to fill, which a user
would not know. On some problems it is a weak opponent: most starts on the can never reach the contacts. Climbs on the
manifold, which start from grasps, are a stronger one there; see :mod:`graspatlas.reproduce.climbing`. The equations let
a finger touch from inside the object too; an inequality rules that out.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

from graspatlas.grasps.grasps import Grasps
from graspatlas.problem.problem import Problem
from graspatlas.quality.evaluation import evaluate
from graspatlas.result.result import Result
from graspatlas.support.arrays import Array

__all__ = ["Multistart", "multistart"]


#: What counts as feasible: largest residual, and how far a bound may be broken.
FEASIBLE = 1e-6
#: Share of the atlas's best that counts as reaching it.
REACHED = 0.999
STEP = 1e-6


@dataclass
class Multistart:
    """How the starts ended.

    Attributes:
        seconds: Processor time until a start reached the atlas's best, or until the time was over.
        infeasible, local, reached: How many starts ended off the contacts or inside the object, at a worse grasp, and
            at one as good.
        best: Best index found.
    """

    seconds: float = 0.0
    infeasible: int = 0
    local: int = 0
    reached: int = 0
    best: float = 0.0

    @property
    def starts(self) -> int:
        """How many starts there were."""
        return self.infeasible + self.local + self.reached


class _Unknowns:
    """The problem in tangent coordinates v [n] at x1."""

    def __init__(self, problem: Problem, dimension: int, index: str) -> None:
        self.problem, self.index = problem, index
        self.system = problem.system(dimension)
        self.x1 = problem.x1_array
        self.n = self.system.tangent_size
        self.scale = float(self.qualities(np.zeros((1, self.n)))[0])

    def x(self, v: Array) -> Array:
        return np.asarray(self.system.integrate(self.x1, v))

    def qualities(self, V: Array) -> Array:
        grasps = Grasps(self.problem, [self.x(v) for v in V], self.system)
        return evaluate(self.index, grasps)

    def objective(self, v: Array) -> float:
        return -float(self.qualities(v[None])[0]) / self.scale

    def slope(self, v: Array) -> Array:
        h = STEP * np.eye(self.n)
        values = self.qualities(np.concatenate([v + h, v - h]))
        return np.asarray(-(values[: self.n] - values[self.n :]) / (2.0 * STEP * self.scale))

    def turned(self, v: Array) -> Array:
        """Derivative of x1 (+) v by v, in the tangent space there [n, n]."""
        x, d = self.x(v), self.system.difference
        columns = [np.asarray(d(x, self.x(v + h))) / STEP for h in STEP * np.eye(self.n)]
        return np.asarray(np.transpose(columns))

    def residual(self, v: Array) -> Array:
        return np.asarray(self.system.evaluate_residual(self.x(v)))

    def residual_slope(self, v: Array) -> Array:
        return np.asarray(self.system.evaluate_jacobian(self.x(v)) @ self.turned(v))

    def slack(self, v: Array) -> Array:
        return np.asarray(self.system.slack(self.x(v)))

    def sides(self, V: Array) -> Array:
        """Minus the cosines between the normals of hand and object [n, m]: 1 outside the object, -1 inside it."""
        arrays = self.system.grasp_arrays(np.array([self.x(v) for v in V]))
        return np.asarray(-np.sum(arrays["hand_normals"] * arrays["object_normals"], axis=2))

    def sides_slope(self, v: Array) -> Array:
        """Derivative of the above by v [m, n]."""
        h = STEP * np.eye(self.n)
        values = self.sides(np.concatenate([v + h, v - h]))
        return np.asarray(((values[: self.n] - values[self.n :]) / (2.0 * STEP)).T)

    def feasible(self, v: Array) -> bool:
        """Whether the fingers touch the object everywhere, from outside, and break no bound."""
        if not np.isfinite(v).all():
            return False
        inside = self.slack(v).min() >= -FEASIBLE and self.sides(v[None]).min() > 0.0
        return bool(inside and np.abs(self.residual(v)).max() <= FEASIBLE)

    def slack_slope(self, v: Array) -> Array:
        return np.asarray(-self.system.bound_normals @ self.turned(v))


def multistart(result: Result, max_seconds: float, seed: int, until_reached: bool = True) -> Multistart:
    """Start SLSQP again and again until it reaches the best grasp of an atlas; requirements are not looked at.

    Args:
        result: The atlas's result, with an index that has a name.
        max_seconds: Processor time after which to stop [s].
        seed: Of the random starts.
        until_reached: Stop as soon as one start was as good as the atlas's best.
    """
    assert isinstance(result.quality, str)
    unknowns = _Unknowns(result.problem, result.dimension, result.quality)
    found = np.array([unknowns.system.difference(unknowns.x1, x) for x in result.atlas.centers])
    low, high = found.min(axis=0), found.max(axis=0)
    constraints = [
        {"type": "eq", "fun": unknowns.residual, "jac": unknowns.residual_slope},
        {"type": "ineq", "fun": unknowns.slack, "jac": unknowns.slack_slope},
        {"type": "ineq", "fun": lambda v: unknowns.sides(v[None])[0], "jac": unknowns.sides_slope},
    ]
    rng = np.random.default_rng(seed)
    ends = Multistart()
    start = time.process_time()
    while not (until_reached and ends.reached) and time.process_time() - start < max_seconds:
        v = minimize(
            unknowns.objective,
            rng.uniform(low, high),
            jac=unknowns.slope,
            method="SLSQP",
            constraints=constraints,
            options={"maxiter": 200, "ftol": 1e-9},
        ).x
        if not unknowns.feasible(v):
            ends.infeasible += 1
            continue
        quality = float(unknowns.qualities(v[None])[0])
        ends.best = max(ends.best, quality)
        if quality >= REACHED * result.best.quality:
            ends.reached += 1
        else:
            ends.local += 1
    ends.seconds = time.process_time() - start
    return ends
