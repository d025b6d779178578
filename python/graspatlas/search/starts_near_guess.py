"""Starts of a search for a first grasp near a guess of the object's pose."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from graspatlas.problem.pose_guess import PoseGuess
from graspatlas.search.random_starts import Starts
from graspatlas.support.arrays import Array

__all__ = ["starts_near"]

#: Starts with the object at the guess and the hand in its reference posture, each a little further off.
AT_GUESS = 20
#: How far the last of them is off: share of the size of the hand, and angle [rad].
SHIFT, TURN = 0.15, 0.5
#: Random starts, of which the nearest to the guess are tried.
DRAWN, NEAREST = 1000, 100


def starts_near(guess: PoseGuess, starts: Starts, rng: np.random.Generator) -> Iterator[Array]:
    """Starts near a guess, the nearest first: a few at it, then those of many random ones that come near it.

    A start at the guess is as good as the reference posture, which is seldom one that closes round the object. Random
    starts nearly touch, but lie anywhere: among many some are near the guess.

    Args:
        guess: The guess.
        starts: Where random starts come from.
        rng: Random numbers.

    Yields:
        Starts (configuration_size,).
    """
    from scipy.spatial.transform import Rotation  # slow to import

    for i in range(AT_GUESS):
        far = i / AT_GUESS
        shift = far * SHIFT * starts.hand_size * rng.uniform(-1.0, 1.0, 3)
        turn = Rotation.from_rotvec(far * TURN * rng.uniform(-1.0, 1.0, 3))
        about = Rotation.from_quat(rng.normal(size=4) if guess.quat_xyzw is None else guess.quat_xyzw)
        yield starts.at_pose(np.asarray(guess.xyz) + shift, turn * about, rng)
    drawn = [starts.draw(rng) for _ in range(DRAWN)]
    offsets = np.array([guess.offset(*starts.pose(x)) for x in drawn])
    # A turn by a half is as far off as a shift by the size of the hand.
    order = np.argsort(offsets @ [1.0 / starts.hand_size, 1.0 / np.pi])
    yield from (drawn[i] for i in order[:NEAREST])
