"""The walk of a hand away from the object: outwards in small steps, each checked, as far as asked or as can be."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from graspatlas.collision.checker import CollisionChecker, collision_checker
from graspatlas.execution.withdrawal import Withdrawal
from graspatlas.problem.problem import Problem
from graspatlas.support.arrays import Array, BoolArray, IndexArray

__all__ = ["Obstacle", "Walk", "is_there", "walk_outwards"]

#: How far a contact point may be from where a step of the walk wants it [m], and as a share of the distance.
TOLERANCE, SHARE = 1e-4, 0.05
#: A step of the walk, at most [m], and how many there are at least.
STEP, FEWEST_STEPS = 1e-3, 4
#: How often the step that fails is halved, to find out how far one can go.
HALVINGS = 6
#: Where joints couple contacts, others may be this many times as far off as the nearest one.
MOST_UNEQUAL, SCALINGS = 2.0, 3
#: Shapes that cut each other at the grasp may get nearer by this, which is rounding [m].
NO_NEARER = 1e-6


@dataclass(frozen=True, eq=False)
class Obstacle:
    """What ended a walk.

    Attributes:
        pair: Names of the shapes that would collide; None where the contact points cannot get there.
        z: Where the joints would have been (d,).
        target: How far off the contact points were to be [m]; 0 when it was there at the grasp.
        distances: How far off they would have been (m,), metres.
    """

    pair: tuple[str, str] | None
    z: Array
    target: float
    distances: Array


@dataclass(frozen=True, eq=False)
class Walk:
    """The walk from one grasp.

    Attributes:
        X: The grasp, then with the hand as it was after each step (k, configuration_size).
        distances: How far each contact point is off the object along its normal (k, m), metres.
        obstacle: What ended it; None when it got as far as asked.
    """

    X: Array
    distances: Array
    obstacle: Obstacle | None


def is_there(distances: Array, targets: Array | float) -> BoolArray:
    """Whether all contact points of grasps (n, m) are as far off as they shall be (n,), metres."""
    return np.asarray(distances.min(axis=1) >= targets - np.minimum(TOLERANCE, SHARE * np.asarray(targets)))


class _Walkers:
    """All walks at once: what each has gone through, and what ended it."""

    def __init__(self, withdrawal: Withdrawal, X: Array, checkers: tuple[CollisionChecker, CollisionChecker]) -> None:
        self._withdrawal, self._X, (self._on_way, self._at_end) = withdrawal, X, checkers
        start = withdrawal.distances(withdrawal.z0, np.arange(len(X)))
        self.steps = [[(0.0, z, d)] for z, d in zip(withdrawal.z0, start, strict=True)]
        self.obstacles: list[Obstacle | None] = [None] * len(X)
        self._least = {int(i): self._depths(X[i]) for i in np.flatnonzero(~self._on_way.free(X))}

    def go(self, distance: float) -> None:
        """Walk as far as asked, or as can be."""
        count = max(FEWEST_STEPS, int(np.ceil(distance / STEP)))
        alive, failed = np.arange(len(self._X)), np.full(len(self._X), np.inf)
        for target in np.linspace(0.0, distance, count + 1)[1:]:
            taken = self._step(alive, np.full(len(alive), target))
            failed[alive[~taken]] = target
            alive = alive[taken]
        stopped = np.flatnonzero(np.isfinite(failed))
        for _ in range(HALVINGS if len(stopped) else 0):
            middle = 0.5 * (failed[stopped] + [self.steps[i][-1][0] for i in stopped])
            taken = self._step(stopped, middle)
            failed[stopped[~taken]] = middle[~taken]
        self._end()

    def walk(self, i: int) -> Walk:
        """What became of one."""
        z = np.array([z for _, z, _ in self.steps[i]])
        X = self._withdrawal.at(z, np.full(len(z), i))
        X[0] = self._X[i]  # the grasp itself, to the last bit
        return Walk(X, np.array([distances for *_, distances in self.steps[i]]), self.obstacles[i])

    def _step(self, rows: IndexArray, targets: Array) -> BoolArray:
        """Take a step to targets (k,), where that can be; whether each was taken (k,)."""
        if len(rows) == 0:
            return np.zeros(0, bool)
        before = np.array([self.steps[i][-1][1] for i in rows])
        distances_before = np.array([self.steps[i][-1][2] for i in rows])
        z, distances = self._withdrawn(before, targets, rows)
        there = is_there(distances, targets) & (distances.max(axis=1) <= MOST_UNEQUAL * targets)
        there &= (distances > distances_before).all(axis=1)
        X = self._withdrawal.at(z, rows)
        free = self._free(X, rows)
        for k, i in enumerate(rows):
            if there[k] and free[k]:
                self.steps[i].append((float(targets[k]), z[k], distances[k]))
            else:
                pair = self._hit(X[k], i) if there[k] else None
                self.obstacles[i] = Obstacle(pair, z[k], float(targets[k]), distances[k])
        return np.asarray(there & free)

    def _withdrawn(self, z: Array, targets: Array, rows: IndexArray) -> tuple[Array, Array]:
        """Where all contact points are as far off as asked; where joints couple them, at least as far off."""
        found, distances = self._withdrawal.solve(z, targets, rows)
        scaled = targets.copy()
        for _ in range(SCALINGS):
            least = distances.min(axis=1)
            short = np.flatnonzero(~is_there(distances, targets) & (least > 0.0))
            if len(short) == 0:
                break
            scaled[short] *= np.minimum(targets[short] / least[short], MOST_UNEQUAL)
            scaled = np.minimum(scaled, MOST_UNEQUAL * targets)
            found[short], distances[short] = self._withdrawal.solve(found[short], scaled[short], rows[short])
        return found, distances

    def _free(self, X: Array, rows: IndexArray) -> BoolArray:
        """Whether each is free of collision (k,), or no deeper in what its grasp is in already."""
        free = self._on_way.free(X)
        for k in np.flatnonzero(~free):
            if rows[k] in self._least:
                free[k] = bool((self._on_way.clearances(X[k][None])[0] >= self._least[rows[k]]).all())
        return free

    def _depths(self, x: Array) -> Array:
        """The clearances that pairs of shapes may have, where the grasp has less than it must: its own."""
        return np.asarray(np.minimum(0.0, self._on_way.clearances(x[None])[0]) - NO_NEARER)

    def _hit(self, x: Array, i: int) -> tuple[str, str] | None:
        if i not in self._least:
            return self._on_way.first_collision(x)
        nearer = self._on_way.clearances(x[None])[0] - self._least[i]
        return self._on_way.pairs[int(np.argmin(np.where(np.isnan(nearer), -np.inf, nearer)))]

    def _end(self) -> None:
        """Walks end where nothing touches; if that is nowhere, they do not begin."""
        last = np.array([steps[-1][1] for steps in self.steps])
        X = self._withdrawal.at(last, np.arange(len(last)))
        for i in np.flatnonzero(~self._at_end.free(X)):
            steps = self.steps[i]
            way = self._withdrawal.at(np.array([z for _, z, _ in steps]), np.full(len(steps), i))
            clear = np.flatnonzero(self._at_end.free(way))
            target, z, distances = steps[-1]
            if len(clear) == 0 and (i in self._least or self.obstacles[i] is None):
                within = self._on_way.first_collision(self._X[i]) or self._at_end.first_collision(X[i])
                self.obstacles[i] = Obstacle(within, steps[0][1], 0.0, steps[0][2])
            elif self.obstacles[i] is None:
                self.obstacles[i] = Obstacle(self._at_end.first_collision(X[i]), z, target, distances)
            del steps[(clear[-1] if len(clear) else 0) + 1 :]


def walk_outwards(
    problem: Problem, X: Array, distance: float, touch_depth: float, clearance: float
) -> tuple[Withdrawal, list[Walk]]:
    """Walk away from some grasps, until all contact points are off the object by a distance.

    On the way links that touch may sink into the object by `touch_depth`, as at the grasp; at the end nothing touches.

    Args:
        problem: The problem.
        X: The grasps (n, configuration_size).
        distance: How far [m].
        touch_depth: As of :class:`graspatlas.CollisionFree` [m].
        clearance: As of :class:`graspatlas.CollisionFree` [m].

    Returns:
        The withdrawal that was walked along, and one walk a grasp.

    Raises:
        GraspAtlasError: If hand or object has no collision shape.
    """
    checkers = collision_checker(problem, touch_depth, clearance), collision_checker(problem, 0.0, clearance)
    withdrawal = Withdrawal(problem, X)
    walkers = _Walkers(withdrawal, X, checkers)
    walkers.go(distance)
    return withdrawal, [walkers.walk(i) for i in range(len(X))]
