"""Feasible grasps from nothing but hand, object, patches and limits; problems without a first grasp."""

from __future__ import annotations

import copy
import json
import time
from dataclasses import replace

import numpy as np
import pytest
from helpers import tripod_problem, without_x1

import graspatlas as ga
from graspatlas.search import GraspSearch

PROBLEMS = ("planar_hand", "schunk_can", "schunk_oil_bottle")


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
    monkeypatch.setattr("graspatlas.search.grasp_search.MAX_TRIES", 50)
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
    ga.save_picture(result, tmp_path / "found.png", width=320, height=180)
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
