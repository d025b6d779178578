"""The example with a coupled hand: its files, and that its best grasp holds."""

from __future__ import annotations

from dataclasses import replace

import coal
import numpy as np
import pytest
from helpers import ROOT

import graspatlas as ga
from graspatlas.commands.diagnosis import NOTE, PROBLEM, diagnose
from graspatlas.requirements import screen
from graspatlas.search import GraspSearch

FILE = ROOT / "examples" / "barrett" / "egg.yaml"
PAGE = (ROOT / "docs" / "gallery.md").read_text(encoding="utf-8")
#: Ratio of an outer joint to its inner one.
GEAR = 0.344


@pytest.fixture(scope="module")
def problem():
    return ga.load_problem(FILE)


def test_check_finds_nothing_wrong(problem):
    assert not [finding for finding in diagnose(problem) if finding.mark in (NOTE, PROBLEM)]
    assert "![The BarrettHand with an egg](images/barrett_egg.png)" in PAGE
    assert f"t = {problem.full_dimension}, k = {problem.defaults['dimension']}; " in PAGE.splitlines()[-1]


def test_check_points_out_a_frozen_side_that_the_guess_does_not_mean(problem):
    """The surface of revolution turned round: finger 3 is asked to touch the far side of the egg."""
    contacts = (replace(problem.contacts[0], frozen={"u": np.pi / 2}), *problem.contacts[1:])
    (found,) = [f for f in diagnose(replace(problem, contacts=contacts)) if f.subject == "first grasp"]
    assert found.mark == NOTE
    assert "frozen u may be wrong" in found.hint


def test_check_names_the_patch_parameter_at_a_limit(problem):
    start = problem.at(ga.find_grasps(problem, dimension=2)[0])
    u = start.x1_array[-6]  # of the hand; the contacts have 2, 3 and 3 free parameters
    first, second, third = start.contacts
    second = replace(second, hand=replace(second.hand, u_interval=(0.0, u + 1e-3)))
    ends = replace(start, contacts=(first, second, third))
    (found,) = [f for f in diagnose(ends) if f.subject == "limits"]
    assert "the upper end of u of the hand's patch at f1_outer_link (0.00" in found.text


def test_the_best_grasp(problem):
    result = ga.optimize(problem, refine=True)
    assert result.is_global
    best = result.refined_best
    assert screen(problem.requirements, ga.Grasps(problem, best.x))[0].all()
    angles = best.joint_positions
    for finger in ("f1", "f2", "f3"):
        assert angles[f"{finger}_outer"] == pytest.approx(GEAR * angles[f"{finger}_inner"], abs=1e-6)
    assert angles["f1_spread"] == pytest.approx(angles["f2_spread"], abs=1e-9)
    # Egg and hand are symmetric, so the best grasp is: the index does not know it.
    assert angles["f1_inner"] == pytest.approx(angles["f2_inner"], abs=1e-3)
    assert best.object_xyz[0] == pytest.approx(0.0, abs=1e-4)
    # Half the radius, and twice, do not find a better one.
    coarse = ga.optimize(problem, radius=0.4, refine=True).refined_best
    assert coarse.quality == pytest.approx(best.quality, rel=1e-3)


def test_the_mesh_of_the_egg_is_the_patch(problem):
    mesh = coal.MeshLoader().load(str(FILE.parent / "egg.obj"), np.ones(3))
    corners = np.array(mesh.vertices())
    egg = problem.contacts[0].object
    for corner in corners[np.abs(corners[:, 2]) < 0.05]:
        assert np.linalg.norm(egg.point(*egg.locate(corner)) - corner) < 2e-4


def test_the_hand_closes_as_published(problem):
    """Bending moves the tips to the middle, and a spread of pi brings fingers 1 and 2 to the side of finger 3."""
    hand = problem.hand
    q = np.zeros(len(hand.joints))
    open_ = hand.link_placements(q)
    q[[hand.joints.index(f"f{i}_inner") for i in (1, 2, 3)]] = 1.0
    closed = hand.link_placements(q)
    for finger, palmward in (("f1", 1.0), ("f2", 1.0), ("f3", -1.0)):
        tip = np.array([0.05, 0.0, 0.0, 1.0])
        moved = (closed[f"{finger}_outer_link"] - open_[f"{finger}_outer_link"]) @ tip
        assert moved[1] * palmward > 0.0
    q[[hand.joints.index(f"f{i}_spread") for i in (1, 2)]] = np.pi
    behind = hand.link_placements(q)
    assert all(behind[f"f{i}_outer_link"][1, 3] > 0.0 > open_[f"f{i}_outer_link"][1, 3] for i in (1, 2))


@pytest.mark.slow
def test_grasps_found_as_a_start_let_an_atlas_grow(problem):
    """Some grasps of this hand are singular: an atlas cannot grow from them, and a search for components goes on."""
    search = GraspSearch(problem, 2, seed=0)
    grasps = ga.find_grasps(problem, count=100, dimension=2)
    regular = [search.is_regular(x) for x in grasps]
    assert np.mean(regular) > 0.9
    for x, good in zip(grasps, regular, strict=True):
        if not good:
            with pytest.raises(ga.GraspAtlasError):
                ga.optimize(problem.at(x), max_charts=1, require=[])
        else:
            assert ga.optimize(problem.at(x), max_charts=1, require=[]).atlas.n_charts == 1
