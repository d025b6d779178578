"""The index around one grasp: values and constraints over the tangent space, and the steps that they suggest."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from graspatlas import _core
from graspatlas.grasps.grasps import Grasps
from graspatlas.problem.problem import Problem
from graspatlas.quality.batched import Quality
from graspatlas.quality.evaluation import evaluate as evaluate_index
from graspatlas.requirements.base import Requirement, RequirementLike
from graspatlas.requirements.screening import screen
from graspatlas.result.grasp_atlas import GraspAtlas
from graspatlas.support.arrays import Array

__all__ = ["LocalModel", "Objective"]

#: What counts as better, relative to the quality.
LEAST_GAIN = 1e-7
#: How far inside its bounds and requirements a climb stays, as a share of the trust radius.
MARGIN = 1e-6
#: Shares of the optimiser's step that are tried: requirements may have been seen too late.
SHARES = np.array([1.0, 0.99, 0.9, 0.6, 0.3, 0.1])
#: How far a point may be outside its bounds [units of the tangent space].
BOUND_TOLERANCE = 1e-9
#: Step of the differences, as a share of the trust radius.
DIFFERENCE = 1e-3
#: Directions that are tried when the optimiser finds nothing better.
DIRECTIONS = 16


@dataclass(frozen=True)
class Objective:
    """What is maximised: the index over the grasps of a system that meet the requirements."""

    problem: Problem
    system: _core.GraspSystem
    quality: Quality
    requirements: tuple[RequirementLike, ...]
    radius: float

    @classmethod
    def of(cls, result: GraspAtlas, all_motions: bool) -> Objective:
        """That of a result: over its relevant grasps, or over all of F."""
        system = result.problem.system(result.problem.largest_dimension if all_motions else result.dimension)
        return cls(result.problem, system, result.quality, result.requirements, result.atlas.radius)

    def grasps(self, X: ArrayLike) -> Grasps:
        """Configurations as grasps of the system."""
        return Grasps(self.problem, X, self.system)

    def meets(self, x: Array) -> bool:
        """Whether a grasp meets the requirements."""
        return bool(screen(self.requirements, self.grasps(x))[0][0])


class LocalModel:
    """The index around a grasp x, over tangent coordinates w (k,) in units of the trust radius, |w_i| at most 1.

    What optimisers ask for is the gain, by how much better than x a point is, relatively; and its slacks, all positive
    inside: those of the bounds and of the requirements that are near.
    """

    def __init__(self, objective: Objective, x: Array, value: float, trust_radius: float) -> None:
        self.objective, self.x, self.value, self.trust_radius = objective, x, value, trust_radius
        J = objective.system.evaluate_jacobian(x)
        self.Phi = np.ascontiguousarray(np.linalg.svd(J)[2][len(J) :])
        B = objective.system.bound_normals
        self.near = objective.system.slack(x) < 2.0 * trust_radius * np.sqrt(len(self.Phi)) * np.linalg.norm(B, axis=1)
        here = objective.grasps(x)
        named = [r.slacks_near(here) for r in objective.requirements if isinstance(r, Requirement)]
        self.required = [slacks for slacks in named if slacks is not None]
        self.scale = max(abs(value), 1e-12)
        self._seen: dict[bytes, tuple[Array, Array]] = {}

    def point(self, w: Array) -> Array | None:
        """Point of the manifold above w, eqs (14) and (15)."""
        x = _core.project(self.objective.system, self.x, self.Phi, self.trust_radius * np.asarray(w))
        return None if x is None else np.asarray(x)

    def evaluate(self, W: Array) -> tuple[Array, Array]:
        """Gains [n] and slacks [n, c] of the points above W [n, k]; -1 where there is none."""
        key = W.tobytes()
        if key not in self._seen:
            self._seen[key] = self._evaluate(W)
        return self._seen[key]

    def _evaluate(self, W: Array) -> tuple[Array, Array]:
        points = [self.point(w) for w in W]
        there = np.array([p is not None for p in points])
        rows = [p for p in points if p is not None] or [self.x]
        grasps = self.objective.grasps(np.array(rows))
        values = (evaluate_index(self.objective.quality, grasps) - self.value) / self.scale
        bounds = np.array([self.objective.system.slack(p)[self.near] for p in rows]) / self.trust_radius
        inside = np.hstack([bounds, *(slacks(grasps) / self.trust_radius for slacks in self.required)]) - MARGIN
        gains, slacks = np.full(len(W), -1.0), np.full((len(W), inside.shape[1]), -1.0)
        gains[there], slacks[there] = values[: there.sum()], inside[: there.sum()]
        return gains, slacks

    def slopes(self, w: Array) -> tuple[Array, Array]:
        """Derivatives by w of the gain [k] and the slacks [c, k], by central differences."""
        h = DIFFERENCE * np.eye(len(w))
        gains, slacks = self.evaluate(np.concatenate([w + h, w - h]))
        k = len(w)
        step = 2.0 * DIFFERENCE
        return (gains[:k] - gains[k:]) / step, (slacks[:k] - slacks[k:]).T / step

    def optimise(self) -> tuple[Array, float] | None:
        """What SLSQP finds, or something on the way there, if it is better."""
        from scipy.optimize import minimize  # slow to import

        k = len(self.Phi)
        limits = {"type": "ineq", "fun": lambda w: self.evaluate(w[None])[1][0], "jac": lambda w: self.slopes(w)[1]}
        found = minimize(
            lambda w: -float(self.evaluate(w[None])[0][0]),
            np.zeros(k),
            jac=lambda w: -self.slopes(w)[0],
            method="SLSQP",
            bounds=[(-1.0, 1.0)] * k,
            constraints=[limits] if self.near.any() or self.required else [],
            options={"maxiter": 8, "ftol": 1e-10},
        )
        w = np.asarray(found.x)
        return self.better(SHARES[:, None] * w) if np.isfinite(w).all() else None

    def poll(self) -> tuple[Array, float] | None:
        """The best of some points at distance 1, if it is better."""
        W = np.random.default_rng(0).normal(size=(DIRECTIONS, len(self.Phi)))
        if W.shape[1] == 2:
            angles = 2.0 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS
            W = np.column_stack([np.cos(angles), np.sin(angles)])
        return self.better(W / np.linalg.norm(W, axis=1, keepdims=True))

    def better(self, W: Array) -> tuple[Array, float] | None:
        """The best of the points above W that meet everything, and its quality, if that is better."""
        gains, slacks = self.evaluate(W)
        for row in np.argsort(-gains, kind="stable"):
            if gains[row] < LEAST_GAIN:
                return None
            x = self.point(W[row]) if (slacks[row] > -MARGIN).all() else None
            if (
                x is None
                or self.objective.system.slack(x).min(initial=0.0) < -BOUND_TOLERANCE
                or not self.objective.meets(x)
            ):
                continue
            return x, self.value + float(gains[row]) * self.scale
        return None
