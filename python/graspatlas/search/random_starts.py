"""Random configurations that nearly touch: where searches for feasible grasps start."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from graspatlas import _core
from graspatlas.problem.problem import Problem
from graspatlas.support.arrays import Array

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

__all__ = ["Starts", "hand_size"]

#: Steps of the random walk through the hand postures from one start to the next.
WALK_STEPS = 12
#: How far a joint or patch angle without limits may be from the reference [rad].
HALF_TURN = np.pi
#: What counts as zero: how far a hand motion moves a joint, how far a joint is off the hand motions.
STILL, OFF = 1e-12, 1e-7


class Starts:
    """Random hand postures and patch parameters, and the object where its contact points come near those of the hand.

    Postures come from a random walk whose limit is the uniform distribution on the slice of eq (13) within the joint
    limits; parameters are uniform in their intervals. What has no limits stays within half a turn, or the size of the
    hand, of the reference.

    Attributes:
        hand_size: Distance of the farthest link from the palm's origin, and a little more [m].

    Args:
        problem: The problem.
        system: Its system of some dimension.
    """

    def __init__(self, problem: Problem, system: _core.GraspSystem) -> None:
        self._problem, self._system = problem, system
        self._joint = problem.object_joint_model
        q = problem.reference_array
        self._pose = slice(len(q), len(q) + self._joint.size)
        self._reference = np.r_[q, self._joint.neutral, np.zeros(system.n_parameters)]
        self.hand_size = hand_size(problem)
        free = [patch.interval(name) or (-HALF_TURN, HALF_TURN) for c in problem.contacts for patch, name in c.free()]
        ends = np.array(free, float).reshape(-1, 2)
        self._lower, self._upper = np.where(np.isinf(ends), np.sign(ends) * self.hand_size, ends).T
        self._motions = self._kept_motions()
        self._A, self._b = self._posture_bounds()
        self._y = self._middle()

    def draw(self, rng: np.random.Generator) -> Array:
        """A start (configuration_size,); its bounds hold, and its contacts nearly do."""
        for _ in range(WALK_STEPS):
            self._y = self._walk(rng)
        step = np.zeros(self._system.tangent_size)
        step[: len(self._y)] = self._y
        x = np.asarray(self._system.integrate(self._reference, step))
        x[len(x) - len(self._lower) :] = rng.uniform(self._lower, self._upper)
        return self._place_object(x, rng)

    def at_pose(self, xyz: Array, rotation: Rotation, rng: np.random.Generator) -> Array:
        """A start (configuration_size,) in the reference posture, the object's patches nearest to the hand's points.

        Args:
            xyz: Position of the object in the palm's frame (3,), metres.
            rotation: Its rotation.
            rng: Random numbers, for the free parameters of the hand's patches.
        """
        x: Array = self._reference.copy()
        x[self._pose] = self._joint.nearest(xyz, rotation)
        at = len(x) - len(self._lower)
        x[at:] = rng.uniform(self._lower, self._upper)
        self._locate(x, (self._system.grasp_arrays(x[None])["hand_points"][0] - xyz) @ rotation.as_matrix())
        return x

    def at_points(self, q: Array, points: Array, rng: np.random.Generator) -> Array:
        """A start (configuration_size,) in a posture, with the contacts of the object about where it has these points.

        Args:
            q: The posture (nq,).
            points: A point on the object for each contact, in its frame (m, 3) [m].
            rng: Random numbers, for the free parameters of the hand's patches.
        """
        x: Array = self._reference.copy()
        x[: len(q)] = q
        at = len(x) - len(self._lower)
        x[at:] = rng.uniform(self._lower, self._upper)
        self._locate(x, points)
        return self._place_object(x, rng)

    def _locate(self, x: Array, points: Array) -> None:
        """Set the free parameters of the object's patches in x to where these come nearest to points (m, 3)."""
        first = at = len(x) - len(self._lower)
        for contact, point in zip(self._problem.contacts, points, strict=True):
            of_hand, of_object = contact.sides
            at += len(of_hand.free)
            x[at : at + len(of_object.free)] = of_object.values_of_free(of_object.patch.locate(point))
            at += len(of_object.free)
        x[first:] = np.clip(x[first:], self._lower, self._upper)

    def pose(self, x: Array) -> tuple[Array, Rotation]:
        """Position (3,) and rotation of the object in the palm's frame at a configuration x."""
        return self._joint.to_rotation(x[self._pose])

    def has_posture_of(self, x: Array) -> bool:
        """True when a grasp x has a posture that could be drawn, its unlimited joints within half a turn."""
        d = self._joint_steps(x)
        return bool(np.abs(d - self._motions @ np.linalg.lstsq(self._motions, d)[0]).max() < OFF)

    def _joint_steps(self, x: Array) -> Array:
        """From the reference posture to that of x [rad or length_scale]; the shorter way round."""
        problem = self._problem
        nq = problem.hand.model.hand_q_size
        return problem.hand.joint_steps(self._reference[:nq], x[:nq]) / problem.joint_units

    def _kept_motions(self) -> Array:
        """The hand motions that are kept, as columns of joint steps (nv, p)."""
        system = self._system
        p = system.tangent_size - system.object_dof - system.n_parameters
        units = np.eye(system.tangent_size)[:p]
        steps = [self._joint_steps(system.integrate(self._reference, unit)) for unit in units]
        return np.column_stack(steps)

    def _posture_bounds(self) -> tuple[Array, Array]:
        """A and b: postures y along the motions that are kept lie within the limits when A y <= b."""
        hand, q = self._problem.hand, self._problem.reference_array
        lower, upper = hand.joint_limits
        A, b = [], []
        for joint in hand.model.hand_joints:
            row, unit = self._motions[joint.v_index], self._problem.joint_units[joint.v_index]
            reach = np.full(2, self.hand_size / unit if joint.prismatic else HALF_TURN)
            if joint.q_size == 1:
                to_limits = np.array([upper[joint.q_index] - q[joint.q_index], q[joint.q_index] - lower[joint.q_index]])
                reach = np.where(np.isinf(to_limits), reach, to_limits / unit)
            if np.abs(row).max() > STILL:
                A += [row, -row]
                b += [*np.maximum(reach, 0.0)]
        return np.array(A), np.array(b)

    def _middle(self) -> Array:
        """Centre of the largest ball of postures within the limits (p,)."""
        from scipy.optimize import linprog  # slow to import

        lengths = np.linalg.norm(self._A, axis=1)
        aim = np.r_[np.zeros(self._A.shape[1]), -1.0]
        found = linprog(
            aim, np.column_stack([self._A, lengths]), self._b, bounds=[(None, None)] * (len(aim) - 1) + [(0, None)]
        )
        return np.asarray(found.x[:-1])

    def _walk(self, rng: np.random.Generator) -> Array:
        """The next posture of a hit-and-run walk: uniform on a line through the last one, within the limits."""
        direction = rng.normal(size=len(self._y))
        slope, room = self._A @ direction, np.maximum(self._b - self._A @ self._y, 0.0)
        ahead, behind = slope > STILL, slope < -STILL
        far = (room[ahead] / slope[ahead]).min(initial=np.inf)
        near = (room[behind] / slope[behind]).max(initial=-np.inf)
        return np.asarray(self._y + rng.uniform(near, far) * direction)

    def _place_object(self, x: Array, rng: np.random.Generator) -> Array:
        """The configuration x with the object where its contact points and normals come nearest to the hand's."""
        arrays = self._system.grasp_arrays(x[None])
        hand, body = arrays["hand_points"][0], arrays["object_points"][0]
        # A normal counts as a point as far away as the contacts are from each other.
        lever = max(float(np.linalg.norm(hand - hand.mean(axis=0), axis=1).mean()), self._problem.length_scale)
        to = np.concatenate([hand, hand + lever * arrays["hand_normals"][0]])
        of = np.concatenate([body, body - lever * arrays["object_normals"][0]])
        d = self._joint.translations
        # The rotation that points in a row leave open is drawn.
        any_way = self._joint.random_rotation(rng)
        R, t = _best_motion(of[:, :d] @ any_way.T, to[:, :d])
        x[self._pose] = self._joint.from_motion(R @ any_way, t)
        return x


def hand_size(problem: Problem) -> float:
    """Distance of the farthest link from the palm's origin in the reference posture, and a little more [m]."""
    places = problem.hand.link_placements(problem.reference_array)
    return max(float(np.linalg.norm(T[:3, 3])) for T in places.values()) + problem.length_scale


def _best_motion(of: Array, to: Array) -> tuple[Array, Array]:
    """Rotation R (d, d) and translation t (d,) with the least squares of R of + t - to, points as rows (n, d).

    Source: S. Umeyama, "Least-Squares Estimation of Transformation Parameters Between Two Point Patterns", PAMI 1991.
    """
    middle_of, middle_to = of.mean(axis=0), to.mean(axis=0)
    U, _, Vt = np.linalg.svd((to - middle_to).T @ (of - middle_of))
    signs = np.ones(len(U))
    signs[-1] = np.sign(np.linalg.det(U @ Vt))
    R = (U * signs) @ Vt
    return R, middle_to - R @ middle_of
