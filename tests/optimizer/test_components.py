"""Other connected components: found without x1, counted by brute force, and the best grasp over all of them."""

from __future__ import annotations

import json
import time
from dataclasses import replace

import numpy as np
import pytest
from helpers import slow_but, without_x1
from numpy.typing import NDArray
from oracles.planar_components import count_components, unit, wrapped
from oracles.planar_hand import PlanarHand

import graspatlas as ga
from graspatlas.search import GraspSearch

Array = NDArray[np.float64]


@pytest.fixture(scope="module")
def counted() -> list[Array]:
    return count_components(PlanarHand.read())


@pytest.fixture(scope="module")
def planar() -> ga.Components:
    return ga.find_components(without_x1("planar_hand"))


def grasp_of(problem: ga.Problem, hand: PlanarHand, steps: Array) -> Array | None:
    """The grasp with joint angles near these."""
    angles = hand.theta_1 + steps.reshape(3, 2)
    elbow = hand.anchors + hand.lengths[:, :1] * unit(angles[:, 0])
    distal = angles.sum(axis=1)
    centers = elbow + (hand.lengths[:, 1] + hand.radii)[:, None] * unit(distal)
    across, mine = centers[1] - centers[0], hand.centers[1] - hand.centers[0]
    phi = np.arctan2(across[1], across[0]) - np.arctan2(mine[1], mine[0])
    R = np.array([[np.cos(phi), -np.sin(phi)], [np.sin(phi), np.cos(phi)]])
    u = hand.arcs.mean(axis=1) + wrapped(distal + np.pi - phi - hand.arcs.mean(axis=1))
    x = np.r_[unit(angles.ravel()).ravel(), centers[0] - R @ hand.centers[0], np.cos(phi), np.sin(phi), u]
    return ga.project(problem.system(2), x)


@pytest.mark.slow
def test_every_component_of_the_planar_hand_is_found(counted, planar):
    assert planar.status is ga.SearchStatus.COVERED
    assert min(map(len, counted)) > 100  # no crumbs
    assert len(planar) == len(counted) == 2
    assert all(result.is_global for result in planar.results)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("offset", "count"),
    [([[0.06, 0.14], [0.03, 0.26], [0.19, -0.3]], 3), ([[0.22, -0.37], [-0.73, -0.77], [0.5, 0.66]], 0)],
    ids=["three", "none"],
)
def test_as_many_as_by_brute_force_where_the_hand_motions_pass_elsewhere(offset, count):
    hand = PlanarHand.read()
    hand = replace(hand, theta_1=hand.theta_1 + offset)
    problem = without_x1("planar_hand")
    assert problem.hand.joints[:2] == ("first_base", "first_elbow")
    problem = replace(problem, reference=dict(zip(problem.hand.joints, hand.theta_1.ravel().tolist(), strict=True)))
    if count == 0:
        assert count_components(hand) == []
        with pytest.raises(ga.GraspAtlasError, match="no feasible grasp"):
            ga.find_components(problem, max_seconds=3.0)
        return
    assert sum(len(c) > 100 for c in count_components(hand)) == count
    assert len(ga.find_components(problem)) == count


@pytest.mark.slow
def test_components_are_those_of_the_brute_force(counted, planar):
    """The points of each lie in one atlas, all of them, and no two in the same."""
    hand, problem = PlanarHand.read(), without_x1("planar_hand")
    homes = []
    for component in counted:
        inside = component[np.abs(component).max(axis=1) <= np.pi]
        grasps = [grasp_of(problem, hand, steps) for steps in inside[:: max(1, len(inside) // 200)]]
        covers = [
            [result.atlas.locate(x)[1] <= 0.5 * result.atlas.radius for result in planar.results]
            for x in grasps
            if x is not None
        ]
        assert len(covers) > 100
        share = np.mean(covers, axis=0)
        homes.append(int(share.argmax()))
        # Where a finger is straight, a point of the grid may be moved across the joint that has gone half a turn.
        assert share.max() > 0.97
        assert np.delete(share, homes[-1]).max() < 0.01
    assert sorted(homes) == [0, 1]


@pytest.mark.slow
def test_another_component_is_better(planar, planar_result):
    """Bundled x1 lies in the larger component, which does not hold the best grasp."""
    bundled = planar_result
    assert planar.best.quality > 1.3 * bundled.best.quality
    assert planar.results[1].atlas.locate(bundled.atlas.centers[0])[1] == 0.0
    assert planar.results[0].atlas.locate(bundled.atlas.centers[0]) == (-1, np.inf)
    assert planar.best is planar.best_result.best
    assert planar.hits[0] + planar.hits[1] == planar.found == sum(planar.hits)
    assert planar.results[0].check().passed


# The hand with can and bottle -----------------------------------------------------------------------


@pytest.mark.parametrize(("name", "radius"), [("schunk_can", 0.17), ("schunk_oil_bottle", 0.1)])
@pytest.mark.parametrize("seed", slow_but([0, 1], 0))
def test_the_bundled_component_is_found_without_x1(name, radius, seed):
    """Its atlas covers that of x1 and is covered by it, and the best grasp is the same up to the size of a chart."""
    start = time.perf_counter()
    found = ga.find_components(
        without_x1(name),
        radius=radius,
        quality="smallest_semi_axis",
        require=[],
        covered=50,
        seed=seed,
        max_seconds=60.0,
    )
    assert time.perf_counter() - start < 60.0
    assert len(found) == 2
    bundled = ga.optimize(ga.load_problem(name), radius=radius, quality="smallest_semi_axis", require=[])
    homes = [r for r in found.results if r.atlas.locate(bundled.atlas.centers[0])[1] == 0.0]
    assert len(homes) == 1
    (home,) = homes
    for one, other in ((home.atlas, bundled.atlas), (bundled.atlas, home.atlas)):
        assert max(one.locate(x)[1] for x in other.centers[::20]) < 0.5 * radius
    assert home.best.quality == pytest.approx(bundled.best.quality, rel=0.03)
    tops = [ga.climb(result, result.best.chart) for result in (home, bundled)]
    assert tops[0].quality == pytest.approx(tops[1].quality, rel=2e-3)
    assert home.check().passed, str(home.check())


def test_x1_comes_first(can):
    found = ga.find_components(can, radius=0.3, covered=5)
    assert any(result.problem.x1 is can.x1 for result in found.results)
    assert found.covered == 5


@pytest.mark.slow
@pytest.mark.parametrize(("k", "radius", "count"), [(1, 0.05, 4), (3, 0.4, 3)])
def test_other_dimensions(k, radius, count):
    """The count does not depend on the size of the charts, which the search does not look at."""
    name = "schunk_can" if k == 1 else "schunk_oil_bottle"
    for factor in (1.0, 0.6):
        found = ga.find_components(without_x1(name), dimension=k, radius=factor * radius, covered=100)
        assert len(found) == count
        assert all(result.dimension == k and result.status is ga.Status.COMPLETE for result in found.results)


# How it ends ----------------------------------------------------------------------------------------


def test_best_come_first_and_those_without_a_grasp_last(can):
    """The can's smaller component has no grasp that holds it well."""
    holds = [ga.ForceClosure(friction=0.5, margin=0.02)]
    found = ga.find_components(can, require=holds, covered=30)
    assert [bool(result.accepted.any()) for result in found.results] == [True, False]
    assert found.best.quality == found.results[0].best.quality
    none = ga.find_components(can, require=[ga.ForceClosure(friction=0.5, margin=0.9)], covered=3)
    with pytest.raises(ga.GraspAtlasError, match="relax"):
        _ = none.best


def test_share_not_found(planar):
    """With the share that it names, so many grasps in a row are covered with a chance of 5 %."""
    p = planar.share_not_found()
    assert (1.0 - p) ** planar.covered == pytest.approx(0.05)
    assert planar.covered == 300
    assert p < 0.01
    assert replace(planar, covered=0).share_not_found() == 1.0
    with pytest.raises(ga.GraspAtlasError, match="confidence"):
        planar.share_not_found(1.0)


def test_limit_of_time():
    found = ga.find_components(without_x1("schunk_can"), radius=0.3, max_seconds=1.0, covered=10**6)
    assert found.status is ga.SearchStatus.TIME_LIMIT
    assert len(found) >= 1
    assert found.seconds < 10.0


def test_pieces_of_a_component_that_meet_are_one():
    """Atlases cut short are pieces; one that grew over an older one takes its place."""
    found = ga.find_components(without_x1("planar_hand"), max_charts=700, covered=25)
    assert found.status is ga.SearchStatus.COVERED
    assert found.holes > 0
    assert len(found) == 2


def test_gives_up_when_nothing_more_is_found(monkeypatch, can):
    monkeypatch.setattr(GraspSearch, "attempt", lambda self: None)
    monkeypatch.setattr("graspatlas.search.grasp_search.MAX_TRIES", 10)
    found = ga.find_components(can, radius=0.3)
    assert found.status is ga.SearchStatus.NO_GRASP
    assert (len(found), found.found, found.share_not_found()) == (1, 0, 1.0)


@pytest.mark.parametrize("when", [0, 5])
def test_interruption_keeps_what_there_is(when, monkeypatch):
    attempt = GraspSearch.attempt

    def interrupted(self):
        if self.found == when:
            raise KeyboardInterrupt
        return attempt(self)

    monkeypatch.setattr(GraspSearch, "attempt", interrupted)
    if when == 0:
        with pytest.raises(KeyboardInterrupt):
            ga.find_components(without_x1("schunk_can"), radius=0.3)
        return
    found = ga.find_components(without_x1("schunk_can"), radius=0.3)
    assert found.status is ga.SearchStatus.INTERRUPTED
    assert (found.found, sum(found.hits)) == (5, 5)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"covered": 0}, "covered"),
        ({"covered": 2.5}, "covered"),
        ({"max_seconds": 0.0}, "max_seconds"),
        ({"dimension": 20}, "dimension"),
        ({"quality": "beauty"}, "beauty"),
        ({"radius": -1.0}, "radius"),
    ],
)
def test_misuse(options, words, can):
    with pytest.raises(ga.GraspAtlasError, match=words):
        ga.find_components(can, **options)


def test_a_problem_is_needed():
    with pytest.raises(ga.GraspAtlasError, match="load_problem"):
        ga.find_components("schunk_can")


# The command line -----------------------------------------------------------------------------------


@pytest.mark.slow
def test_command_line(cli, tmp_path):
    words = ("optimize", "planar_hand", "--components", "--radius", "0.2", "--output", tmp_path)
    status, out, _ = cli(*words)
    assert status == 0
    for part in ("2 components", "component 1:", "component 2:", "hit", "95 % confidence", "best grasp"):
        assert part in out
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "components", "components.json", "result.npz", "summary.json",
    ]  # fmt: skip
    first, second = ga.load_result(tmp_path), ga.load_result(tmp_path / "components" / "2.npz")
    assert first.best.quality > second.best.quality
    assert second.check().passed
    stored = json.loads((tmp_path / "components.json").read_text())
    assert [c["quality"]["best"] for c in stored["components"]] == [first.best.quality, second.best.quality]
    status, out, _ = cli(*words, "--json", "--max-seconds", "1")
    assert status == 0
    assert json.loads(out)["status"] in map(str, ga.SearchStatus)


def test_singular_grasps_do_not_end_the_search(monkeypatch):
    """No atlas can grow from a singular grasp, where the equations lose rank: it is left, and the search goes on."""
    regular = iter([False, True])
    monkeypatch.setattr(GraspSearch, "is_regular", lambda self, x: next(regular, True))
    assert len(ga.find_components(without_x1("planar_hand"), covered=20)) == 2


def test_singular_grasps_alone_are_tried_all_the_same(monkeypatch):
    """After many in a row one is tried, so that the atlas says what is wrong; the other component is not reached."""
    monkeypatch.setattr(GraspSearch, "is_regular", lambda self, x: False)
    found = ga.find_components(without_x1("planar_hand"), covered=20)
    assert len(found) == 1
