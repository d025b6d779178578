"""Guesses of the object's pose: starts near them, and wrong ones."""

from __future__ import annotations

import json
import re
from dataclasses import replace

import numpy as np
import pytest
from helpers import tripod_problem
from scipy.spatial.transform import Rotation

import graspatlas as ga
from graspatlas.commands.diagnosis import diagnose
from graspatlas.search import GraspSearch
from graspatlas.search.random_starts import Starts
from graspatlas.search.starts_near_guess import starts_near

PROBLEMS = ("planar_hand", "schunk_can", "schunk_oil_bottle")


def guessed(name: str, *, rotation: bool = True, reference: bool = True) -> ga.Problem:
    """A bundled problem without its x1, and as a guess the object 5 mm and 0.1 rad from where x1 has it."""
    problem = ga.load_problem(name)
    turn = Rotation.from_rotvec([0.0, 0.0, 0.1]) * Rotation.from_quat(problem.x1.object_quat_xyzw)
    x, y, z = problem.x1.object_xyz
    guess = ga.PoseGuess((x + 0.005, y, z), tuple(turn.as_quat()) if rotation else None)
    return replace(problem, x1=None, reference=problem.x1.joints if reference else None, pose_guess=guess)


def tries_until_near(problem: ga.Problem, guess: ga.PoseGuess, seed: int, dimension: int) -> int:
    """Tries until a grasp is found that is 3 cm from a guess at most, and turned by 0.6 rad."""
    search = GraspSearch(problem, dimension, seed)
    while search.tries < 3000:
        x = search.attempt()
        if x is not None:
            distance, angle = guess.offset(*search._starts.pose(x))
            if distance < 0.03 and angle < 0.6:
                break
    return search.tries


@pytest.mark.parametrize(
    ("name", "rotation"),
    [
        ("schunk_can", True),
        ("schunk_oil_bottle", True),
        ("planar_hand", True),
        ("allegro_cylinder_3", True),
        ("schunk_can", False),
    ],
)
def test_a_guess_saves_tries(name, rotation):
    problem = guessed(name, rotation=rotation)
    guess, bare = problem.pose_guess, replace(problem, pose_guess=None)
    k = problem.defaults["dimension"]
    with_guess, without = ([tries_until_near(p, guess, seed, k) for seed in range(5)] for p in (problem, bare))
    assert max(with_guess) <= 20  # as many starts have the object at the guess
    assert np.mean(with_guess) < 0.5 * np.mean(without)


def test_a_guess_without_a_reference_posture_saves_tries():
    """Only the nearest of many random starts help, where the posture is not known at all."""
    problem = guessed("schunk_can", reference=False)
    bare = replace(problem, pose_guess=None)
    counts = ([tries_until_near(p, problem.pose_guess, seed, 2) for seed in range(5)] for p in (problem, bare))
    with_guess, without = map(np.mean, counts)
    assert with_guess < 0.5 * without


def test_a_wrong_guess_finds_a_grasp_all_the_same():
    problem = replace(guessed("schunk_can"), pose_guess=ga.PoseGuess((5.0, -3.0, 9.0)))
    x = ga.find_grasps(problem, dimension=2)
    assert np.abs(problem.full_system.evaluate_residual(x[0])).max() < 1e-9


def test_starts_near_a_guess_lie_within_the_bounds():
    for made in (guessed("planar_hand"), guessed("schunk_can"), tripod_problem(rolling=True)):
        problem = replace(made, x1=None, pose_guess=made.pose_guess or ga.PoseGuess((0.0, 0.02, 0.01)))
        starts = Starts(problem, problem.full_system)
        X = list(starts_near(problem.pose_guess, starts, np.random.default_rng(0)))
        assert len(X) == 120
        assert min(problem.full_system.slack(x).min() for x in X) > -1e-9
        distance, angle = problem.pose_guess.offset(*starts.pose(X[0]))  # the first is the guess itself
        assert distance == pytest.approx(0.0, abs=1e-12)
        assert angle == pytest.approx(0.0, abs=1e-7)


def test_only_the_first_grasp_is_sought_near_the_guess(monkeypatch):
    """Other grasps are found as without a guess, and x1 is as good as one."""
    yielded = []
    near = starts_near
    monkeypatch.setattr(
        "graspatlas.search.grasp_search.starts_near", lambda *a: map(lambda x: yielded.append(x) or x, near(*a))
    )
    assert len(ga.find_grasps(guessed("schunk_can"), count=5)) == 5
    used = len(yielded)
    assert 0 < used <= 20
    problem = replace(ga.load_problem("schunk_can"), pose_guess=ga.PoseGuess((0.0, 0.0, 0.1)))
    assert len(ga.find_grasps(problem, count=2)) == 2
    assert len(yielded) == used


def test_guesses_are_kept_with_the_problem(tmp_path):
    for problem in (guessed("schunk_can"), guessed("planar_hand", rotation=False)):
        table = json.loads(json.dumps(problem.to_dict()))
        assert ga.Problem.from_dict(table).pose_guess == problem.pose_guess
        (tmp_path / "guessed.json").write_text(json.dumps(table))
        assert ga.load_problem(tmp_path / "guessed.json").to_dict() == problem.to_dict()
    found = next(one for one in diagnose(guessed("schunk_can")) if one.subject == "first grasp")
    assert re.search(r"found, [\d.]+ mm from the pose guess and turned by [\d.]+ degrees", found.text)


@pytest.mark.parametrize(
    ("guess", "words"),
    [
        (((0.0, 0.0), None), "xyz of the pose guess must be 3 finite"),
        (((0.0, 0.0, np.nan), None), "3 finite"),
        (((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0)), "pose guess has a quaternion of length zero"),
        (((0.0, 0.0, 0.0), (0.0, 0.0, 1.0)), "pose guess needs a quaternion of 4"),
        (((0.0, 0.0, 0.0), "none"), "array of numbers"),
    ],
)
def test_wrong_guesses(guess, words):
    with pytest.raises(ga.GraspAtlasError, match=words):
        ga.PoseGuess(*guess)


def test_guesses_of_planar_problems_lie_in_the_plane():
    for guess in (ga.PoseGuess((0.0, 0.0, 0.1)), ga.PoseGuess((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))):
        with pytest.raises(ga.GraspAtlasError, match="x-y plane"):
            replace(guessed("planar_hand"), pose_guess=guess)
    with pytest.raises(ga.GraspAtlasError, match="pose_guess must be a PoseGuess"):
        replace(guessed("planar_hand"), pose_guess=(0.0, 0.0, 0.0))
