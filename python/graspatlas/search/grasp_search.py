"""Feasible grasps found from nothing but hand, object, patches and limits: where a first grasp comes from.

Each try starts at a random configuration that nearly touches, see :mod:`graspatlas.search.random_starts`, and lets
:func:`~graspatlas.systems.projection.project` close what gaps are left. Where the problem guesses the object's pose,
the tries at a first grasp start near that, see :mod:`graspatlas.search.starts_near_guess`.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from graspatlas import _core
from graspatlas.errors import GraspAtlasError
from graspatlas.problem.problem import Problem
from graspatlas.search.random_starts import Starts
from graspatlas.search.starts_near_guess import starts_near
from graspatlas.support.arrays import Array, BoolArray
from graspatlas.support.deadlines import deadline_after
from graspatlas.support.interrupts import stoppable
from graspatlas.support.progress import ProgressBar, progress_bar
from graspatlas.support.validation import whole

__all__ = ["MAX_TRIES", "GraspSearch", "can_grow", "find_grasps", "with_first_grasp"]

#: Starts in a row without a new grasp after which a search is given up: about half a minute.
MAX_TRIES = 20_000
#: Two grasps are one when their embeddings are nearer than this [units of the tangent space].
SAME = 1e-6
#: Grasps in a row from which no atlas can grow; then the equations are redundant everywhere, and the atlas says so.
MAX_SINGULAR = 50
#: A chart of this radius is laid at a grasp to see whether an atlas can grow there.
TRIAL_RADIUS, TRIAL_EPSILON = 1e-2, 0.5


@stoppable()
def find_grasps(
    problem: Problem,
    *,
    count: int = 1,
    dimension: int | None = None,
    seed: int = 0,
    max_seconds: float | None = None,
    progress: bool | None = None,
) -> Array:
    """Find feasible grasps of a problem; its x1 plays no part, but the reference posture does.

    The first is sought near the problem's ``pose_guess``, if it has one and no x1.

    The search ends early after 20,000 tries without a new grasp. Ctrl-C ends it too, and returns what there is.

    Args:
        problem: The problem.
        count: How many different grasps to find.
        dimension: k, of the relevant grasps R to search: hand motions are frozen at the problem's reference posture, eq
            (13). All feasible grasps F by default, couplings kept.
        seed: Of the random numbers: the same seed finds the same grasps.
        max_seconds: Time after which the search is cut short; none by default.
        progress: Show a progress bar on standard error; by default when it is a terminal.

    Returns:
        The grasps, one a row (n, size of x), all with ``|R(x)|`` of at most 1e-9 and within all bounds; n is smaller
        than `count`, perhaps 0, when the search ended early.

    Raises:
        GraspAtlasError: If an argument is out of its range.
    """
    whole(count, "count")
    if not isinstance(problem, Problem):
        raise GraspAtlasError(f"problem must be a graspatlas.Problem, got {type(problem).__name__}; see load_problem")
    search = GraspSearch(problem, problem.largest_dimension if dimension is None else dimension, seed)
    deadline, last_new = deadline_after(max_seconds), 0
    found: list[Array] = []
    places: list[Array] = []
    with progress_bar("tries", progress=progress) as bar:
        try:
            while len(found) < count:
                x = search.next_grasp(deadline, bar)
                if x is None or search.tries - last_new > MAX_TRIES:
                    break
                place = search.system.embed(x)
                if not places or np.linalg.norm(np.array(places) - place, axis=1).min() > SAME:
                    found.append(x)
                    places.append(place)
                    last_new = search.tries
                    bar.note(f"grasps={len(found)}")
        except KeyboardInterrupt:
            if bar.shown:
                bar.write(f"interrupted: keeping {len(found)} grasps")
    return np.array(found).reshape(len(found), search.system.configuration_size)


def with_first_grasp(
    problem: Problem, dimension: int, max_seconds: float | None = None, progress: bool | None = None
) -> Problem:
    """The problem itself when it has an x1, or else with one that is found, the same at every call.

    Raises:
        GraspAtlasError: If none is found.
    """
    if problem.x1 is not None:
        return problem
    search = GraspSearch(problem, dimension, seed=0)
    with progress_bar("tries at a first grasp", progress=progress) as bar:
        x = search.next_start(deadline_after(max_seconds), bar)
    if x is None:
        raise search.failure()
    return search.problem.at(x)


def can_grow(system: _core.GraspSystem, x: Array) -> bool:
    """Whether an atlas can grow from a grasp: see :meth:`GraspSearch.is_regular`."""
    try:
        _core.AtlasBuilder(system, x, TRIAL_RADIUS, TRIAL_EPSILON, 1)
    except GraspAtlasError:
        return False
    return True


class GraspSearch:
    """Tries at feasible grasps of one problem and dimension, one after another.

    Attributes:
        problem: The problem, with the reference posture stated.
        system: Its system R of that dimension.
        tries: Tries so far.
        found: How many of them gave a grasp.

    Args:
        problem: The problem.
        dimension: k.
        seed: Of the random numbers.
        room: Share of each range, of a joint or of a patch parameter, to keep off either of its ends.

    Raises:
        GraspAtlasError: If the problem has no such dimension, or the reference leaves the hand no posture.
    """

    def __init__(self, problem: Problem, dimension: int, seed: int | Sequence[int], room: float = 0.0) -> None:
        self.system = problem.system(dimension, room=room)
        # Where all feasible grasps are sought the reference is but the middle of the postures that are drawn.
        frozen = problem.frozen_motions(dimension) > 0
        self.problem = replace(problem, reference=problem.reference_posture) if frozen else problem
        self.dimension, self.tries, self.found = dimension, 0, 0
        self._rng = np.random.default_rng(seed)
        self._starts = Starts(self.problem, self.system)
        guess = problem.pose_guess if problem.x1 is None else None
        self._near_guess = starts_near(guess, self._starts, self._rng) if guess else iter(())

    def next_grasp(self, deadline: float, bar: ProgressBar) -> Array | None:
        """The next grasp (size of x,); None after ``MAX_TRIES`` tries without one, or when the clock passes `deadline`.

        Args:
            deadline: Reading of ``time.perf_counter`` [s].
            bar: Progress bar that counts the tries.
        """
        for _ in range(MAX_TRIES):
            if time.perf_counter() > deadline:
                return None
            x = self.attempt()
            bar.update()
            if x is not None:
                return x
        return None

    def next_start(self, deadline: float, bar: ProgressBar) -> Array | None:
        """The next grasp from which an atlas can grow; or a singular one, after ``MAX_SINGULAR`` of these in a row."""
        first = None
        for _ in range(MAX_SINGULAR):
            x = self.next_grasp(deadline, bar)
            if x is None or self.is_regular(x):
                return first if x is None else x
            first = x if first is None else first
        return first

    def is_regular(self, x: Array) -> bool:
        """False for a singular grasp, at which the equations lose rank, or so nearly that it slips across a bound."""
        return can_grow(self.system, x)

    def attempt(self) -> Array | None:
        """One try: a feasible grasp (size of x,), or None."""
        # The first grasp only: what is found later must tell of all grasps, not of those near the guess.
        start = next(self._near_guess, None) if self.found == 0 else None
        found = self._tried((self._starts.draw(self._rng) if start is None else start)[None])
        return found[0] if len(found) else None

    def attempts_near_guess(self) -> Array:
        """All tries near the problem's pose guess, on all cores: the feasible grasps that they gave (n, size of x)."""
        starts = list(self._near_guess)
        return self._tried(np.array(starts).reshape(len(starts), self.system.configuration_size))

    def attempts_at(self, postures: Array, points: Array) -> Array:
        """Tries from postures with the contacts of the object at given points: the feasible grasps (n, size of x).

        Args:
            postures: Joint configurations (n, nq).
            points: Where each contact is on the object, in its frame (n, m, 3) [m].
        """
        starts = [self._starts.at_points(q, p, self._rng) for q, p in zip(postures, points, strict=True)]
        return self._tried(np.array(starts).reshape(len(starts), self.system.configuration_size))

    def attempts(self, count: int) -> Array:
        """So many tries at random, on all cores: the feasible grasps that they gave (n, size of x)."""
        return self._tried(np.array([self._starts.draw(self._rng) for _ in range(count)]))

    def _tried(self, starts: Array) -> Array:
        """The feasible grasps to which starts lead."""
        self.tries += len(starts)
        if not len(starts):
            return starts
        projected, there = _core.project_far(self.system, starts)
        X: Array = np.asarray(projected)[np.asarray(there)]
        X = X[[self._starts.has_posture_of(x) for x in X]] if len(X) else X
        X = X[self._opposed(X)] if len(X) else X
        self.found += len(X)
        return X

    def _opposed(self, X: Array) -> BoolArray:
        """Where the normals oppose (n,); the equations let them be parallel too."""
        arrays = self.system.grasp_arrays(X)
        dots = np.einsum("nmc,nmc->nm", arrays["hand_normals"], arrays["object_normals"])
        return np.asarray(dots.max(axis=1) < 0.0)

    def failure(self) -> GraspAtlasError:
        """What to say when no grasp was found."""
        s = self.problem.frozen_motions(self.dimension)
        hint = "check that the object fits the hand, its patches and the joint limits; or give a pose_guess, or x1"
        if s > 0:
            hint = (
                f"the {s} frozen hand motions may leave none: give a reference posture near a grasp, or let them pass "
                "through one that is found anywhere, with problem.at(graspatlas.find_grasps(problem)[0])"
            )
        return GraspAtlasError(
            f"no feasible grasp of problem '{self.problem.name}' with dimension {self.dimension} was found in "
            f"{self.tries} tries: {hint}"
        )
