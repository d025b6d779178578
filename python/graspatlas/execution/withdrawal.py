r"""Postures of a hand whose contact points are off the object by given distances, for many grasps at a time.

At a grasp the hand touches the object at points p_c of its links, where the object has the outward normals n_c. With
the object unmoved, the actuated joints z that withdraw them by a distance s minimise

.. math:: \sum_c (n_c \cdot d_c - s)^2 + w_t^2 \sum_c |d_c - (n_c \cdot d_c) n_c|^2 + w_z^2 |(z - z_0) / u|^2,
          \quad z_l \le z \le z_u,

where d_c are the displacements of the points, which stay where they are in their links, and u the units of the joints.
The limits bound the least squares itself: a step of its unbounded solution, cut off at the limits, would drive a finger
that stands at its limit into the object.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from graspatlas.execution.actuation import Actuation
from graspatlas.problem.problem import Problem
from graspatlas.support.arrays import Array, BoolArray, IndexArray

__all__ = ["Withdrawal"]

#: Weights w_t of the displacements along the surface, and w_z of the joints [m], where that along the normal has 1.
TANGENTIAL, REST = 0.05, 5e-4
#: Steps of Gauss and Newton, at most; they end when no joint moves by more than this [units of the joints].
MOST_STEPS, SMALL_STEP = 30, 1e-5
#: Damping when a step made the sum of squares larger [m^2], what it then grows by, and the least there is.
DAMPING, HARDER, LEAST_DAMPING = 1e-6, 10.0, 1e-9


@dataclass(frozen=True)
class _Linear:
    """Residuals at postures of n grasps, and their derivatives by the d actuated joints.

    Attributes:
        normal: How far each contact point is off the object along its normal (n, m), metres.
        r: Weighted residuals of the points (n, 3 m), metres.
        J: Their derivatives (n, 3 m, d).
        cost: Sum of squares, joints included (n,).
    """

    normal: Array
    r: Array
    J: Array
    cost: Array


class Withdrawal:
    """The withdrawal of the fingertips of some grasps.

    Args:
        problem: The problem.
        X: The grasps (n, configuration_size).

    Attributes:
        problem: The problem.
        actuation: The maps between its actuated joints and postures.
        z0: Positions of the actuated joints at the grasps, within their limits (n, d), radians and metres.
    """

    def __init__(self, problem: Problem, X: Array) -> None:
        self.problem, self._system, self._X = problem, problem.full_system, np.array(X, float)
        self._q_size = problem.hand.model.hand_q_size
        self.actuation = Actuation(problem.hand)
        stated = self.actuation.actuated(self.actuation.positions(self._X[:, : self._q_size]))
        self.z0: Array = np.clip(stated, self.actuation.lower, self.actuation.upper)
        self._units = self.actuation.actuated(problem.joint_units[None])[0]
        arrays = self._system.grasp_arrays(self._X)
        self._points, normals = arrays["hand_points"], arrays["object_normals"]
        self._axes = _axes(normals) * np.array([1.0, TANGENTIAL, TANGENTIAL])[:, None]

    def at(self, z: Array, rows: IndexArray) -> Array:
        """The grasps (k, configuration_size) of some rows (k,), with the actuated joints at z (k, d)."""
        X = self._X[rows]
        X[:, : self._q_size] = self.actuation.q(z)
        return np.asarray(X)

    def distances(self, z: Array, rows: IndexArray) -> Array:
        """How far each contact point is off the object along its normal (k, m), metres."""
        return self._linear(z, np.zeros(len(rows)), rows).normal

    def solve(self, z: Array, targets: Array, rows: IndexArray) -> tuple[Array, Array]:
        """Withdraw the contact points of some grasps.

        Args:
            z: Where the search starts (k, d).
            targets: How far each grasp's contact points shall be off (k,), metres.
            rows: The numbers of the grasps (k,).

        Returns:
            Positions of the actuated joints (k, d), and how far the contact points are off there (k, m), metres.
        """
        z, mu, moving = z.copy(), np.zeros(len(rows)), np.ones(len(rows), bool)
        now = self._linear(z, targets, rows)
        for _ in range(MOST_STEPS):
            step = self._bounded_step(z, now, mu, rows)
            step[~moving] = 0.0
            after = self._linear(z + step, targets, rows)
            better = after.cost <= now.cost
            moving &= ~(better & (np.abs(step / self._units).max(axis=1) < SMALL_STEP))
            z = np.where(better[:, None], z + step, z)
            now = _chosen(better, after, now)
            mu = np.where(better, np.where(mu > LEAST_DAMPING, mu / HARDER, 0.0), np.maximum(mu * HARDER, DAMPING))
            if not moving.any():
                break
        return z, now.normal

    def pressed(self, z: Array, target: float, row: int) -> Array:
        """How much the sum of squares would fall if each actuated joint passed its limit (d,); zero within limits."""
        now = self._linear(z[None], np.array([target]), np.array([row]))
        slope = self._gradient(z[None], now, np.array([row]))[0] * self._units
        at_lower, at_upper = self._at_limits(z[None])
        return np.asarray(np.where(at_lower[0] & (slope > 0.0) | at_upper[0] & (slope < 0.0), np.abs(slope), 0.0))

    def _linear(self, z: Array, targets: Array, rows: IndexArray) -> _Linear:
        arrays = self._system.grasp_arrays(self.at(z, rows))
        k, m, _ = arrays["hand_points"].shape
        axes = self._axes[rows]
        r = np.einsum("kmij,kmj->kmi", axes, arrays["hand_points"] - self._points[rows])
        normal = r[:, :, 0].copy()
        r[:, :, 0] -= targets[:, None]
        J = axes @ arrays["J"].reshape(k, m, 3, -1)
        r, J = r.reshape(k, 3 * m), J.reshape(k, 3 * m, -1)
        rest = REST * (z - self.z0[rows]) / self._units
        return _Linear(normal, r, J, (r**2).sum(axis=1) + (rest**2).sum(axis=1))

    def _gradient(self, z: Array, now: _Linear, rows: IndexArray) -> Array:
        """Half the slope of the sum of squares (k, d)."""
        of_points = (now.r[:, None, :] @ now.J)[:, 0]
        return np.asarray(of_points + (REST / self._units) ** 2 * (z - self.z0[rows]))

    def _at_limits(self, z: Array) -> tuple[BoolArray, BoolArray]:
        return z <= self.actuation.lower, z >= self.actuation.upper

    def _bounded_step(self, z: Array, now: _Linear, mu: Array, rows: IndexArray) -> Array:
        """The step (k, d) that minimises the linearised sum of squares, damped by mu (k,), within the limits.

        Joints that the step would take beyond their limits are put there, and the others are solved for again.
        """
        weights = (REST**2 + mu)[:, None] / self._units**2
        H = now.J.swapaxes(1, 2) @ now.J + weights[:, :, None] * np.eye(z.shape[1])
        g = self._gradient(z, now, rows)
        at_lower, at_upper = self._at_limits(z)
        fixed = at_lower & (g > 0.0) | at_upper & (g < 0.0)
        step = np.zeros_like(z)
        while True:
            inside = ~fixed
            reduced = np.where(inside[:, :, None] & inside[:, None, :], H, np.eye(z.shape[1]))
            moved = np.where(fixed, step, 0.0)
            right = np.where(inside, -g - (H @ moved[:, :, None])[:, :, 0], step)
            step = np.linalg.solve(reduced, right[:, :, None])[:, :, 0]
            beyond = inside & ((z + step < self.actuation.lower) | (z + step > self.actuation.upper))
            step = np.clip(z + step, self.actuation.lower, self.actuation.upper) - z
            if not beyond.any():
                return np.asarray(step)
            fixed |= beyond


def _axes(normals: Array) -> Array:
    """Unit normals (..., 3), and two unit vectors square to each and to each other: (..., 3, 3), one a row."""
    aside = np.where(np.abs(normals[..., :1]) < 0.7, np.eye(3)[0], np.eye(3)[1])
    first = np.cross(normals, aside)
    first /= np.linalg.norm(first, axis=-1, keepdims=True)
    return np.stack([normals, first, np.cross(normals, first)], axis=-2)


def _chosen(where: BoolArray, yes: _Linear, no: _Linear) -> _Linear:
    """Of each grasp the one or the other."""
    return _Linear(
        np.where(where[:, None], yes.normal, no.normal),
        np.where(where[:, None], yes.r, no.r),
        np.where(where[:, None, None], yes.J, no.J),
        np.where(where, yes.cost, no.cost),
    )
