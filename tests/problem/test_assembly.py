"""The grasp system against Pinocchio's Python interface and NumPy: contacts, hand motions, manipulability."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from helpers import BENT, read_json, tripod_problem

import graspatlas as ga
from graspatlas import _core
from graspatlas.atlas.verification import check_atlas

MANIPULABILITY = ("inverse_condition_number", "manipulability_volume", "smallest_semi_axis")
PROBLEMS = ("schunk_can", "schunk_oil_bottle")
QUALITY = read_json("grasp_quality.json")["grasps"]
POSES = read_json("link_poses.json")


def own_patch(patch: ga.patches.Patch, u: float, v: float) -> tuple[np.ndarray, np.ndarray]:
    """Point and outward normal of the patches of the bundled problems, straight from their definition."""
    if isinstance(patch, ga.patches.Point):
        return np.array(patch.position), np.array(patch.normal)
    assert patch.origin == (0.0, 0.0, 0.0)
    assert patch.axis == (0.0, 1.0, 0.0)
    if isinstance(patch, ga.patches.Cylinder):
        radius, slope = patch.radius, 0.0
    else:
        (h0, h1), (r0, r1) = patch.heights, patch.radii
        slope = (r1 - r0) / (h1 - h0)
        radius = r0 + slope * (v - h0)
    point = np.array([radius * np.cos(u), v, radius * np.sin(u)])
    normal = np.array([np.cos(u), -slope, np.sin(u)])
    return point, normal / np.linalg.norm(normal)


class OwnRoute:
    """Contacts of a grasp, computed from the problem with Pinocchio's Python interface."""

    def __init__(self, problem: ga.Problem) -> None:
        self.problem = problem
        self.model = pin.buildModelFromXML(problem.hand.urdf)
        self.data = self.model.createData()

    def contacts(self, x: np.ndarray) -> list[tuple[np.ndarray, ...]]:
        """For each contact: hand point, hand normal, object point, object normal, Jacobian of the hand point [3, h]."""
        nq = self.model.nq
        pin.computeJointJacobians(self.model, self.data, x[:nq])
        pin.updateFramePlacements(self.model, self.data)
        self.R, self.p = pin.Quaternion(x[nq + 3 : nq + 7]).matrix(), x[nq : nq + 3]
        free = iter(x[nq + 7 :])
        rows = []
        for contact in self.problem.contacts:
            frame = self.model.getFrameId(contact.frame)
            M = self.data.oMf[frame]
            point, normal = own_patch(contact.hand, 0.0, 0.0)
            u, v = (contact.frozen[name] if name in contact.frozen else next(free) for name in ("u", "v"))
            o, m = own_patch(contact.object, u, v)
            J = pin.getFrameJacobian(self.model, self.data, frame, pin.LOCAL_WORLD_ALIGNED)
            J_point = J[:3] - pin.skew(M.rotation @ point) @ J[3:]
            rows.append((M.act(point), M.rotation @ normal, self.R @ o + self.p, self.R @ m, J_point))
        return rows


def own_semi_axes(J: np.ndarray, G: np.ndarray, unit: float) -> np.ndarray:
    """Semi-axes by singular value decompositions only; J and G are in metres."""
    J, Gt = J / unit, G.T.copy()
    Gt[:, 3:] /= unit
    pseudo = np.linalg.pinv(J, rcond=1e-9)
    mismatch = (np.eye(len(J)) - J @ pseudo) @ Gt
    _, s, Vt = np.linalg.svd(mismatch)
    coordinated = Vt[(s > 1e-9 * np.linalg.norm(Gt)).sum() :].T
    axes = np.zeros(Gt.shape[1])
    if coordinated.shape[1]:
        s = np.linalg.svd(pseudo @ Gt @ coordinated, compute_uv=False)
        if s.min() > 1e-9 * s.max() and len(s) == coordinated.shape[1]:
            axes[len(axes) - len(s) :] = 1.0 / s
    return np.sort(axes)


def charts(result: ga.Result, count: int, seed: int) -> np.ndarray:
    return np.random.default_rng(seed).choice(result.atlas.n_charts, count, replace=False)


@pytest.fixture(params=["can_result", "bottle_result"])
def result(request) -> ga.Result:
    return request.getfixturevalue(request.param)


@pytest.mark.parametrize("name", ["can", "oil_bottle"])
def test_link_poses(can, name):
    grasp = POSES["grasps"][name]
    angles = dict(zip(POSES["joints"], grasp["q"], strict=True))
    places = can.hand.link_placements(np.array([angles[joint] for joint in can.hand.joints]))
    for link, expected in grasp["T_palm_link"].items():
        np.testing.assert_allclose(places[link], expected, atol=1e-11)


@pytest.mark.parametrize(("name", "t"), [("schunk_can", 8), ("schunk_oil_bottle", 9)])
def test_dimensions(name, t):
    problem = ga.load_problem(name)
    assert problem.full_dimension == t
    system = problem.full_system
    assert (system.n_contacts, system.n_equations, system.object_dof) == (3, 15, 6)
    assert system.dimension == t == 13 + 6 + system.n_parameters - 15
    for k in range(1, t + 1):
        assert problem.frozen_motions(k) == t - k
        assert problem.system(k).dimension == k
        assert problem.system(k).tangent_size == k + 15


@pytest.mark.parametrize("name", PROBLEMS)
def test_first_grasp_touches(name):
    problem = ga.load_problem(name)
    x1 = problem.x1_array
    assert np.abs(problem.full_system.evaluate_residual(x1)).max() < 1e-6
    for k in (1, 2, 3, problem.full_dimension):
        np.testing.assert_array_equal(
            problem.system(k).evaluate_residual(x1), problem.full_system.evaluate_residual(x1)
        )
    assert problem.full_system.slack(x1).min() >= 0.0


def test_contacts_by_a_second_route(result):
    problem, atlas = result.problem, result.atlas
    route = OwnRoute(problem)
    covariance = problem.motions.reordered(problem.hand.joints).covariance
    E_s = np.linalg.eigh(covariance)[1][:, : problem.full_dimension - 2]
    for i in charts(result, 60, 1):
        x = atlas.centers[i]
        grasp = result.grasp(int(i))
        arrays = route.contacts(x)
        for c, (q, n, o, m, _) in enumerate(arrays):
            assert np.abs(q - o).max() / problem.length_scale < 1e-9
            assert np.abs(n + m).max() < 1e-9
            np.testing.assert_allclose(grasp.contact_points[c], o, atol=1e-12)
            np.testing.assert_allclose(grasp.contact_normals[c], m, atol=1e-12)
        assert np.abs(E_s.T @ (x[:13] - problem.x1_array[:13])).max() < 1e-9
        np.testing.assert_allclose(grasp.T_palm_object[:3, :3], route.R, atol=1e-12)
        np.testing.assert_array_equal(grasp.object_xyz, x[13:16])
        np.testing.assert_array_equal(grasp.q, x[:13])
        assert abs(abs(grasp.object_quat_xyzw @ x[16:20]) - 1.0) < 1e-12


def test_grasp_matrices_by_a_second_route(result):
    route = OwnRoute(result.problem)
    for i in charts(result, 50, 2):
        grasp = result.grasp(int(i))
        rows = route.contacts(grasp.x)
        J = np.vstack([row[4] for row in rows])
        G = np.hstack([np.vstack([np.eye(3), pin.skew(row[2] - route.p)]) for row in rows])
        np.testing.assert_allclose(grasp.J, J, atol=1e-9)
        np.testing.assert_allclose(grasp.G, G, atol=1e-9)
        for unit in (1e-3, 1.0):
            got = _core.semi_axes(result.atlas.system, grasp.x[None], unit)[0]
            np.testing.assert_allclose(got, own_semi_axes(J, G, unit), rtol=1e-6, atol=1e-12)


@pytest.mark.parametrize("name", PROBLEMS)
@pytest.mark.parametrize(("unit", "metres"), [("mm", 1e-3), ("m", 1.0)])
def test_manipulability_at_the_first_grasp(name, unit, metres):
    problem = ga.load_problem(name)
    expected = QUALITY[name][unit]
    axes = _core.semi_axes(problem.full_system, problem.x1_array[None], metres)[0]
    np.testing.assert_allclose(axes, expected["semi_axes"], rtol=1e-9)
    assert axes[0] / axes[-1] == pytest.approx(expected["inverse_condition_number"], rel=1e-9)
    assert axes.prod() == pytest.approx(expected["manipulability_volume"], rel=1e-9)


@pytest.mark.parametrize("name", PROBLEMS)
@pytest.mark.parametrize("index", MANIPULABILITY)
def test_indices_at_the_first_grasp(name, index):
    problem = ga.load_problem(name)
    grasps = ga.Grasps(problem, problem.x1_array)
    assert getattr(ga.quality, index)(grasps)[0] == pytest.approx(QUALITY[name]["mm"][index], rel=1e-9)
    np.testing.assert_allclose(grasps.semi_axes[0], QUALITY[name]["mm"]["semi_axes"], rtol=1e-9)


@pytest.fixture(scope="module")
def tripod() -> ga.Problem:
    return tripod_problem()


def indices(problem: ga.Problem, x: np.ndarray) -> list[float]:
    return [float(getattr(ga.quality, name)(ga.Grasps(problem, x))[0]) for name in MANIPULABILITY]


def with_joints(problem: ga.Problem, **joints: float) -> np.ndarray:
    x = problem.x1_array.copy()
    for name, value in joints.items():
        x[problem.hand.joints.index(name)] = value
    return x


def test_a_made_hand_works(tripod):
    assert tripod.full_dimension == 9 + 6 + 6 - 15
    assert min(indices(tripod, tripod.x1_array)) > 0.0
    axes = ga.Grasps(tripod, tripod.x1_array)[0]
    np.testing.assert_allclose(axes.semi_axes, own_semi_axes(axes.J, axes.G, 1e-3), rtol=1e-9)
    atlas = ga.build_atlas(tripod.full_system, tripod.x1_array, radius=0.5, epsilon=0.5, max_charts=30)
    assert atlas.residuals.max() < 1e-9


@pytest.mark.parametrize("finger", ["a", "b", "c"])
def test_a_singular_grasp_has_index_zero(tripod, finger):
    """A straight finger cannot move its tip along itself."""
    x = with_joints(tripod, **{f"{finger}1": -0.6, f"{finger}2": 0.0})
    assert np.linalg.matrix_rank(ga.Grasps(tripod, x)[0].J, tol=1e-9) == 8
    assert indices(tripod, x) == [0.0, 0.0, 0.0]
    nearly = with_joints(tripod, **{f"{finger}1": -0.6, f"{finger}2": 1e-3})
    assert 0.0 < indices(tripod, nearly)[2] < 0.1 * indices(tripod, tripod.x1_array)[2]


def with_contacts_on_a_line(problem: ga.Problem) -> np.ndarray:
    """x1 with other points of the object's planes, which have three heights: a line climbs through them."""
    x = problem.x1_array.copy()
    heights = ga.Grasps(problem, x)[0].contact_points[:, 2]
    parameters = []
    for contact, climb in zip(problem.contacts, heights, strict=True):
        place = contact.object.locate([2.0 * climb, 0.5 * climb + 0.01, climb])
        parameters += [0.0] * (len(contact.free()) - 2) + list(place)
    x[-len(parameters) :] = parameters
    points = ga.Grasps(problem, x)[0].contact_points
    assert np.linalg.matrix_rank(points[1:] - points[0], tol=1e-9) == 1
    return x


def test_an_indeterminate_grasp_has_index_zero(tripod):
    """With all contacts on a line the object can turn about it; the volume would grow without bound."""
    x = with_contacts_on_a_line(tripod)
    assert indices(tripod, x) == [0.0, 0.0, 0.0]
    assert (ga.Grasps(tripod, x).semi_axes == 0.0).all()


@pytest.fixture(scope="module")
def underactuated() -> ga.Problem:
    return tripod_problem({"a0": 0.1, "b0": 0.2, "c0": -0.3}, axes=["0 1 0"], rolling=True)


def test_an_underactuated_hand(underactuated):
    """One joint a finger: few object motions are coordinated, the other semi-axes are zero."""
    grasp = ga.Grasps(underactuated, underactuated.x1_array)[0]
    assert grasp.semi_axes.shape == (6,)
    expected = own_semi_axes(grasp.J, grasp.G, 1e-3)
    np.testing.assert_allclose(grasp.semi_axes, expected, rtol=1e-6, atol=1e-12)
    assert (grasp.semi_axes[:3] == 0.0).all()
    assert np.isfinite(indices(underactuated, underactuated.x1_array)).all()


def test_an_indeterminate_grasp_of_an_underactuated_hand_has_index_zero(underactuated):
    """The only motion that the hand does not hinder is the one that it does not hold."""
    x = with_contacts_on_a_line(underactuated)
    assert (ga.Grasps(underactuated, x).semi_axes == 0.0).all()
    assert indices(underactuated, x) == [0.0, 0.0, 0.0]


def test_an_index_survives_a_first_grasp_without_one():
    """x1 may be singular or indeterminate: that does not make all other grasps worthless."""
    straight = tripod_problem(dict(BENT, a2=0.0), rolling=True)
    bent = tripod_problem(rolling=True)
    collinear = replace(bent, x1=replace(bent.x1, parameters=None))
    points = ga.Grasps(collinear, collinear.x1_array)[0].contact_points
    assert np.linalg.matrix_rank(points[1:] - points[0], tol=1e-9) == 1
    good = bent.x1_array
    assert min(indices(bent, good)) > 0.0
    assert min(indices(collinear, good)) > 0.0
    assert min(indices(straight, good)) > 0.0


SLIDING = ["prismatic", "revolute", "revolute"]
SLID = {name: 0.01 if name.endswith("0") else angle for name, angle in BENT.items()}


def test_prismatic_joints_count_in_units_of_length_scale():
    problem = tripod_problem(SLID, kinds=SLIDING)
    system, x = problem.full_system, problem.x1_array
    v = np.zeros(system.tangent_size)
    v[0] = 1.0
    assert system.integrate(x, v)[0] - x[0] == pytest.approx(problem.length_scale)
    assert system.integrate(x, np.roll(v, 1))[1] - x[1] == pytest.approx(1.0)
    rescaled = replace(problem, length_scale=0.05)
    assert rescaled.full_system.integrate(x, v)[0] - x[0] == pytest.approx(0.05)
    np.testing.assert_allclose(system.difference(x, system.integrate(x, v)), v, atol=1e-12)
    assert ga.systems.jacobian_error(system, x) < 1e-6


@pytest.mark.parametrize(("kinds", "start"), [("revolute", BENT), (SLIDING, SLID), ("continuous", BENT)])
def test_hand_motions_of_other_joints_hold(kinds, start):
    """Eq (13) in the joints' own units, where a tangent vector counts lengths in length_scale."""
    names = tuple(f"{finger}{i}" for finger in "abc" for i in range(3))
    samples = np.random.default_rng(3).normal(size=(60, 9)) * np.linspace(1.0, 0.1, 9)
    motions = ga.HandMotions.from_samples(samples, names)
    problem = tripod_problem(start, kinds=kinds, motions=motions)
    assert problem.full_dimension == 6
    # Three of the six dimensions slide the object in its plane and leave the hand where it is.
    atlas = ga.build_atlas(problem.system(4), problem.x1_array, radius=0.2, epsilon=0.5, max_charts=60)
    assert atlas.n_charts == 60
    report = check_atlas(atlas)
    assert report.passed, str(report)
    assert np.abs(problem.frozen_residual(atlas.centers, 4)).max() < 1e-9
    E_s = np.linalg.eigh(motions.reordered(problem.hand.joints).covariance)[1][:, :2]
    q, q1 = atlas.centers[:, : -6 - 7], problem.x1_array[: -6 - 7]
    if kinds == "continuous":
        q, q1 = (np.arctan2(a[..., 1::2], a[..., ::2]) for a in (q, q1))
        turns = (q - q1 + np.pi) % (2 * np.pi) - np.pi
    else:
        turns = q - q1
    assert np.abs(turns @ E_s).max() < 1e-9
    assert np.abs(turns).max() > 1e-3


def test_length_scale_changes_the_metric_only(can):
    other = replace(can, length_scale=0.02)
    x = can.x1_array
    np.testing.assert_array_equal(other.x1_array, x)
    v = np.zeros(can.full_system.tangent_size)
    v[13] = 1.0
    assert np.linalg.norm(can.full_system.integrate(x, v)[13:16] - x[13:16]) == pytest.approx(0.01)
    assert np.linalg.norm(other.full_system.integrate(x, v)[13:16] - x[13:16]) == pytest.approx(0.02)


def test_bounds_are_the_limits_and_the_patch_intervals(can):
    system, hand = can.full_system, can.hand
    names = system.bound_names
    assert len(names) == len(set(names)) == 2 * 13 + 2 * 2
    lower, upper = hand.joint_limits
    slack = dict(zip(names, system.slack(can.x1_array), strict=True))
    for i, joint in enumerate(hand.joints):
        assert slack[f"upper limit of joint '{joint}'"] == pytest.approx(upper[i] - can.x1_array[i])
        assert slack[f"lower limit of joint '{joint}'"] == pytest.approx(can.x1_array[i] - lower[i])
    ends = [value for name, value in slack.items() if "patch parameter" in name]
    v = can.x1_array[[21, 23]]
    expected = np.array([[0.027 - v[0], v[0] + 0.037], [0.027 - v[1], v[1] + 0.037]]).ravel() / can.length_scale
    np.testing.assert_allclose(ends, expected, atol=1e-12)
