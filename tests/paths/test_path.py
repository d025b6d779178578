"""Paths on atlases: their length against known geodesics, what every point keeps, and wrong input."""

from __future__ import annotations

import csv
import re
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from helpers import PythonSphere
from numpy.testing import assert_allclose
from numpy.typing import NDArray
from scipy.optimize import minimize

import graspatlas as ga
from graspatlas.paths.pieces import narrowest_gap
from graspatlas.requirements import screen
from graspatlas.requirements.lost import Lost
from graspatlas.systems import geodesic

Array = NDArray[np.float64]
HEIGHT = 0.5  # of the plane beyond which the cap of a sphere is cut off


def unit(*x: float) -> Array:
    return np.asarray(x) / np.linalg.norm(x)


def assert_sound(path: ga.Path, step: float) -> None:
    """What holds for any path: on the manifold, inside its bounds, without jumps."""
    system = path.atlas.system
    assert max(np.abs(system.evaluate_residual(x)).max(initial=0.0) for x in path.x) <= 1e-9
    assert_allclose(path.residuals, [np.abs(system.evaluate_residual(x)).max(initial=0.0) for x in path.x])
    assert min(system.slack(x).min(initial=0.0) for x in path.x) >= -1e-9
    steps = [np.linalg.norm(system.difference(a, b)) for a, b in pairwise(path.x)]
    assert max(steps, default=0.0) <= step * (1.0 + 1e-9)
    assert_allclose(np.diff(path.arc_length), steps, atol=1e-12)
    assert path.arc_length[0] == 0.0
    assert path.length == path.arc_length[-1]


# Geodesics


@pytest.mark.parametrize("end", [40, 300, 700])
def test_a_great_circle(sphere: ga.Atlas, end: int) -> None:
    path = ga.shortest_path(sphere, 3, end)
    a, b = sphere.centers[[3, end]]
    assert path.length == pytest.approx(np.arccos(a @ b), rel=1e-4)
    normal = unit(*np.cross(a, b))
    assert_allclose(path.x @ normal, 0.0, atol=1e-3)
    assert_allclose(path.x[[0, -1]], [a, b])
    assert path.tight
    assert_sound(path, 0.1 * sphere.radius)


def test_a_great_circle_in_more_dimensions() -> None:
    atlas = ga.build_atlas(ga.systems.Sphere(4), [0, 0, 0, 1], radius=0.3, epsilon=0.3)
    path = ga.shortest_path(atlas, 0, atlas.n_charts // 2)
    assert path.length == pytest.approx(np.arccos(path.x[0] @ path.x[-1]), rel=1e-3)
    assert_sound(path, 0.1 * atlas.radius)


def torus_geodesic(a: Array, b: Array, major: float, minor: float) -> float:
    """Length of the shortest curve between two points, found in the torus's angles without atlas or projection."""
    angles = [(np.arctan2(x[1], x[0]), np.arctan2(x[2], np.hypot(x[0], x[1]) - major)) for x in (a, b)]

    def energy(inner: Array, ends: Array) -> tuple[float, Array]:
        p, q = np.column_stack([ends[:, :1], inner.reshape(2, -1), ends[:, 1:]])
        n = len(p) - 1
        dp, dq, middle = np.diff(p), np.diff(q), (q[1:] + q[:-1]) / 2.0
        w = major + minor * np.cos(middle)
        by_p, by_q, by_middle = 2 * n * w**2 * dp, 2 * n * minor**2 * dq, -n * w * minor * np.sin(middle) * dp**2
        gradient = [by_p[:-1] - by_p[1:], by_q[:-1] - by_q[1:] + by_middle[:-1] + by_middle[1:]]
        return n * float((w**2 * dp**2 + minor**2 * dq**2).sum()), np.concatenate(gradient)

    def shortened(curve: Array, pieces: int) -> tuple[float, Array]:
        """The shortest curve of so many pieces near one of any number, and its length."""
        ends, s = curve[:, [0, -1]], np.linspace(0.0, 1.0, pieces + 1)
        start = np.array([np.interp(s, np.linspace(0.0, 1.0, curve.shape[1]), row) for row in curve])[:, 1:-1]
        fit = minimize(energy, start.ravel(), (ends,), jac=True, method="L-BFGS-B", options={"maxiter": 20000})
        return float(np.sqrt(fit.fun)), np.column_stack([ends[:, :1], fit.x.reshape(2, -1), ends[:, 1:]])

    found = []
    for turns in np.ndindex(3, 3):
        curve = np.column_stack([angles[0], np.array(angles[1]) + 2.0 * np.pi * (np.array(turns) - 1.0)])
        for pieces in (10, 50, 150):  # from few pieces to many: each is near the answer of the one before
            length, curve = shortened(curve, pieces)
        found.append(length)
    return min(found)


@pytest.mark.parametrize("end", [200, 600])
def test_a_geodesic_of_a_torus(end: int) -> None:
    atlas = ga.build_atlas(ga.systems.Torus(1.0, 0.4), [1.4, 0.0, 0.0], radius=0.1, epsilon=0.3)
    path = ga.shortest_path(atlas, 0, end)
    expected = torus_geodesic(atlas.centers[0], atlas.centers[end], 1.0, 0.4)
    assert path.length == pytest.approx(expected, rel=1e-3)
    assert_sound(path, 0.1 * atlas.radius)


def test_a_turn_is_as_long_as_its_angle() -> None:
    """Rotations have no equation, and a quaternion and its negative are one."""
    atlas = ga.build_atlas(ga.systems.Rotations(), [0, 0, 0, 1], radius=0.4, epsilon=0.5)
    end = unit(0.3, -0.5, 0.2, -0.4)
    path = ga.shortest_path(atlas, 0, end)
    assert path.length == pytest.approx(2.0 * np.arccos(abs(end[3])), rel=1e-3)


def around_cap(a: Array, b: Array, pole: Array, height: float) -> float:
    """Length of the shortest curve on the unit sphere that stays below a plane: two tangents and an arc."""
    edge = np.arccos(height)
    away = np.arccos([a @ pole, b @ pole])
    tangents = np.arccos(np.cos(away) / np.cos(edge))
    turned = np.arccos(np.tan(edge) / np.tan(away))
    flat = [x - (x @ pole) * pole for x in (a, b)]
    between = np.arccos(flat[0] @ flat[1] / np.linalg.norm(flat[0]) / np.linalg.norm(flat[1]))
    return float(tangents.sum() + np.sin(edge) * (between - turned.sum()))


START, END = unit(0.3, 0.9, 0.2), unit(0.3, -0.9, 0.25)


def test_a_path_hugs_its_bounds() -> None:
    system = PythonSphere(3, upper=[HEIGHT, np.inf, np.inf])
    atlas = ga.build_atlas(system, START, radius=0.1, epsilon=0.1)
    path = ga.shortest_path(atlas, START, END)
    assert path.length == pytest.approx(around_cap(START, END, np.array([1.0, 0.0, 0.0]), HEIGHT), rel=1e-3)
    assert (path.x[:, 0] > HEIGHT - 1e-3).sum() > 50
    assert path.tight
    assert_sound(path, 0.01)


def test_a_chain_hugs_what_is_not_allowed() -> None:
    """The same cap, known only by asking."""
    system = ga.systems.Sphere(3)
    wide = [START, unit(-0.2, 0.6, 0.8), unit(-0.2, -0.6, 0.8), END]
    pieces = [geodesic.bridge(system, a, b, 0.01) for a, b in pairwise(wide)]
    chain = geodesic.evenly(system, np.concatenate([p for p in pieces if p is not None]), 0.01)
    assert chain is not None
    asked = []

    def allowed(X: Array) -> NDArray[np.bool_]:
        asked.append(len(X))
        return np.asarray(X[:, 0] <= HEIGHT)

    tight, done = geodesic.shorten(system, chain, trust_radius=0.1, longest=0.015, allowed=allowed)
    assert done
    assert allowed(tight).all()
    length = geodesic.arc_lengths(system, tight)[-1]
    assert length == pytest.approx(around_cap(START, END, np.array([1.0, 0.0, 0.0]), HEIGHT), rel=2e-3)
    assert length < 0.97 * geodesic.arc_lengths(system, chain)[-1]


def test_points_that_are_far_apart_are_not_bridged(sphere: ga.Atlas) -> None:
    assert geodesic.bridge(sphere.system, unit(0, 0, 1), unit(0, 0, -1), 0.01) is None


def test_interrupted_shortening_leaves_a_path(sphere: ga.Atlas, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(geodesic, "_shortened", interrupt)
    path = ga.shortest_path(sphere, 0, 300)
    assert not path.tight
    assert path.length > np.arccos(sphere.centers[0] @ sphere.centers[300])
    assert_sound(path, 0.1 * sphere.radius)


# Grasps


@pytest.fixture(scope="module")
def held(can: ga.Problem) -> ga.Result:
    return ga.optimize(can, require=[ga.ForceClosure(0.5), ga.CollisionFree()])


@pytest.fixture(scope="module")
def path(held: ga.Result) -> ga.GraspPath:
    return ga.shortest_path(held, held.worst.chart, accepted=True)


def test_grasps_are_never_let_go(path: ga.GraspPath, held: ga.Result) -> None:
    assert_sound(path, 0.1 * held.atlas.radius)
    assert path.tight
    arrays = held.problem.full_system.grasp_arrays(path.x)
    assert np.abs(arrays["hand_points"] - arrays["object_points"]).max() < 1e-9
    assert np.abs(arrays["hand_normals"] + arrays["object_normals"]).max() < 1e-6
    assert np.abs(held.problem.frozen_residual(path.x, 2)).max() < 1e-9
    assert screen(held.requirements, path.grasps)[0].all()  # type: ignore[arg-type]
    assert path.accepted.all()
    assert_allclose(path.qualities[[0, -1]], [held.worst.quality, held.best.quality])
    assert path.length >= np.linalg.norm(held.atlas.system.difference(path.x[0], path.x[-1]))
    assert (path.charts >= 0).all()
    assert path.charts[0] == held.worst.chart


def test_pulling_shortens_the_graph_path_and_ends(can_result: ga.Result) -> None:
    path = ga.shortest_path(can_result, can_result.worst.chart)
    assert_sound(path, 0.1 * can_result.atlas.radius)
    centres = can_result.atlas.centers[list(dict.fromkeys(path.charts.tolist()))]
    assert path.length < geodesic.arc_lengths(can_result.atlas.system, centres)[-1]
    again, _ = geodesic.shorten(can_result.atlas.system, path.x, trust_radius=0.17, longest=0.03)
    assert geodesic.arc_lengths(can_result.atlas.system, again)[-1] > 0.999 * path.length


def test_a_path_goes_round_a_hole(can: ga.Problem) -> None:
    """A requirement that cuts the straight path: all points keep it, and the path is longer."""
    free = ga.optimize(can, require=[])
    straight = ga.shortest_path(free, free.worst.chart)
    middle = straight.grasps.T_palm_object[len(straight) // 2, :3, 3]

    @ga.batched
    def away(grasps: ga.Grasps) -> NDArray[np.bool_]:
        return np.asarray(np.linalg.norm(grasps.T_palm_object[:, :3, 3] - middle, axis=1) > 0.002)

    result = ga.optimize(can, require=[away])
    path = ga.shortest_path(result, free.worst.chart, free.best.chart, accepted=True)
    assert path.accepted.all()
    assert path.length > 1.001 * straight.length
    assert_sound(path, 0.1 * free.atlas.radius)
    assert not ga.shortest_path(result, free.worst.chart, free.best.chart).accepted.all()


def test_a_joint_trajectory(path: ga.GraspPath, tmp_path: Path) -> None:
    path.save_csv(tmp_path / "path.csv")
    with open(tmp_path / "path.csv", newline="", encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == len(path)
    pose = ["object_x", "object_y", "object_z", "object_qx", "object_qy", "object_qz", "object_qw"]
    assert list(rows[0]) == ["arc_length", *path.grasps.joints, *pose, "quality"]
    table = {name: np.array([float(row[name]) for row in rows]) for name in rows[0]}
    last = path.grasps[len(path) - 1]
    assert [table[name][-1] for name in path.grasps.joints] == pytest.approx(list(last.joint_positions.values()))
    assert [table[name][-1] for name in pose[:3]] == pytest.approx(last.object_xyz)
    q = np.column_stack([table[name] for name in pose[3:]])
    assert abs(q[-1] @ last.object_quat_xyzw) == pytest.approx(1.0)
    assert (np.sum(q[1:] * q[:-1], axis=1) > 0.99).all()
    assert_allclose(table["quality"], path.qualities)
    assert [file.name for file in tmp_path.iterdir()] == ["path.csv"]
    with pytest.raises(ga.GraspAtlasError, match=r"cannot write.*nowhere"):
        path.save_csv(tmp_path / "nowhere" / "path.csv")


def test_a_path_without_grasps_is_a_table_too(sphere: ga.Atlas, tmp_path: Path) -> None:
    ga.shortest_path(sphere, 0, 9).save_csv(tmp_path / "path.csv")
    assert (tmp_path / "path.csv").read_text(encoding="utf-8").startswith("arc_length,x0,x1,x2\n0.0,")


def test_ends_may_be_grasps(held: ga.Result, path: ga.GraspPath) -> None:
    between = path.x[len(path) // 2]
    half = ga.shortest_path(held, held.worst, between, accepted=True)
    assert_allclose(half.x[-1], between)
    assert half.length == pytest.approx(path.arc_length[len(path) // 2], rel=1e-2)
    assert half.charts[-1] == path.charts[len(path) // 2]


def test_a_path_of_one_point(small_result: ga.Result) -> None:
    path = ga.shortest_path(small_result, 7, 7)
    assert (len(path), path.length, path.tight) == (1, 0.0, True)
    assert path.charts.tolist() == [7]
    lone = ga.build_atlas(ga.systems.Sphere(3), [0, 0, 1], radius=0.1, epsilon=0.1, max_charts=1)
    assert len(ga.shortest_path(lone, 0, 0)) == 1


def test_what_was_not_stored_is_named(small_result: ga.Result, tmp_path: Path) -> None:
    lost = replace(small_result, quality="mine", requirements=(Lost("yours"),))
    path = ga.shortest_path(lost, 0, 5)
    with pytest.raises(ga.GraspAtlasError, match="'yours' is a function"):
        _ = path.accepted
    path.save_csv(tmp_path / "path.csv")
    assert "quality" not in (tmp_path / "path.csv").read_text(encoding="utf-8").splitlines()[0]


# Wrong input


def test_ends_that_cannot_be(small_result: ga.Result, can_result: ga.Result) -> None:
    n = small_result.atlas.n_charts
    off = small_result.atlas.centers[0].copy()
    off[0] += 0.01
    other = ga.optimize(small_result.problem, dimension=3, max_charts=30).grasp(20)
    for start, words in (
        (n, f"start {n} is not a chart; the atlas has charts 0 to {n - 1}"),
        (-1, "start -1 is not a chart"),
        (off, "start is not on the manifold: its largest residual"),
        (other, "start is not on the manifold"),
        (np.full(len(off), np.nan), "not finite"),
        (np.zeros(3), r"start must be a chart's number, a grasp, or \d+ numbers; got an array of shape \(3,\)"),
        ("best", "start must be"),
        (True, "start must be"),
    ):
        with pytest.raises(ga.GraspAtlasError, match=words):
            ga.shortest_path(small_result, start)
    for options, words in (
        ({"step": 0.0}, "step must be a positive number"),
        ({"step": 9.0}, "at most the chart radius"),
    ):
        with pytest.raises(ga.GraspAtlasError, match=words):
            ga.shortest_path(small_result, **options)
    with pytest.raises(ga.GraspAtlasError, match=r"needs a graspatlas\.Result or an Atlas, got str"):
        ga.shortest_path("can")  # type: ignore[call-overload]


def test_an_atlas_needs_an_end_and_has_no_requirements(sphere: ga.Atlas) -> None:
    with pytest.raises(ga.GraspAtlasError, match="no best grasp; give end"):
        ga.shortest_path(sphere)
    with pytest.raises(ga.GraspAtlasError, match="no requirements"):
        ga.shortest_path(sphere, 0, 5, accepted=True)
    half = ga.build_atlas(ga.systems.Sphere(3), [0, 0, 1], radius=0.1, epsilon=0.1, max_charts=50)
    with pytest.raises(ga.GraspAtlasError, match="no chart of the atlas covers end"):
        ga.shortest_path(half, 0, [0.0, 0.0, -1.0])


def test_the_narrowest_gap_is_along_the_atlas(sphere: ga.Atlas) -> None:
    """Two caps of a sphere: their nearest charts, and a chain of charts between that lie in neither."""
    heights = sphere.centers[:, 2]
    north, south = (np.flatnonzero(side * heights > 0.5) for side in (1.0, -1.0))
    gap = narrowest_gap(sphere, north, south)
    assert gap.charts[0] in north
    assert gap.charts[1] in south
    assert gap.between is not None
    assert (np.abs(heights[list(gap.between)]) <= 0.5).all()
    chain = [gap.charts[0], *gap.between, gap.charts[1]]
    assert all(b in sphere.neighbours[a] for a, b in pairwise(chain))
    distances = np.linalg.norm(sphere.centers[north][:, None] - sphere.centers[south][None], axis=2)
    assert 0.98 * distances.min() < gap.distance < 1.1 * distances.min()
    alone = replace(sphere, neighbour_pairs=sphere.neighbour_pairs[:0])
    apart = narrowest_gap(alone, north, south)
    assert apart.between is None
    assert apart.distance == pytest.approx(distances.min(), rel=0.01)


def test_pieces_that_are_not_connected(held: ga.Result) -> None:
    cut = held.accepted.copy()
    cut[held.atlas.neighbours[held.best.chart]] = False
    apart, start = replace(held, accepted=cut), int(np.flatnonzero(cut)[0])
    best = held.best.chart
    words = (
        rf"start \(chart {start}\) and end \(chart {best}\) are not connected: the {cut.sum()} charts that meet the "
        rf"requirements form \d+ pieces.*end in one of 1; nearest are chart (\d+) in start's piece and chart {best} in "
        r"end's, (\S+) apart, with (one|\d+) rejected charts? between.*such as chart \1, relax a requirement, or"
    )
    with pytest.raises(ga.GraspAtlasError, match=words) as caught:
        ga.shortest_path(apart, start, best, accepted=True)
    found = re.search(words, str(caught.value))
    assert found is not None
    assert ga.shortest_path(apart, start, int(found[1]), accepted=True).accepted.all()
    away = held.system.difference(held.atlas.centers[best], held.atlas.centers[int(found[1])])
    assert float(found[2]) == pytest.approx(np.linalg.norm(away), rel=1e-2)
    refused = int(np.flatnonzero(~held.accepted)[0])
    with pytest.raises(ga.GraspAtlasError, match=rf"start \(chart {refused}\) does not meet the requirements"):
        ga.shortest_path(held, refused, accepted=True)
    with pytest.raises(ga.GraspAtlasError, match="relax a requirement"):
        ga.shortest_path(replace(held, accepted=np.zeros_like(cut)))
