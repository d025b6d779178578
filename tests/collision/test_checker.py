"""Collisions in the core against Pinocchio's and coal's Python, the same in every run and from any thread."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest
from helpers import slow_but
from oracles.collision_oracle import CLEARANCE, DEPTH, DOUBT, Oracle, made_grasps, made_problem

import graspatlas as ga
from graspatlas.collision.checker import CollisionChecker

HANDS = {1: "s", 5: "scbms", 17: "scbmh" * 4, 32: "scbm" * 8, 70: "scbbm" * 14}
#: Shapes of the hand, of the object, and of the fingertip.
CASES = [
    (1, "s", "s"),
    (5, "cb", "b"),
    (5, "m", "h"),
    (17, "scb", "c"),
    (17, "h", "s"),
    (32, "c", "s"),
    (32, "mhsc", "s"),
    (70, "scbms", "m"),
    (70, "b", "s"),
]


@pytest.fixture(
    params=slow_but(CASES, *(case for case in CASES if case[0] < 70)), ids=lambda case: "-".join(map(str, case))
)
def made(request, tmp_path):
    size, kinds, tip = request.param
    return made_problem(tmp_path, HANDS[size][:size], kinds, tip)


def test_flags_and_distances_are_those_of_the_second_route(made):
    oracle, X = Oracle(made), made_grasps(40)
    checker = CollisionChecker(made, DEPTH, CLEARANCE)
    assert checker.pairs == tuple((a.name, b.name) for a, b, _ in oracle.pairs)
    np.testing.assert_allclose(checker.required, [required for *_, required in oracle.pairs])
    expected, flags = (np.array(rows) for rows in zip(*map(oracle.look, X), strict=True))
    meshes = np.array([a.mesh or b.mesh for a, b, _ in oracle.pairs])
    found = checker.nearest(X)
    np.testing.assert_allclose(found.distances[expected > 1e-6], expected[expected > 1e-6], atol=1e-9)
    deep = (expected < 0.0) & ~meshes
    np.testing.assert_allclose(found.distances[deep], expected[deep], atol=DOUBT)
    np.testing.assert_array_equal(checker.clearances(X), found.distances - checker.required)
    sure = (np.abs(expected - checker.required) > DOUBT).all(axis=1)
    assert sure.sum() > 30
    free = checker.free(X)
    np.testing.assert_array_equal(free[sure], ~flags.any(axis=1)[sure])
    if 20 < len(checker.pairs) < 300:
        assert 0 < free.sum() < len(X)
    for x, hit, sure_of_it in zip(X, flags, sure, strict=True):
        if sure_of_it:
            assert checker.first_collision(x) == (checker.pairs[hit.argmax()] if hit.any() else None)


def test_nearest_points_and_normals(made):
    """They lie on the shapes, as far apart as is said, and tell how the distance changes as the object moves."""
    X = made_grasps(30)
    checker, oracle = CollisionChecker(made, DEPTH, CLEARANCE), Oracle(made)
    found = checker.nearest(X)
    meshes = np.array([a.mesh or b.mesh for a, b, _ in oracle.pairs])
    clear = found.distances > 1e-4
    assert clear.any()
    between = found.on_second - found.on_first
    along = found.distances[..., None] * found.normals
    np.testing.assert_allclose(between[clear], along[clear], atol=1e-7)
    np.testing.assert_allclose(np.linalg.norm(found.normals[clear], axis=-1), 1.0, atol=1e-9)
    solid = ~meshes & (found.distances < -1e-5)
    np.testing.assert_allclose(between[solid], along[solid], atol=1e-6)
    of_object = np.array([name.startswith("object/") for _, name in checker.pairs])
    step = 1e-6
    for axis in range(3):
        moved = [checker.nearest(X + sign * step * np.eye(13)[6 + axis]).distances for sign in (1, -1)]
        slopes = (moved[0] - moved[1]) / (2.0 * step)
        smooth = clear & of_object & (np.abs(moved[0] + moved[1] - 2.0 * found.distances) < 1e-10)
        assert smooth.sum() > 0
        # Where faces or edges are parallel the nearest points jump; there are few such places.
        assert np.mean(np.abs(slopes - found.normals[..., axis])[smooth] < 1e-3) > 0.99


def test_a_part_of_the_pairs(tmp_path):
    made = made_problem(tmp_path, HANDS[32], "c")
    checker, X = CollisionChecker(made, DEPTH, CLEARANCE), made_grasps(5)
    chosen = [7, 0, 11]
    part, all_pairs = checker.nearest(X, chosen), checker.nearest(X)
    assert part.pairs == tuple(checker.pairs[i] for i in chosen)
    for name in ("distances", "on_first", "on_second", "normals"):
        np.testing.assert_array_equal(getattr(part, name), getattr(all_pairs, name)[:, chosen])
    with pytest.raises(ga.GraspAtlasError, match=r"pairs must be below \d+, got 9999"):
        checker.nearest(X, [9999])


def test_twenty_runs_give_the_same(made):
    X = made_grasps(100)
    first = CollisionChecker(made, DEPTH, CLEARANCE)
    expected = first.free(X), first.clearances(X[:10])
    for _ in range(19):
        checker = CollisionChecker(made, DEPTH, CLEARANCE)
        np.testing.assert_array_equal(checker.free(X), expected[0])
        np.testing.assert_array_equal(checker.clearances(X[:10]), expected[1])


MANY_RUNS = """
import sys
from pathlib import Path
sys.path.insert(0, {tests!r})
from oracles.collision_oracle import made_problem, touching_grasps
from graspatlas.collision.checker import CollisionChecker
made = made_problem(Path({folder!r}), "scbm" * 8, "c", "h")
X, answers = touching_grasps(made, 300), set()
for _ in range(50):
    answers.add(CollisionChecker(made).free(X).tobytes())
(answer,) = answers
print(sum(answer))
"""


@pytest.mark.slow
def test_a_hundred_runs_with_32_shapes_give_one_answer(tmp_path):
    """In processes of their own, which faults in memory would end; one fills memory that is given back with rubbish.

    That one gives none back to the system, which would return it as zeros, and a page at a time.
    """
    code, counts = MANY_RUNS.format(tests=str(Path(__file__).parents[1]), folder=str(tmp_path)), set()
    rubbish = {"MALLOC_PERTURB_": "85", "MALLOC_MMAP_MAX_": "0", "MALLOC_TRIM_THRESHOLD_": str(2**40)}
    for malloc in ({}, rubbish):
        environment = {**os.environ, **malloc}
        found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment)
        assert found.returncode == 0, found.stderr
        counts.add(int(found.stdout))
    assert len(counts) == 1
    assert 30 < counts.pop() < 270


def test_answers_do_not_depend_on_threads_or_on_what_was_asked_before(tmp_path):
    made = made_problem(tmp_path, HANDS[70], "cbs", "m")
    X = made_grasps(400)
    checker = CollisionChecker(made, DEPTH, CLEARANCE)
    flags, gaps = checker.free(X), checker.clearances(X[:40])
    one_by_one = np.array([checker.free(x[None])[0] for x in X[::-1]])[::-1]
    np.testing.assert_array_equal(one_by_one, flags)
    found = []

    def ask(seed):
        order = np.random.default_rng(seed).permutation(len(X))
        free = np.empty(len(X), bool)
        free[order] = checker.free(X[order])
        found.append((free, checker.clearances(X[:40])))

    users = [threading.Thread(target=ask, args=(seed,)) for seed in range(6)]
    for user in users:
        user.start()
    for user in users:
        user.join()
    assert len(found) == 6
    for free, clearances in found:
        np.testing.assert_array_equal(free, flags)
        np.testing.assert_array_equal(clearances, gaps)


@pytest.mark.parametrize(
    ("X", "message"),
    [
        (np.zeros(13), "at least 13 columns"),
        (np.zeros((2, 12)), "at least 13 columns"),
        (np.full((1, 13), np.nan), "finite"),
    ],
)
def test_grasps_that_make_no_sense(X, message, tmp_path):
    checker = CollisionChecker(made_problem(tmp_path, "s", "s"))
    for ask in (checker.free, checker.clearances, checker.nearest):
        with pytest.raises(ga.GraspAtlasError, match=message):
            ask(X)


@pytest.mark.parametrize(
    ("srdf", "message"),
    [("<robot", "is not XML"), ('<robot><disable_collisions link1="palm"/></robot>', "has no 'link2'")],
)
def test_an_srdf_that_cannot_be_read(srdf, message, tmp_path):
    made = made_problem(tmp_path, HANDS[5], "s")
    made.hand = ga.Hand("made", made.hand.urdf, srdf=srdf)
    with pytest.raises(ga.GraspAtlasError, match=message):
        CollisionChecker(made)


def test_pairs_that_an_srdf_lists_may_touch(tmp_path):
    made = made_problem(tmp_path, HANDS[32], "s")
    made.hand = ga.Hand("made", made.hand.urdf, srdf="<robot/>")
    everything = CollisionChecker(made).pairs
    links = '<disable_collisions link1="b1" link2="a0"/><disable_collisions link1="b1" link2="nowhere"/>'
    made.hand = ga.Hand("made", made.hand.urdf, srdf=f"<robot>{links}</robot>")
    left = {tuple(name.rpartition("_")[0] for name in pair) for pair in CollisionChecker(made).pairs}
    all_links = {tuple(name.rpartition("_")[0] for name in pair) for pair in everything}
    assert ("palm", "a0") in all_links
    assert all_links - left == {("a0", "b1")}
