"""The planar hand of Section V, stated a second time straight from the paper, against the general route."""

from __future__ import annotations

import dataclasses
import importlib.util
import json
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from importlib import resources
from pathlib import Path
from typing import Any

import coal
import numpy as np
import pinocchio as pin
import pytest
import yaml
from numpy.typing import NDArray
from scipy.linalg import null_space
from scipy.optimize import brentq, minimize
from scipy.spatial import ConvexHull

import graspatlas as ga
from graspatlas import _core

Array = NDArray[np.float64]

FINGERS = ("first", "second", "third")
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


# The second route ---------------------------------------------------------------------------------


def turned(a: Array) -> Array:
    """A vector of the plane turned by a quarter, or several [..., 2]."""
    return np.stack([-a[..., 1], a[..., 0]], axis=-1)


def angle(a: Array, b: Array) -> Array:
    """Angles from the vectors a to the vectors b [...], in (-pi, pi]."""
    return np.arctan2(np.sum(turned(a) * b, axis=-1), np.sum(a * b, axis=-1))


@dataclass(frozen=True)
class PlanarHand:
    """The constants of Fig. 8, read from the files as numbers [m, rad].

    Attributes:
        anchors: a_i [3, 2].
        lengths: l_i1 and l_i2 [3, 2].
        centers: c_i, in the object's frame [3, 2].
        radii: l_i3 [3].
        arcs: a_i and b_i [3, 2].
        theta_1: Joint angles at x1: base and elbow of each finger [3, 2].
        frozen: E_s [6].
        scale: Length that counts as one.
    """

    anchors: Array
    lengths: Array
    centers: Array
    radii: Array
    arcs: Array
    theta_1: Array
    frozen: Array
    scale: float

    @classmethod
    def read(cls) -> PlanarHand:
        """The constants, by ways of their own: no kinematics and no patch of the package is used."""
        file = resources.files("graspatlas") / "problems" / "planar_hand.yaml"
        data = yaml.safe_load(file.read_text(encoding="utf-8"))
        urdf = (ga.hand.robots_folder() / data["hand"]["urdf"]).read_text(encoding="utf-8")
        joints, contacts = data["x1"]["joints"], data["contacts"]
        arcs = [contact["object"] for contact in contacts]
        assert [contact["frame"] for contact in contacts] == [f"{name}_distal" for name in FINGERS]
        covariance = np.array(data["hand_motions"]["covariance"])
        assert data["hand_motions"]["joints"] == [f"{name}_{j}" for name in FINGERS for j in ("base", "elbow")]
        return cls(
            anchors=np.array([joint_origin(urdf, f"{name}_base")[:2] for name in FINGERS]),
            lengths=np.array(
                [
                    [joint_origin(urdf, f"{name}_elbow")[0], contact["hand"]["position"][0]]
                    for name, contact in zip(FINGERS, contacts, strict=True)
                ]
            ),
            centers=np.array([arc["origin"][:2] for arc in arcs]),
            radii=np.array([arc["radius"] for arc in arcs]),
            arcs=np.array([arc["u_interval"] for arc in arcs]),
            theta_1=np.array([[joints[f"{name}_base"], joints[f"{name}_elbow"]] for name in FINGERS]),
            frozen=np.linalg.eigh(covariance)[1][:, 0],
            scale=data["length_scale"],
        )


def joint_origin(urdf: str, joint: str) -> Array:
    """Where the text of a URDF puts a joint [3]."""
    part = urdf[urdf.index(f'<joint name="{joint}"') :]
    return np.array(part[part.index('xyz="') + 5 :].split('"')[0].split(), float)


@dataclass(frozen=True)
class Parts:
    """A vector x of the second route, taken apart.

    Attributes:
        v: Unit vectors along the phalanges [3 fingers, 2 phalanges, 2].
        t: Position of the object, in units of the length scale [2].
        o: Its orientation (s_o, c_o) [2].
        u: Angles of the contacts on their arcs [3].
    """

    v: Array
    t: Array
    o: Array
    u: Array

    @classmethod
    def of(cls, x: Array) -> Parts:
        return cls(x[:12].reshape(3, 2, 2), x[12:14], x[14:16], x[16:])

    def rotation(self) -> Array:
        """The matrix of eq (23)."""
        s, c = self.o
        return np.array([[c, -s], [s, c]])


class PaperGrasps(ga.System):
    """Eqs (19) to (25), and (13) unless `frozen` is False: 19 variables, lengths in units of the length scale.

    The arcs are fixed to the object, so u_i is read as an angle in its frame: with the w(u_i) of eq (24) taken in the
    palm's frame the interval [a_i, b_i] would not bound an arc of the object.
    """

    def __init__(self, hand: PlanarHand, frozen: bool = True) -> None:
        lower, upper = np.full(19, -np.inf), np.full(19, np.inf)
        lower[16:], upper[16:] = hand.arcs.T
        super().__init__(19, 17 if frozen else 16, lower, upper)
        self.hand = hand
        self.frozen = frozen
        first = hand.theta_1[:, 0]
        self.base_1 = np.column_stack([np.cos(first), np.sin(first)])

    def residual(self, x: Array) -> Array:
        p, hand = Parts.of(x), self.hand
        w = np.column_stack([np.cos(p.u), np.sin(p.u)])
        q = (hand.anchors + np.einsum("ij,ijc->ic", hand.lengths, p.v)) / hand.scale
        o = p.t + (hand.centers + hand.radii[:, None] * w) @ p.rotation().T / hand.scale
        units = np.r_[np.sum(p.v**2, axis=2).ravel(), p.o @ p.o] - 1.0
        # n_i = -m_i turns about one axis: that the two are parallel is one equation, the sign is looked at elsewhere.
        parallel = np.sum(turned(p.v[:, 1]) * (w @ p.rotation().T), axis=1)
        rows = [units, (q - o).ravel(), parallel]
        return np.concatenate([*rows, self.frozen_motion(p)] if self.frozen else rows)

    def frozen_motion(self, p: Parts) -> Array:
        """Eq (13) [1]; base angles are counted from x1, elbow angles from a straight finger."""
        elbow = angle(p.v[:, 0], p.v[:, 1]) - self.hand.theta_1[:, 1]
        return np.array([np.column_stack([angle(self.base_1, p.v[:, 0]), elbow]).ravel() @ self.hand.frozen])

    def jacobian(self, x: Array) -> Array:
        p, hand = Parts.of(x), self.hand
        w = np.column_stack([np.cos(p.u), np.sin(p.u)])
        R, D = p.rotation(), np.array([[[0.0, -1.0], [1.0, 0.0]], np.eye(2)])  # dR / ds_o, dR / dc_o
        J = np.zeros((17, 19))
        J[np.repeat(range(6), 2), range(12)] = 2.0 * p.v.ravel()
        J[6, 14:16] = 2.0 * p.o
        for i in range(3):
            rows, v2 = slice(7 + 2 * i, 9 + 2 * i), slice(4 * i + 2, 4 * i + 4)
            arm = hand.centers[i] + hand.radii[i] * w[i]
            J[rows, 4 * i : 4 * i + 4] = np.kron(hand.lengths[i], np.eye(2)) / hand.scale
            J[rows, 12:14] = -np.eye(2)
            J[rows, 14:16] = -(D @ arm).T / hand.scale
            J[rows, 16 + i] = -hand.radii[i] * R @ turned(w[i]) / hand.scale
            J[13 + i, v2] = -turned(R @ w[i])
            J[13 + i, 14:16] = turned(p.v[i, 1]) @ (D @ w[i]).T
            J[13 + i, 16 + i] = turned(p.v[i, 1]) @ R @ turned(w[i])
            base, distal = (turned(p.v[i, j]) / (p.v[i, j] @ p.v[i, j]) for j in (0, 1))
            e_base, e_elbow = hand.frozen[2 * i : 2 * i + 2]
            J[16, 4 * i : 4 * i + 4] = np.r_[(e_base - e_elbow) * base, e_elbow * distal]
        return J[: self.n_equations]


def to_paper(hand: PlanarHand, x: Array) -> Array:
    """The second route's x of a grasp of the general route: both have 19 numbers, and they are not the same."""
    base, elbow = x[:12].reshape(3, 2, 2).transpose(1, 2, 0)
    global_2 = np.stack([base[0] * elbow[0] - base[1] * elbow[1], base[1] * elbow[0] + base[0] * elbow[1]])
    v = np.stack([base.T, global_2.T], axis=1)
    return np.r_[v.ravel(), x[12:14] / hand.scale, x[15], x[14], x[16:]]


def to_general(hand: PlanarHand, x: Array) -> Array:
    """The inverse of :func:`to_paper`."""
    p = Parts.of(x)
    v = p.v / np.linalg.norm(p.v, axis=2, keepdims=True)
    elbow = np.column_stack([np.sum(v[:, 0] * v[:, 1], axis=1), np.sum(turned(v[:, 0]) * v[:, 1], axis=1)])
    return np.r_[np.stack([v[:, 0], elbow], axis=1).ravel(), p.t * hand.scale, p.o[::-1], p.u]


def inverse_condition_number(hand: PlanarHand, x: Array) -> float:
    """Smallest over largest semi-axis of the manipulability ellipsoid, lengths in millimetres; by NumPy alone."""
    p = Parts.of(x)
    J, Gt = np.zeros((6, 6)), np.zeros((6, 3))
    links = 1e3 * hand.lengths[:, :, None] * turned(p.v)
    tips = 1e3 * (hand.anchors + np.einsum("ij,ijc->ic", hand.lengths, p.v))
    for i in range(3):
        J[2 * i : 2 * i + 2, 2 * i : 2 * i + 2] = np.column_stack([links[i].sum(axis=0), links[i, 1]])
        Gt[2 * i : 2 * i + 2] = np.column_stack([np.eye(2), turned(tips[i] - 1e3 * hand.scale * p.t)])
    # Object velocity t and joint velocity J^-1 G' t belong together; unit joint velocities make the ellipsoid.
    sigma = np.linalg.svd(np.linalg.solve(J, Gt), compute_uv=False)
    return float(sigma[-1] / sigma[0])


# Both routes --------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def hand() -> PlanarHand:
    return PlanarHand.read()


@pytest.fixture(scope="module")
def problem() -> ga.Problem:
    return ga.load_problem("planar_hand")


@pytest.fixture(scope="module")
def result(problem: ga.Problem) -> ga.Result:
    return ga.optimize(problem)


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


def test_each_atlas_covers_the_charts_of_the_other(hand: PlanarHand, paper: ga.Atlas, general: ga.Atlas) -> None:
    for atlas, points in (
        (paper, [to_paper(hand, x) for x in general.centers]),
        (general, [to_general(hand, y) for y in paper.centers]),
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
    (item,) = body.geometryObjects
    links = [model.frames[other.parentFrame].name for other in shapes.geometryObjects]
    distal = np.array([link.endswith("distal") for link in links])
    assert distal.sum() == 3
    for chart in range(0, result.atlas.n_charts, 25):
        grasp = result.grasp(chart)
        T = pin.SE3(grasp.T_palm_object) * item.placement
        distances = np.array(
            [
                distance(other, pose, item, T)
                for other, pose in zip(shapes.geometryObjects, poses(model, shapes, grasp.q), strict=True)
            ]
        )
        np.testing.assert_allclose(distances[distal], 0.0, atol=2.5e-4)
        assert distances[~distal].min() > 5e-4


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
    folder = Path(__file__).parents[1] / "robots" / "planar_hand"
    spec = importlib.util.spec_from_file_location("make_meshes_planar_hand", folder / "make_meshes.py")
    assert spec is not None
    assert spec.loader is not None
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
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
