"""Feasible grasps from nothing but hand, object, patches and limits; problems without a first grasp."""

from __future__ import annotations

import copy
import json
import re
import time
from dataclasses import replace
from importlib import import_module

import numpy as np
import pytest
from helpers import PythonSphere, Written, tripod_problem
from scipy.spatial.transform import Rotation

import graspatlas as ga
from graspatlas.commands.diagnosis import diagnose
from graspatlas.search import GraspSearch
from graspatlas.search.random_starts import Starts, _best_motion
from graspatlas.search.starts_near_guess import starts_near

#: The module, which its package has a function named after.
SEARCH = import_module("graspatlas.search.find_grasps")
PROBLEMS = ("planar_hand", "schunk_can", "schunk_oil_bottle")


def without_x1(name: str) -> ga.Problem:
    """A bundled problem without its x1; the hand motions pass where they did."""
    problem = ga.load_problem(name)
    return replace(problem, x1=None, reference=problem.x1.joints)


# Projection ---------------------------------------------------------------------------------------


def test_projection_from_afar():
    rng = np.random.default_rng(0)
    sphere = ga.systems.Sphere(4)
    for _ in range(20):
        x = ga.project(sphere, 5.0 * rng.normal(size=4))
        assert np.linalg.norm(x) == pytest.approx(1.0, abs=1e-8)


def test_projection_ends_within_the_bounds():
    """The nearest point of the sphere is outside; so is every point but those of a cap."""
    cap = PythonSphere(3, lower=[-np.inf, -np.inf, 0.9])
    x = ga.project(cap, [2.0, 1.0, -0.5])
    assert np.linalg.norm(x) == pytest.approx(1.0, abs=1e-8)
    assert x[2] > 0.9


@pytest.mark.parametrize(
    "system",
    [
        Written(2, 1, lambda x: np.array([x @ x + 1.0]), lambda x: 2.0 * x[None]),
        Written(2, 1, lambda x: np.array([np.nan]), lambda x: np.ones((1, 2))),
        PythonSphere(2, lower=[1.5, -np.inf]),
    ],
    ids=["no solution", "NaN", "none within the bounds"],
)
def test_projection_gives_up(system):
    assert ga.project(system, [0.3, 0.4]) is None


@pytest.mark.parametrize(
    ("x", "words"),
    [([1.0, 2.0], "3 numbers"), ([[1.0, 2.0, 3.0]], "3 numbers"), ([1.0, np.nan, 0.0], "finite"), ("here", "numbers")],
)
def test_points_are_checked(sphere, x, words):
    with pytest.raises(ga.GraspAtlasError, match=words):
        ga.project(sphere.system, x)
    with pytest.raises(ga.GraspAtlasError, match=words):
        sphere.locate(x)


# Looking grasps up --------------------------------------------------------------------------------


def test_locate_refuses_a_point_off_the_manifold(sphere):
    with pytest.raises(ga.GraspAtlasError, match=r"entry of 0\.\d+,.*graspatlas.project"):
        sphere.locate([0.0, 0.0, 1.1])
    assert sphere.locate(ga.project(sphere.system, [0.0, 0.0, 1.1]))[1] == 0.0


def test_locate_tells_near_sheets_apart():
    """Two planes nearer to each other than epsilon and than a chart is wide."""
    h = 0.1
    sheets = Written(3, 1, lambda x: np.array([x[2] ** 2 - h**2]), lambda x: np.array([[0.0, 0.0, 2.0 * x[2]]]))
    atlas = ga.build_atlas(sheets, [0.0, 0.0, h], radius=0.2, epsilon=0.5, max_charts=60)
    assert atlas.locate([0.05, 0.02, h])[1] == 0.0
    assert atlas.locate([0.05, 0.02, -h]) == (-1, np.inf)


def test_locate_does_not_overlook_frozen_motions(can, can_result):
    """A feasible grasp that has the kept motions and the object of a chart, and other frozen ones, is not covered."""
    x = can_result.atlas.centers[100]
    J = can.full_system.evaluate_jacobian(x)
    frozen = can.motions.reordered(can.hand.joints).frozen(6)
    tangents = np.linalg.svd(J)[2][len(J) :]
    # The feasible direction that is most along the frozen motions.
    along = np.linalg.svd(tangents[:, :13] @ frozen, full_matrices=False)[0][:, 0] @ tangents
    moved = ga.project(can.full_system, can.full_system.integrate(x, 0.1 * along))
    assert np.abs(can.frozen_residual(moved, 2)).max() > 0.02
    assert can_result.atlas.locate(x)[1] == 0.0
    assert can_result.atlas.locate(moved) == (-1, np.inf)


# Starts -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("d", [2, 3])
def test_best_motion_is_found_again(d):
    rng = np.random.default_rng(1)
    for n in (d, d + 4):  # d points leave a reflection open
        R = Rotation.random(random_state=rng).as_matrix() if d == 3 else np.array([[0.6, -0.8], [0.8, 0.6]])
        t, points = rng.normal(size=d), rng.normal(size=(n, d))
        found_R, found_t = _best_motion(points, points @ R.T + t)
        np.testing.assert_allclose(found_R, R, atol=1e-12)
        np.testing.assert_allclose(found_t, t, atol=1e-12)
        assert np.linalg.det(_best_motion(points, -points)[0]) == pytest.approx(1.0)


@pytest.mark.parametrize("name", PROBLEMS)
def test_starts_lie_within_the_limits_and_in_the_slice(name):
    problem, rng = without_x1(name), np.random.default_rng(2)
    system = problem.system(2)
    starts = Starts(problem, system)
    X = np.array([starts.draw(rng) for _ in range(300)])
    assert min(system.slack(x).min() for x in X) > -1e-9
    assert all(starts.has_posture_of(x) for x in X)
    if name != "planar_hand":  # whose joints have no limits, and turn more than once with the frozen motion
        assert np.abs(problem.frozen_residual(X, 2)).max() < 1e-9
    # The walk leaves the reference: it comes near a limit on every side that it can reach.
    nq = problem.hand.model.hand_q_size
    assert (np.ptp(X[:, :nq], axis=0) > 0.1).sum() >= 5


# Grasps that are found ----------------------------------------------------------------------------


@pytest.mark.parametrize("name", PROBLEMS)
@pytest.mark.parametrize("k", [1, 2, 3, None])
def test_grasps_that_are_found_are_feasible(name, k):
    problem = without_x1(name)
    X = ga.find_grasps(problem, count=10, dimension=k, seed=3)
    assert len(X) == 10
    system, t = problem.full_system, problem.full_dimension
    assert max(np.abs(system.evaluate_residual(x)).max() for x in X) <= 1e-9
    assert min(system.slack(x).min() for x in X) >= 0.0
    assert np.abs(problem.frozen_residual(X, k or t)).max(initial=0.0) < 1e-9
    arrays = system.grasp_arrays(X)
    assert np.einsum("nmc,nmc->nm", arrays["hand_normals"], arrays["object_normals"]).max() < -1.0 + 1e-9
    assert np.linalg.norm(arrays["hand_points"] - arrays["object_points"], axis=2).max() < 1e-9
    apart = [np.linalg.norm(system.difference(a, b)) for i, a in enumerate(X) for b in X[:i]]
    assert min(apart) > 1e-6


def test_the_seed_decides():
    problem = without_x1("schunk_can")
    first, again, other = (ga.find_grasps(problem, count=3, dimension=2, seed=seed) for seed in (4, 4, 5))
    np.testing.assert_array_equal(first, again)
    assert np.abs(first - other).max() > 1e-3


def test_grasps_of_other_hands_and_patches():
    """Planes that have no end, on both sides; continuous joints."""
    for made in (tripod_problem(), tripod_problem(rolling=True), tripod_problem(kinds="continuous")):
        problem = replace(made, x1=None, reference=made.x1.joints)
        X = ga.find_grasps(problem, count=3)
        assert len(X) == 3
        np.testing.assert_allclose(problem.at(X[0]).x1_array, X[0], atol=1e-12)


def test_search_is_cut_short():
    start = time.perf_counter()
    X = ga.find_grasps(without_x1("schunk_can"), count=10**6, max_seconds=0.5)
    assert 0 < len(X) < 10**6
    assert time.perf_counter() - start < 5.0


def test_interrupted_search_keeps_its_grasps(monkeypatch):
    attempt = GraspSearch.attempt

    def interrupted(self):
        if self.found == 3:
            raise KeyboardInterrupt
        return attempt(self)

    monkeypatch.setattr(GraspSearch, "attempt", interrupted)
    assert ga.find_grasps(without_x1("schunk_can"), count=100).shape == (3, 24)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"count": 0}, "count"),
        ({"count": 1.5}, "count"),
        ({"dimension": 0}, "dimension"),
        ({"dimension": 9}, "dimension"),
        ({"max_seconds": -1.0}, "max_seconds"),
        ({"max_seconds": "long"}, "max_seconds"),
    ],
)
def test_misuse(options, words):
    with pytest.raises(ga.GraspAtlasError, match=words):
        ga.find_grasps(without_x1("schunk_can"), **options)


def test_a_problem_is_needed():
    with pytest.raises(ga.GraspAtlasError, match="load_problem"):
        ga.find_grasps("schunk_can")


# Problems without x1 ------------------------------------------------------------------------------


def huge_can() -> ga.Problem:
    """A can two metres wide, to be held on all sides."""
    problem = without_x1("schunk_can")
    contacts = [
        replace(contact, object=replace(contact.object, radius=1.0), frozen={"u": angle})
        for contact, angle in zip(problem.contacts, (-2.1, 0.0, 2.1), strict=True)
    ]
    return replace(problem, contacts=tuple(contacts))


def test_no_feasible_grasp(monkeypatch):
    """An object far too large for the hand: one error that says what to do, after tries or seconds."""
    start = time.perf_counter()
    for run in (ga.optimize, ga.find_components):
        with pytest.raises(ga.GraspAtlasError, match=r"no feasible grasp .*'schunk_can'.* tries: .*reference"):
            run(huge_can(), max_seconds=1.0)
    assert time.perf_counter() - start < 15.0
    monkeypatch.setattr(SEARCH, "MAX_TRIES", 50)
    with pytest.raises(ga.GraspAtlasError, match=r"dimension 7 .* 50 tries: check that the object fits"):
        ga.optimize(huge_can(), dimension=7)
    assert ga.find_grasps(huge_can(), count=2).shape == (0, 23)


def test_optimize_finds_a_first_grasp(tmp_path):
    result = ga.optimize(without_x1("schunk_oil_bottle"), radius=0.2)
    assert result.is_global
    assert result.check().passed, str(result.check())
    np.testing.assert_allclose(result.atlas.centers[0], result.problem.x1_array, atol=1e-6)
    result.save(tmp_path / "found.npz")
    again = ga.load_result(tmp_path / "found.npz")
    assert again.check().passed
    assert again.problem.to_dict() == result.problem.to_dict()
    ga.save_picture(result, tmp_path / "found.png")
    ga.export_html(result, tmp_path / "found.html")


def test_reference_by_default(can):
    """x1's posture; without x1 the mean of the hand motions, within the limits."""
    assert can.reference_posture == can.x1.joints
    bare = replace(can, x1=None)
    mean = dict(zip(can.motions.joints, can.motions.mean, strict=True))
    lower, upper = can.hand.joint_limits
    for name, low, high in zip(can.hand.joints, lower, upper, strict=True):
        assert bare.reference_posture[name] == np.clip(mean[name], low, high)
    assert replace(bare, motions=None).full_dimension == bare.full_dimension == can.full_dimension == 8
    X = ga.find_grasps(bare, dimension=2, count=3)
    assert np.abs(bare.frozen_residual(X, 2)).max() < 1e-9
    assert np.abs(bare.at(X[0]).frozen_residual(X, 2)).max() < 1e-9


def test_hand_motions_pass_through_any_grasp(bottle):
    """Where no grasp lies on the hand motions through their mean, they may pass through one that is found anywhere."""
    bare = replace(bottle, x1=None)
    x = ga.find_grasps(bare)[0]
    result = ga.optimize(bare.at(x), radius=0.2)
    assert result.check().passed, str(result.check())
    assert result.problem.reference_posture == result.problem.x1.joints


def test_at_keeps_the_hand_motions(can):
    near, anywhere = ga.find_grasps(can, dimension=2)[0], ga.find_grasps(can)[0]
    assert can.at(near).reference == can.x1.joints
    assert ga.optimize(can.at(near), max_charts=20).check().passed
    with pytest.raises(ga.GraspAtlasError, match=r"off the 6 hand motions.*reference"):
        ga.optimize(can.at(anywhere), max_charts=20)
    assert ga.optimize(can.at(anywhere), dimension=8, radius=0.5, max_charts=20).atlas.n_charts == 20
    with pytest.raises(ga.GraspAtlasError, match="24 finite numbers"):
        can.at(near[:5])
    lifted = near.copy()
    lifted[15] += 0.01
    with pytest.raises(ga.GraspAtlasError, match="misses its contacts"):
        can.at(lifted)


def test_without_x1_errors_say_what_to_do(can):
    bare = replace(can, x1=None)
    with pytest.raises(ga.GraspAtlasError, match=r"no first grasp x1.*find_grasps"):
        _ = bare.x1_array
    grasps = ga.Grasps(bare, ga.find_grasps(bare, count=4))
    assert (ga.quality.evaluate("smallest_semi_axis", grasps) > 0.0).all()


def test_problem_files_without_x1(tmp_path, can):
    table = without_x1("schunk_can").to_dict()
    assert table["x1"] is None
    again = ga.Problem.from_dict(json.loads(json.dumps(table)))
    assert again.to_dict() == table
    assert again.reference_posture == can.x1.joints
    path = tmp_path / "bare.json"
    path.write_text(json.dumps({key: value for key, value in can.to_dict().items() if key != "x1"}))
    assert ga.load_problem(path).x1 is None
    assert "reference" not in can.to_dict()  # older problems stay as they were


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda r: r.update(thumb_pip=9.0), "thumb_pip.*9.*limits"),
        (lambda r: r.pop("thumb_pip"), "reference.*no position for joint 'thumb_pip'"),
        (lambda r: r.update(thumb_pipp=0.0), "did you mean 'thumb_pip'"),
        (lambda r: r.update(thumb_pip=float("nan")), "not finite"),
        (lambda r: r.update(thumb_pip="bent"), "thumb_pip.*bent"),
    ],
)
def test_wrong_references(can, change, words):
    table = copy.deepcopy(without_x1("schunk_can").to_dict())
    change(table["reference"])
    with pytest.raises(ga.GraspAtlasError, match=words):
        ga.Problem.from_dict(table)
    with pytest.raises(ga.GraspAtlasError, match="reference posture must be a table"):
        ga.Problem.from_dict({**table, "reference": [1.0]})


def test_a_contact_stated_twice_has_no_full_rank_anywhere(can):
    twice = replace(can, x1=None, contacts=(*can.contacts[:1], *can.contacts[:1]))
    with pytest.raises(ga.GraspAtlasError, match=r"rank 5 anywhere.*stated twice"):
        _ = twice.full_dimension


# Guesses of the object's pose ---------------------------------------------------------------------


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
    monkeypatch.setattr(SEARCH, "starts_near", lambda *a: map(lambda x: yielded.append(x) or x, near(*a)))
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
