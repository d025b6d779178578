"""Climbs over all feasible grasps by SciPy's SLSQP, from random postures that SciPy's least squares repair.

Nothing here is that of the search in ``graspatlas.multistart``: starts are uniform in the joint limits and nowhere near
a grasp, contact equations, bounds and requirements are residuals of a least-squares problem, and then constraints of a
nonlinear programme in all coordinates of the configuration space. All slopes are central differences.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from scipy.optimize import least_squares, minimize
from scipy.spatial.transform import Rotation

import graspatlas as ga
from graspatlas import _core
from graspatlas.collision.checker import CollisionChecker
from graspatlas.requirements import CollisionFree, ForceClosure, screen

Array = np.ndarray

#: Pairs of shapes whose distances are watched, the nearest.
PAIRS = 20
#: Steps of differences: of smooth functions, and of distances, whose depths are known to 1e-6 m only.
SMALL, LARGE = 1e-6, 1e-4
#: A fingertip this near the object touches it where it should; there the distance has no slope [m].
TOUCHING = 2e-5
#: Programmes that follow each other, each in a box round the end of the one before, and the half-width of the box.
PROGRAMMES, BOX = 15, 0.5
#: A climb is given up that misses a requirement by more than SHORT after HOPELESS programmes.
HOPELESS, SHORT = 3, 0.02
#: What programmes keep beyond a requirement, as numbers round, distances in units of the length scale; tried one after
#: the other until a grasp is accepted.
ROOMS = (1e-7, 1e-5, 1e-4, 2e-4, 4e-4)


class RandomClimbs:
    """An index over all grasps that meet force closure and collision requirements, and climbs on it.

    Args:
        problem: The problem; its x1 tells where the hand is.
        quality: Name of the index, which must be positive.
        requirements: Of force closure and of collisions.
    """

    def __init__(self, problem: ga.Problem, quality: str, requirements: Sequence[object]) -> None:
        self.problem, self.quality, self.requirements = problem, quality, tuple(requirements)
        self.system = problem.system(problem.largest_dimension)
        self.closures = [r for r in requirements if isinstance(r, ForceClosure)]
        self.checkers = [
            CollisionChecker(problem, r.touch_depth, r.clearance) for r in requirements if isinstance(r, CollisionFree)
        ]
        assert len(self.closures) + len(self.checkers) == len(self.requirements)
        self._posture = self._joint_steps_of_motions()

    # What is asked of grasps, for a batch X [n, configuration_size].

    def index(self, X: Array) -> Array:
        """The index [n]."""
        return ga.quality.evaluate(self.quality, ga.Grasps(self.problem, X, self.system))

    def accepted(self, x: Array) -> bool:
        """Whether the public checks take x for a grasp."""
        on_manifold = np.abs(self.system.evaluate_residual(x)).max() <= 1e-9
        inside = self.system.slack(x).min(initial=0.0) >= -1e-9
        opposed = self._normals(x[None]).max() < 1e-6
        return bool(
            on_manifold
            and inside
            and opposed
            and screen(self.requirements, ga.Grasps(self.problem, x[None], self.system))[0][0]
        )

    def _normals(self, X: Array) -> Array:
        """Lengths of the sums of normals that should oppose [n, contacts]."""
        arrays = self.system.grasp_arrays(X)
        return np.linalg.norm(arrays["hand_normals"] + arrays["object_normals"], axis=2)

    def equations(self, X: Array) -> Array:
        """The contact equations [n, equations]."""
        return np.array([self.system.evaluate_residual(x) for x in X])

    def slacks(self, X: Array) -> Array:
        """By how much bounds and force closure are met [n, bounds + closures]."""
        bounds = np.array([self.system.slack(x) for x in X]).reshape(len(X), -1)
        closures = [
            _core.force_closure_slacks(self.system, X, r.friction, r.torsional) - r.margin for r in self.closures
        ]
        # Where internal forces hardly press the slack falls to minus infinity.
        tame = [np.where(s < -1.0, -1.0 - np.log(np.maximum(-s, 1.0)), s) for s in np.maximum(closures, -1e6)]
        return np.column_stack([bounds, *tame])

    def watched(self, x: Array) -> list[Array]:
        """Numbers of the pairs of shapes to watch near x, for each checker."""
        found = []
        for checker in self.checkers:
            room = checker.clearances(x[None])[0]
            touching = (checker.required < 0.0) & (np.abs(room + checker.required) < TOUCHING)
            found.append(np.argsort(np.where(touching, np.inf, room))[:PAIRS])
        return found

    def distances(self, X: Array, watched: list[Array]) -> Array:
        """Distances of the watched pairs less those they must keep [n, pairs], in units of the length scale."""
        parts = [checker.clearances(X, pairs) for checker, pairs in zip(self.checkers, watched, strict=True)]
        return np.hstack([np.zeros((len(X), 0)), *parts]) / self.problem.length_scale

    # Random starts.

    def _joint_steps_of_motions(self) -> Array:
        """Joint steps of each hand motion, as columns."""
        system, hand, x1 = self.system, self.problem.hand, self.problem.x1_array
        n = system.tangent_size - system.object_dof - system.n_parameters
        nq = hand.model.hand_q_size
        return np.column_stack(
            [hand.joint_steps(x1[:nq], system.integrate(x1, e)[:nq]) for e in np.eye(system.tangent_size)[:n]]
        )

    def random_start(self, rng: np.random.Generator) -> Array:
        """Joints uniform within their limits, the object anywhere in the hand, patch parameters anywhere."""
        problem, system, hand = self.problem, self.system, self.problem.hand
        x1, nq = problem.x1_array, problem.hand.model.hand_q_size
        lower, upper = hand.joint_limits
        aim = np.zeros(hand.model.hand_v_size)
        for joint in hand.model.hand_joints:
            limits = np.array([-np.pi, np.pi])
            if joint.q_size == 1 and np.isfinite(upper[joint.q_index] - lower[joint.q_index]):
                limits = np.array([lower[joint.q_index], upper[joint.q_index]]) - x1[joint.q_index]
            aim[joint.v_index] = rng.uniform(*limits)
        v = np.zeros(system.tangent_size)
        v[: self._posture.shape[1]] = np.linalg.lstsq(self._posture, aim)[0]
        first = system.tangent_size - system.n_parameters
        v[first:] = rng.uniform(-np.pi, np.pi, system.n_parameters)
        x = np.array(system.integrate(x1, v))
        x[len(x) - system.n_parameters :] = self._random_parameters(rng)
        fingertips = system.grasp_arrays(x[None])["hand_points"][0]
        at = fingertips.mean(axis=0) + rng.normal(size=3) * fingertips.std()
        joint = problem.object_joint_model
        R = Rotation.random(rng=rng).as_matrix() if joint.translations == 3 else joint.random_rotation(rng)
        x[nq : nq + joint.size] = joint.from_motion(R, at[: joint.translations])
        return x

    def _random_parameters(self, rng: np.random.Generator) -> Array:
        free = [patch.interval(name) for contact in self.problem.contacts for patch, name in contact.free()]
        ends = [(-np.pi, np.pi) if interval is None else interval for interval in free]
        return np.array([rng.uniform(*end) for end in ends])

    def start(self, rng: np.random.Generator, draws: int) -> Array:
        """Of random postures with their contacts repaired, that which misses the requirements least, all repaired."""
        drawn = [self.touching(self.random_start(rng)) for _ in range(draws)]
        return self.repair(min(drawn, key=self.shortfall))

    def _contacts(self, X: Array) -> Array:
        """What equations, opposed normals and bounds miss, for each X."""
        bounds = np.array([np.minimum(self.system.slack(x), 0.0) for x in X]).reshape(len(X), -1)
        arrays = self.system.grasp_arrays(X)
        normals = (arrays["hand_normals"] + arrays["object_normals"]).reshape(len(X), -1)
        return np.hstack([self.equations(X), normals, bounds])

    def touching(self, x: Array) -> Array:
        """Least squares of what contacts and bounds miss."""
        return self._least_squares(x, self._contacts, SMALL)

    def repair(self, x: Array, rounds: int = 3) -> Array:
        """Least squares of what contacts, bounds and requirements miss."""
        for _ in range(rounds):
            if not self.requirements or self.shortfall(x) < 1e-9:
                break
            watched = self.watched(x)

            def missed(X: Array, watched: list[Array] = watched) -> Array:
                short = np.hstack([self.slacks(X), self.distances(X, watched)]) - 1e-3
                return np.hstack([self._contacts(X), np.minimum(short, 0.0)])

            x = self._least_squares(x, missed, LARGE)
        return x

    def _least_squares(self, x: Array, function: Callable[[Array], Array], step: float) -> Array:
        at, slopes = self._of_steps(x, function, step)
        found = least_squares(at, np.zeros(self.system.tangent_size), slopes, method="trf", max_nfev=30, ftol=1e-4)
        return np.array(self.system.integrate(x, found.x))

    def project(self, x: Array) -> Array:
        """Newton's method with least-norm steps."""
        for _ in range(10):
            residual = self.system.evaluate_residual(x)
            if not np.isfinite(residual).all() or np.abs(residual).max() < 1e-13:
                break
            x = np.array(self.system.integrate(x, -np.linalg.lstsq(self.system.evaluate_jacobian(x), residual)[0]))
        return x

    # Climbs.

    def shortfall(self, x: Array) -> float:
        """By how much the equation or requirement that is missed most is."""
        missed = np.hstack([self.slacks(x[None]), self.distances(x[None], self.watched(x))])[0]
        return float(max(np.abs(self.equations(x[None])).max(), -missed.min(initial=0.0)))

    def climb(self, x: Array, programmes: int = PROGRAMMES) -> tuple[Array, float] | None:
        """The grasp at which programmes end that is best by the index; None where none of them ends at a grasp."""
        best = (x, float(self.index(x[None])[0])) if self.accepted(x) else None
        for room in ROOMS:
            last, ok = np.inf, False
            for run in range(programmes):
                if run == HOPELESS and best is None and self.shortfall(x) > SHORT:
                    return None
                y = self.project(self._programme(x, room))
                if not np.isfinite(y).all() or np.abs(self.system.evaluate_residual(y)).max() > 1e-9:
                    break
                x = y
                value = float(self.index(x[None])[0])
                ok = self.accepted(x)
                if ok and (best is None or value > best[1]):
                    best = x, value
                if value > 0.0 and abs(np.log(value) - last) < 1e-7:
                    break
                last = np.log(max(value, 1e-300))
            if best is not None and ok:
                break
        return best

    def _programme(self, x: Array, room: float) -> Array:
        """One run of SLSQP, in a box round x, with the pairs that are nearest there."""
        watched = self.watched(x)

        def lost(X: Array) -> Array:
            return -np.log(np.maximum(self.index(X), 1e-12))[:, None]

        f, f_slopes = self._of_steps(x, lost, SMALL)
        e, e_slopes = self._of_steps(x, self.equations, SMALL)
        s, s_slopes = self._of_steps(x, lambda X: self.slacks(X) - ROOMS[0], SMALL)
        d, d_slopes = self._of_steps(x, lambda X: self.distances(X, watched) - room, LARGE)
        n = self.system.tangent_size
        constraints = [
            {"type": "eq", "fun": e, "jac": e_slopes},
            {"type": "ineq", "fun": s, "jac": s_slopes},
        ]
        if watched:
            constraints.append({"type": "ineq", "fun": d, "jac": d_slopes})
        found = minimize(
            lambda v: float(f(v)[0]),
            np.zeros(n),
            jac=lambda v: f_slopes(v)[0],
            method="SLSQP",
            bounds=[(-BOX, BOX)] * n,
            constraints=constraints,
            options={"maxiter": 40, "ftol": 1e-9},
        )
        return np.array(self.system.integrate(x, np.nan_to_num(found.x)))

    def _of_steps(
        self, x: Array, function: Callable[[Array], Array], step: float
    ) -> tuple[Callable[[Array], Array], Callable[[Array], Array]]:
        """A function of configurations as one of steps from x, and its slopes by central differences."""
        n = self.system.tangent_size
        sides = np.vstack([step * np.eye(n), -step * np.eye(n)])

        def values(V: Array) -> Array:
            return np.nan_to_num(function(np.array([self.system.integrate(x, v) for v in V])), posinf=1e6, neginf=-1e6)

        def slopes(v: Array) -> Array:
            F = values(v + sides)
            return (F[:n] - F[n:]).T / (2.0 * step)

        return lambda v: values(np.asarray(v)[None])[0], slopes
