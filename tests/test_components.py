"""Other connected components: found without x1, counted by brute force, and the best grasp over all of them."""

from __future__ import annotations

import json
import time
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree
from test_cli import cli  # noqa: F401
from test_planar import PlanarHand
from test_search import without_x1

import graspatlas as ga
from graspatlas.search import GraspSearch

Array = NDArray[np.float64]


# The planar hand, counted by brute force ------------------------------------------------------------
# Given a finger's two angles and where it touches its arc, the object's pose is known, and the other two fingers have
# two elbows each in closed form. So a grid over these three numbers holds all feasible grasps, and R is where the
# frozen hand motion changes its sign between neighbours. No solver, chart or kinematics of the package is used.

#: Grid points to a turn. The larger component has a narrow neck: with 120 points it falls in two.
GRID = 160
#: Points of R nearer than this in joint angles belong together [rad]; with 0.15 or 0.4 the count is the same.
LINK = 0.25
#: Elbows turn by more than half a turn from x1, and so may come back with another frozen hand motion.
ELBOWS = (1, 3, 5)
#: How far the other joints may turn [rad].
BASES_REACH = 3.0


def unit(angle: Array) -> Array:
    return np.stack([np.cos(angle), np.sin(angle)], axis=-1)


def wrapped(angle: Array) -> Array:
    return (angle + np.pi) % (2.0 * np.pi) - np.pi


def elbows_of(hand: PlanarHand, i: int, center: Array, phi: Array, sign: int) -> tuple[Array, Array]:
    """Both joint angles of finger i [..., 2] that reach the arc's centre, and whether it touches within the arc."""
    upper, lower = hand.lengths[i, 0], hand.lengths[i, 1] + hand.radii[i]
    to = center - hand.anchors[i]
    far = np.linalg.norm(to, axis=-1)
    cosine = (upper**2 + far**2 - lower**2) / (2.0 * upper * far)
    base = np.arctan2(to[..., 1], to[..., 0]) + sign * np.arccos(np.clip(cosine, -1.0, 1.0))
    rest = to - upper * unit(base)
    distal = np.arctan2(rest[..., 1], rest[..., 0])
    off = np.abs(wrapped(distal + np.pi - phi - hand.arcs[i].mean()))
    return np.stack([base, distal - base], axis=-1), (np.abs(cosine) <= 1.0) & (off <= np.ptp(hand.arcs[i]) / 2.0)


def sheets_of(hand: PlanarHand, f: int) -> list[tuple[Array, Array]]:
    """Joint angles from x1 [grid, 6], and where they are those of a feasible grasp: a sheet for each pair of elbows."""
    turn = 2.0 * np.pi * np.arange(GRID) / GRID
    arc = np.linspace(*hand.arcs[f], int(np.ptp(hand.arcs[f]) * GRID / (2.0 * np.pi)) + 2)
    base, distal, u = np.meshgrid(turn, turn + 0.01, arc, indexing="ij")
    phi = distal + np.pi - u
    turned = unit(phi)

    def in_palm(p: Array) -> Array:
        return np.stack([turned @ (p * [1.0, -1.0]), turned @ p[::-1]], axis=-1)

    reach = hand.lengths[f, 1] + hand.radii[f]
    t = hand.anchors[f] + hand.lengths[f, 0] * unit(base) + reach * unit(distal) - in_palm(hand.centers[f])
    others = [i for i in range(3) if i != f]
    found = {(i, s): elbows_of(hand, i, t + in_palm(hand.centers[i]), phi, s) for i in others for s in (1, -1)}
    sheets = []
    for signs in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
        angles, feasible = np.empty((*base.shape, 3, 2)), np.ones(base.shape, bool)
        angles[..., f, :] = np.stack([base, distal - base], axis=-1)
        for i, sign in zip(others, signs, strict=True):
            angles[..., i, :] = found[i, sign][0]
            feasible &= found[i, sign][1]
        sheets.append((wrapped(angles - hand.theta_1).reshape(*base.shape, 6), feasible))
    return sheets


def crossings(hand: PlanarHand, steps: Array, feasible: Array) -> list[Array]:
    """Where the frozen hand motion is zero between neighbours of a sheet, joints that went round included [n, 6]."""
    found = []
    for axis in range(3):
        first = tuple(slice(0, -1) if a == axis else slice(None) for a in range(3))
        second = tuple(slice(1, None) if a == axis else slice(None) for a in range(3))
        both = feasible[first] & feasible[second]
        start = steps[first][both]
        change = wrapped(steps[second][both] - start)
        near = np.abs(change).max(axis=1) < 1.0
        start, change = start[near], change[near]
        before, slope = start @ hand.frozen, change @ hand.frozen
        for rounds in np.ndindex(3, 3, 3):
            turns = np.zeros(6)
            turns[list(ELBOWS)] = 2.0 * np.pi * (np.array(rounds) - 1)
            g = before + turns @ hand.frozen
            hit = g * (g + slope) <= 0.0
            found.append(start[hit] + turns - (g[hit] / slope[hit])[:, None] * change[hit])
    return found


def count_components(hand: PlanarHand) -> list[Array]:
    """Points of each component of R by joint angles from x1 [n, 6]; of those that come within half a turn of x1."""
    sheets = [sheet for f in range(3) for sheet in sheets_of(hand, f)]
    points = np.concatenate([part for sheet in sheets for part in crossings(hand, *sheet)])
    assert np.abs(points[:, ::2]).max() < BASES_REACH
    pairs = cKDTree(points).query_pairs(LINK, output_type="ndarray")
    graph = coo_array((np.ones(len(pairs)), pairs.T), shape=(len(points),) * 2)
    n, label = connected_components(graph, directed=False)
    components = [points[label == i] for i in range(n)]
    return [c for c in components if (np.abs(c).max(axis=1) <= np.pi).any()]


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


def test_every_component_of_the_planar_hand_is_found(counted, planar):
    assert planar.status is ga.SearchStatus.COVERED
    assert min(map(len, counted)) > 100  # no crumbs
    assert len(planar) == len(counted) == 2
    assert all(result.is_global for result in planar.results)


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


def test_another_component_is_better(planar):
    """Bundled x1 lies in the larger component, which does not hold the best grasp."""
    bundled = ga.optimize(ga.load_problem("planar_hand"))
    assert planar.best.quality > 1.3 * bundled.best.quality
    assert planar.results[1].atlas.locate(bundled.atlas.centers[0])[1] == 0.0
    assert planar.results[0].atlas.locate(bundled.atlas.centers[0]) == (-1, np.inf)
    assert planar.best is planar.best_result.best
    assert planar.hits[0] + planar.hits[1] == planar.found == sum(planar.hits)
    assert planar.results[0].check().passed


# The hand with can and bottle -----------------------------------------------------------------------


@pytest.mark.parametrize(("name", "radius"), [("schunk_can", 0.17), ("schunk_oil_bottle", 0.1)])
@pytest.mark.parametrize("seed", [0, 1])
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
    monkeypatch.setattr("graspatlas.search.MAX_TRIES", 10)
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


def test_command_line(cli, tmp_path):  # noqa: F811
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


def test_special_grasps_do_not_end_the_search(monkeypatch):
    """No atlas can grow from a special grasp, where the equations lose rank: it is left, and the search goes on."""
    regular = iter([False, True])
    monkeypatch.setattr(GraspSearch, "is_regular", lambda self, x: next(regular, True))
    assert len(ga.find_components(without_x1("planar_hand"), covered=20)) == 2


def test_special_grasps_alone_are_tried_all_the_same(monkeypatch):
    """After many in a row one is tried, so that the atlas says what is wrong; the other component is not reached."""
    monkeypatch.setattr(GraspSearch, "is_regular", lambda self, x: False)
    found = ga.find_components(without_x1("planar_hand"), covered=20)
    assert len(found) == 1
