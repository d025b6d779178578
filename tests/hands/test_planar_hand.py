"""The planar hand of Section V, stated a second time straight from the paper, against the general route."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import coal
import numpy as np
import pinocchio as pin
import pytest
from helpers import ROOT, load_script, slow_but
from numpy.typing import NDArray
from oracles.planar_hand import (
    FINGERS,
    PaperGrasps,
    Parts,
    PlanarHand,
    angle,
    inverse_condition_number,
    to_general,
    to_paper,
)
from scipy.linalg import null_space
from scipy.optimize import brentq, minimize
from scipy.spatial import ConvexHull

import graspatlas as ga
from graspatlas import _core

Array = NDArray[np.float64]

RADIUS, EPSILON = 0.125, 0.4
#: Charts that the paper reports for this hand.
PAPER_CHARTS = 750
#: How far outside all polytopes a point of the manifold may lie, as a share of r: charts meet their bounds linearly.
COVER = 0.15
#: Inverse condition number below which the paper calls a grasp singular.
SINGULAR = 1e-3
#: Step at which an ascent is at rest; its error in the index is the square of it.
SMALL_STEP = 1e-8

MANIPULABILITY = ("inverse_condition_number", "manipulability_volume", "smallest_semi_axis")


# Both routes --------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def hand() -> PlanarHand:
    return PlanarHand.read()


@pytest.fixture(scope="module")
def problem(planar_result: ga.Result) -> ga.Problem:
    return planar_result.problem


@pytest.fixture(scope="module")
def result(planar_result: ga.Result) -> ga.Result:
    return planar_result


@pytest.fixture(scope="module")
def paper(hand: PlanarHand, problem: ga.Problem) -> ga.Atlas:
    """The atlas of the second route."""
    x1 = to_paper(hand, problem.x1_array)
    return ga.build_atlas(PaperGrasps(hand), x1, radius=RADIUS, epsilon=EPSILON)


@pytest.fixture(scope="module")
def general(hand: PlanarHand, problem: ga.Problem) -> ga.Atlas:
    """The atlas of the general route, with the metric of the second: orientations of phalanges, not joint angles."""
    L = np.kron(np.eye(3), [[1.0, 0.0], [1.0, 1.0]])
    N = null_space(hand.frozen[None])
    motions = N @ np.linalg.inv(np.linalg.cholesky(N.T @ L.T @ L @ N)).T
    np.testing.assert_allclose((L @ motions).T @ (L @ motions), np.eye(5), atol=1e-12)
    system = problem._system(motions)
    return ga.build_atlas(system, problem.x1_array, radius=RADIUS, epsilon=EPSILON)


@pytest.mark.slow
def test_jacobian_of_the_second_route(hand: PlanarHand, paper: ga.Atlas) -> None:
    rng = np.random.default_rng(0)
    for chart in range(0, paper.n_charts, 40):
        x = paper.centers[chart] + 0.05 * rng.normal(size=19)
        assert ga.systems.jacobian_error(paper.system, x) < 1e-7


def test_both_routes_have_the_same_dimension(hand: PlanarHand, problem: ga.Problem, paper: ga.Atlas) -> None:
    """Of all feasible grasps, at x1 and at other grasps."""
    everything = PaperGrasps(hand, frozen=False)
    for x in paper.centers[::50]:
        for system, point in ((everything, x), (problem.full_system, to_general(hand, x))):
            J = system.evaluate_jacobian(point)
            assert system.tangent_size - np.linalg.matrix_rank(J, tol=1e-6) == problem.full_dimension == 3


def test_normals_oppose_in_the_second_route(paper: ga.Atlas) -> None:
    """Its equation leaves the sign open; the whole atlas has the sign of eq (8)."""
    for x in paper.centers:
        p = Parts.of(x)
        m = np.column_stack([np.cos(p.u), np.sin(p.u)]) @ p.rotation().T
        assert np.sum(p.v[:, 1] * m, axis=1).max() < -1.0 + 1e-9


def test_angles_of_the_second_route_keep_to_one_branch(hand: PlanarHand, paper: ga.Atlas) -> None:
    """No joint comes near the cut of the arctangent, so eq (13) is smooth on the atlas and around it."""
    v = np.array([Parts.of(x).v for x in paper.centers])
    assert np.abs(angle(PaperGrasps(hand).base_1, v[:, :, 0])).max() < 2.5
    assert np.abs(angle(v[:, :, 0], v[:, :, 1])).max() < 2.5


def test_both_routes_make_as_many_charts(paper: ga.Atlas, general: ga.Atlas) -> None:
    assert paper.complete
    assert general.complete
    assert abs(paper.n_charts - general.n_charts) <= 0.05 * general.n_charts


def test_area_of_both_atlases(paper: ga.Atlas, general: ga.Atlas) -> None:
    """The metrics are the same, so the charts cover the same area."""
    assert paper.volumes.sum() == pytest.approx(general.volumes.sum(), rel=0.01)


def test_each_manifold_holds_the_charts_of_the_other(
    hand: PlanarHand, problem: ga.Problem, paper: ga.Atlas, general: ga.Atlas
) -> None:
    for x in general.centers:
        y = to_paper(hand, x)
        assert np.abs(paper.system.evaluate_residual(y)).max() < 1e-9
        np.testing.assert_allclose(to_general(hand, y), x, atol=1e-12)
    back = np.array([to_general(hand, y) for y in paper.centers])
    assert max(np.abs(general.system.evaluate_residual(x)).max() for x in back) < 1e-9
    assert np.abs(problem.frozen_residual(back, 2)).max() < 1e-9


@pytest.mark.parametrize("step", slow_but([5, 1], 5))
def test_each_atlas_covers_the_charts_of_the_other(
    hand: PlanarHand, paper: ga.Atlas, general: ga.Atlas, step: int
) -> None:
    for atlas, points in (
        (paper, [to_paper(hand, x) for x in general.centers[::step]]),
        (general, [to_general(hand, y) for y in paper.centers[::step]]),
    ):
        assert max(atlas.locate(point)[1] for point in points) < COVER * RADIUS


def test_quality_of_the_second_route(hand: PlanarHand, result: ga.Result) -> None:
    """The package's index at every chart, against a singular value decomposition written here."""
    mine = [inverse_condition_number(hand, to_paper(hand, x)) for x in result.atlas.centers]
    np.testing.assert_allclose(result.qualities, mine, rtol=1e-9, atol=1e-12)


@pytest.fixture(scope="module")
def hills(result: ga.Result) -> list[int]:
    """Charts that are better than all their neighbours, the best first."""
    return local_maxima(result.atlas, result.qualities)


def local_maxima(atlas: ga.Atlas, qualities: Array) -> list[int]:
    tops = [c for c in range(atlas.n_charts) if qualities[c] > qualities[atlas.neighbours[c]].max()]
    return sorted(tops, key=lambda c: -qualities[c])


def ascend(system: ga.systems.AnySystem, x: Array, quality: Callable[[Array], float]) -> Array:
    """The local maximum of a quality inside the bounds: steps in tangent spaces, each projected onto the manifold."""
    for _ in range(50):
        basis = null_space(system.evaluate_jacobian(x)).T
        place = partial(_core.project, system, x, basis)
        found = minimize(
            lambda u, place=place: -np.log(quality(place(u))),
            np.zeros(2),
            jac="3-point",
            method="SLSQP",
            bounds=[(-0.5 * RADIUS, 0.5 * RADIUS)] * 2,
            constraints={"type": "ineq", "fun": lambda u, place=place: system.slack(place(u))},
            options={"ftol": 1e-15, "maxiter": 100},
        )
        x = np.asarray(place(found.x))
        if np.linalg.norm(found.x) < SMALL_STEP:
            return x
    raise AssertionError("the ascent did not come to rest")


def test_both_routes_have_the_same_best_grasp(
    hand: PlanarHand, problem: ga.Problem, result: ga.Result, paper: ga.Atlas
) -> None:
    """The best charts lie where they fall; the grasp that they lead to is the same."""
    values = [inverse_condition_number(hand, y) for y in paper.centers]
    y = ascend(paper.system, paper.centers[int(np.argmax(values))], partial(inverse_condition_number, hand))
    x = ascend(result.atlas.system, result.best.x, partial(general_quality, problem))
    assert inverse_condition_number(hand, y) == pytest.approx(general_quality(problem, x), rel=1e-6)
    assert inverse_condition_number(hand, y) >= max(*values, result.best.quality)
    np.testing.assert_allclose(to_paper(hand, x), y, atol=1e-5)
    for system, point in ((result.atlas.system, x), (paper.system, y)):
        assert np.abs(system.evaluate_residual(point)).max() < 1e-9
        assert system.slack(point).min() > -1e-9


def general_quality(problem: ga.Problem, x: Array) -> float:
    one = ga.grasps.Grasps(problem, x[None], problem.full_system)
    return float(ga.quality.inverse_condition_number(one)[0])


@pytest.mark.parametrize("place", [1, 3, 5])
def test_both_routes_climb_the_same_hills(
    place: int, hand: PlanarHand, problem: ga.Problem, result: ga.Result, hills: list[int], paper: ga.Atlas
) -> None:
    """Local maxima below the best one."""
    start = result.atlas.centers[hills[place]]
    x = ascend(result.atlas.system, start, partial(general_quality, problem))
    y = ascend(paper.system, to_paper(hand, start), partial(inverse_condition_number, hand))
    assert inverse_condition_number(hand, y) == pytest.approx(general_quality(problem, x), rel=1e-6)


# What the paper says of this hand -----------------------------------------------------------------


def test_dimensions(problem: ga.Problem) -> None:
    """t = 3, k = 2 and so s = 1; 19 variables, as many as the paper's."""
    assert problem.full_dimension == 3
    assert problem.defaults["dimension"] == 2
    assert problem.frozen_motions(2) == 1
    assert problem.system(2).configuration_size == 19


def test_number_of_charts(result: ga.Result) -> None:
    assert (result.atlas.radius, result.atlas.epsilon) == (RADIUS, EPSILON)
    assert result.atlas.n_charts == pytest.approx(PAPER_CHARTS, rel=0.1)
    assert result.status is ga.Status.COMPLETE
    assert result.is_global


def test_result_verifies_itself(result: ga.Result) -> None:
    report = result.check()
    assert report.passed, str(report)


@pytest.mark.parametrize("index", MANIPULABILITY)
def test_every_index_has_several_local_maxima(index: str, result: ga.Result) -> None:
    """So that local search would not do."""
    qualities = ga.quality.evaluate(index, ga.grasps.Grasps(result.problem, result.atlas.centers, result.atlas.system))
    tops = local_maxima(result.atlas, qualities)
    assert len(tops) > 1
    assert qualities[tops[1]] < 0.99 * qualities[tops[0]]


def elbows(x: Array) -> Array:
    """Elbow angles [3] of a grasp of the general route."""
    cosine, sine = x[:12].reshape(3, 2, 2)[:, 1].T
    return np.arctan2(sine, cosine)


@pytest.mark.parametrize("index", MANIPULABILITY)
def test_the_worst_grasp_has_a_stretched_finger(index: str, result: ga.Result) -> None:
    qualities = ga.quality.evaluate(index, ga.grasps.Grasps(result.problem, result.atlas.centers, result.atlas.system))
    worst = result.atlas.centers[int(np.argmin(qualities))]
    assert np.abs(elbows(worst)).min() < 0.02


def test_singular_charts_have_a_stretched_finger(result: ga.Result) -> None:
    singular = np.flatnonzero(result.qualities < SINGULAR)
    assert len(singular) > 0
    for chart in singular:
        assert np.abs(elbows(result.atlas.centers[chart])).min() < 0.05


def test_a_stretched_finger_is_singular(problem: ga.Problem, result: ga.Result) -> None:
    """Between charts that bend an elbow to either side it is straight somewhere, and every index is zero there."""
    stretched = []
    for i, j in result.atlas.neighbour_pairs[::10]:
        for finger in range(3):
            stretched += stretched_between(result.atlas, int(i), int(j), finger)
    assert len(stretched) > 5
    grasps = ga.grasps.Grasps(problem, np.array(stretched), result.atlas.system)
    for index in MANIPULABILITY:
        assert ga.quality.evaluate(index, grasps).max() < 1e-9


def stretched_between(atlas: ga.Atlas, i: int, j: int, finger: int) -> list[Array]:
    """The grasp with a straight elbow on the way from a chart's centre to another's, if there is one."""
    towards = atlas.bases[i] @ atlas.system.difference(atlas.centers[i], atlas.centers[j])

    def grasp(share: float) -> Array:
        return np.asarray(atlas.point(i, share * towards))

    def elbow(share: float) -> float:
        return float(elbows(grasp(share))[finger])

    if elbow(0.0) * elbow(1.0) > 0.0 or abs(elbow(0.0)) > 1.0:
        return []
    return [grasp(brentq(elbow, 0.0, 1.0, xtol=1e-15))]


@pytest.mark.parametrize(
    "change",
    [
        {"object_xyz": (0.0, 0.0, 0.001)},
        {"object_quat_xyzw": (0.1, 0.0, 0.0, 1.0)},
        {"object_quat_xyzw": (0.0, 0.1, 0.0, 1.0)},
    ],
    ids=["lifted", "turned about x", "turned about y"],
)
def test_object_out_of_the_plane_is_refused(change: dict[str, Any], problem: ga.Problem) -> None:
    with pytest.raises(ga.GraspAtlasError, match="x-y plane"):
        dataclasses.replace(problem, x1=dataclasses.replace(problem.x1, **change))


def test_problem_file_with_the_object_out_of_the_plane_is_refused(problem: ga.Problem, tmp_path: Path) -> None:
    data = problem.to_dict()
    data["x1"]["object_xyz"][2] = 0.001
    path = tmp_path / "lifted.json"
    path.write_text(json.dumps(data), encoding="utf-8")
    with pytest.raises(ga.GraspAtlasError, match="x-y plane"):
        ga.load_problem(path)


# Shapes -------------------------------------------------------------------------------------------


def vertices(body: ga.Body, kind: pin.GeometryType) -> dict[str, Array]:
    """Vertices of each mesh of a body by link and file, in the frame of the link [n, 3]."""
    model = pin.buildModelFromXML(body.urdf)
    geometry = pin.buildGeomFromUrdfString(model, body.urdf, kind, package_dirs=list(body.package_dirs))
    meshes = {}
    for item in geometry.geometryObjects:
        if item.meshPath.endswith(".obj"):
            rows = [line.split()[1:] for line in Path(item.meshPath).read_text().splitlines() if line.startswith("v ")]
            pose = model.frames[item.parentFrame].placement.actInv(item.placement)
            meshes[f"{model.frames[item.parentFrame].name}/{Path(item.meshPath).stem}"] = (
                np.array(rows, float) @ pose.rotation.T + pose.translation
            )
    return meshes


@pytest.mark.parametrize("finger", range(3))
def test_a_finger_ends_at_its_contact_point(finger: int, hand: PlanarHand, problem: ga.Problem) -> None:
    length, name = hand.lengths[finger, 1], FINGERS[finger]
    pad = vertices(problem.hand, pin.VISUAL)[f"{name}_distal/pad"]
    link = vertices(problem.hand, pin.VISUAL)[f"{name}_distal/{name}_distal"]
    body = vertices(problem.hand, pin.COLLISION)[f"{name}_distal/{name}_distal_convex"]
    assert pad[:, 0].max() == pytest.approx(length, abs=1e-9)
    tip = pad[pad[:, 0] > length - 1e-9]
    np.testing.assert_allclose(tip[:, 1], 0.0, atol=1e-9)
    assert tip[:, 2].min() < 0.0 < tip[:, 2].max()
    assert link[:, 0].max() < length - 1e-3
    assert body[:, 0].max() == pytest.approx(length, abs=1e-4)


@pytest.mark.parametrize("finger", range(3))
def test_a_rim_lies_on_its_arc(finger: int, hand: PlanarHand, problem: ga.Problem) -> None:
    rim = vertices(problem.object, pin.VISUAL)[f"three_arcs/{FINGERS[finger]}_rim"][:, :2] - hand.centers[finger]
    distance = np.linalg.norm(rim, axis=1)
    assert distance.max() == pytest.approx(hand.radii[finger], abs=2e-6)
    low, high = hand.arcs[finger]
    turns = (np.arctan2(rim[:, 1], rim[:, 0]) - low + np.pi) % (2.0 * np.pi) - np.pi
    assert turns.min() == pytest.approx(0.0, abs=1e-3)
    assert turns.max() == pytest.approx(high - low, abs=1e-3)


def test_the_object_stays_behind_its_arcs(hand: PlanarHand, problem: ga.Problem) -> None:
    """Where a finger may touch there is the rim, and nothing of the body beyond it."""
    body = vertices(problem.object, pin.VISUAL)["three_arcs/object_body"]
    hull = ConvexHull(body[:, :2])
    for center, radius, arc in zip(hand.centers, hand.radii, hand.arcs, strict=True):
        u = np.linspace(*arc, 50)
        touch = center + radius * np.column_stack([np.cos(u), np.sin(u)])
        assert (touch @ hull.equations[:, :2].T + hull.equations[:, 2]).max(axis=1).min() > 2e-4


def test_collision_shapes_touch_where_the_fingers_do(result: ga.Result) -> None:
    """At grasps all over the atlas the distal phalanges end on the object, and nothing else comes near it."""
    (model, shapes), (_, body) = (collision_shapes(b) for b in (result.problem.hand, result.problem.object))
    links = np.array([model.frames[other.parentFrame].name for other in shapes.geometryObjects])
    fingertips = [links == link for link in np.unique(links) if link.endswith("distal")]
    assert len(fingertips) == 3
    for chart in range(0, result.atlas.n_charts, 25):
        grasp = result.grasp(chart)
        T = pin.SE3(grasp.T_palm_object)
        distances = np.array(
            [
                min(distance(other, pose, item, T * item.placement) for item in body.geometryObjects)
                for other, pose in zip(shapes.geometryObjects, poses(model, shapes, grasp.q), strict=True)
            ]
        )
        np.testing.assert_allclose([distances[shape].min() for shape in fingertips], 0.0, atol=1e-6)
        assert distances[~np.any(fingertips, axis=0)].min() > 5e-4


def distance(a: pin.GeometryObject, T_a: pin.SE3, b: pin.GeometryObject, T_b: pin.SE3) -> float:
    """Distance between two shapes in place, negative when they overlap [m]."""
    first, second = (coal.Transform3s(T.rotation, T.translation) for T in (T_a, T_b))
    return float(coal.distance(a.geometry, first, b.geometry, second, coal.DistanceRequest(), coal.DistanceResult()))


def test_hand_does_not_touch_itself(result: ga.Result) -> None:
    """Nowhere on the atlas, though two fingers stretched towards each other would meet."""
    model, shapes = collision_shapes(result.problem.hand)
    assert all(isinstance(item.geometry, coal.ConvexBase | coal.Cylinder) for item in shapes.geometryObjects)
    shapes.addAllCollisionPairs()
    pin.removeCollisionPairsFromXML(model, shapes, result.problem.hand.srdf)
    data, shape_data = model.createData(), shapes.createData()

    def hits(q: Array) -> bool:
        return bool(pin.computeCollisions(model, data, shapes, shape_data, q, True))

    assert not any(hits(x[:12]) for x in result.atlas.centers)
    towards_each_other = np.array([np.pi / 2, 0.0, 0.0, 0.0, np.pi, 0.0])
    assert hits(np.stack([np.cos(towards_each_other), np.sin(towards_each_other)], axis=1).ravel())


def collision_shapes(body: ga.Body) -> tuple[pin.Model, pin.GeometryModel]:
    model = pin.buildModelFromXML(body.urdf)
    dirs = list(body.package_dirs)
    return model, pin.buildGeomFromUrdfString(model, body.urdf, pin.COLLISION, package_dirs=dirs)


def poses(model: pin.Model, shapes: pin.GeometryModel, q: Array) -> list[pin.SE3]:
    data, shape_data = model.createData(), shapes.createData()
    pin.updateGeometryPlacements(model, data, shapes, shape_data, q)
    return list(shape_data.oMg)


def test_meshes_can_be_made_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """From numbers that agree with the URDF and the problem file, and to the same bytes."""
    folder = ROOT / "robots" / "planar_hand"
    script = load_script("planar_hand")
    monkeypatch.setattr(script, "FOLDER", tmp_path)
    script.main()
    kept = folder / "meshes"
    assert sorted(p.name for p in tmp_path.iterdir()) == sorted(p.name for p in kept.iterdir())
    for path in tmp_path.iterdir():
        assert path.read_bytes() == (kept / path.name).read_bytes(), path.name
    hand = PlanarHand.read()
    np.testing.assert_array_equal(script.ANCHORS, hand.anchors)
    np.testing.assert_array_equal([[script.PROXIMAL[n], script.DISTAL[n]] for n in FINGERS], hand.lengths)
    np.testing.assert_array_equal(script.ARC_CENTERS, hand.centers)
    np.testing.assert_array_equal(script.ARC_RADII, hand.radii)
    np.testing.assert_array_equal([script.ARCS[name] for name in FINGERS], hand.arcs)
