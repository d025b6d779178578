"""Indices of contact wrenches, isotropy and centrality: closed forms, Qhull, linear programming, invariances."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from helpers import random_rotation, slow_but, symmetric_planar_problem
from numpy.typing import NDArray
from oracles.wrench_lp import margin_by_linear_programming
from scipy.optimize import linprog
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

import graspatlas as ga
from graspatlas import quality
from graspatlas.quality import wrenches
from graspatlas.requirements import ForceClosure

Array = NDArray[np.float64]

TETRAHEDRON = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]) / np.sqrt(3.0)
BOX_FACES = np.vstack([np.eye(3), -np.eye(3)])


def ring(m: int) -> Array:
    """Unit vectors round the z axis."""
    angles = 2.0 * np.pi * np.arange(m) / m
    return np.stack([np.cos(angles), np.sin(angles), np.zeros(m)], axis=1)


def sphere_wrenches(points: Array, friction: float, edges: int = 8, planar: bool = False) -> Array:
    """Of a grasp of the unit sphere, or disc, at these points."""
    return wrenches.contact_wrenches(points[None], points[None], friction, edges, 1.0, planar)


def round_radius(points: Array, friction: float) -> float:
    """Of a grasp of the unit sphere at these points, with round cones."""
    return float(wrenches.round_ball_radius(wrenches.contact_axes(points[None], points[None], 1.0), friction)[0])


def joint(name: str, kind: str, parent: str, child: str, xyz: str, axis: str) -> str:
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/><origin xyz="{xyz}"/>'
        f'<axis xyz="{axis}"/><limit lower="-1" upper="3" effort="1" velocity="1"/></joint>'
    )


def held_problem(points: Array, normals: Array, seed: int | None = None) -> ga.Problem:
    """An object held at given points [m, 3] and outward normals by fingers that slide and tilt; turned at random."""
    rng = np.random.default_rng(seed)
    quaternion = np.array([0.0, 0.0, 0.0, 1.0]) if seed is None else random_rotation(rng)
    origin = np.zeros(3) if seed is None else rng.normal(size=3)
    R = Rotation.from_quat(quaternion).as_matrix()
    urdf, contacts = ['<robot name="fingers"><link name="palm"/>'], []
    for i, (p, n) in enumerate(zip(points @ R.T + origin, normals @ R.T, strict=True)):
        xyz, axis = (" ".join(f"{c:.17g}" for c in v) for v in (p, n))
        urdf.append(
            f'<link name="ball{i}"/><link name="nail{i}"/><link name="tip{i}"/>'
            + joint(f"slide{i}", "prismatic", "palm", f"ball{i}", xyz, axis)
            + joint(f"roll{i}", "revolute", f"ball{i}", f"nail{i}", "0 0 0", "1 0 0")
            + joint(f"yaw{i}", "revolute", f"nail{i}", f"tip{i}", "0 0 0", "0 1 0")
        )
        tip = ga.patches.Point((0.0, 0.0, 0.0), tuple(-n))
        contacts.append(ga.Contact(f"tip{i}", tip, ga.patches.Plane(tuple(points[i]), tuple(normals[i]))))
    return ga.Problem(
        name="held",
        hand=ga.Hand("fingers", "".join(urdf) + "</robot>"),
        object=ga.Body("thing", '<robot name="thing"><link name="thing"/></robot>'),
        contacts=tuple(contacts),
        x1=ga.FirstGrasp(
            {f"{name}{i}": 0.0 for i in range(len(points)) for name in ("slide", "roll", "yaw")},
            tuple(origin),
            tuple(quaternion),
        ),
    )


def held(points: Array, normals: Array, seed: int | None = None) -> ga.Grasps:
    problem = held_problem(points, normals, seed)
    return ga.Grasps(problem, problem.x1_array)


@pytest.fixture(scope="module")
def charts(can: ga.Problem) -> ga.Grasps:
    atlas = ga.build_atlas(can.system(2), can.x1_array, radius=0.25, epsilon=0.5)
    return ga.Grasps(can, atlas.centers, atlas.system)


@pytest.fixture(scope="module")
def closed(charts: ga.Grasps) -> ga.Grasps:
    """Those of the charts that are force-closed."""
    return ga.Grasps(charts.problem, charts.x[quality.force_closure_margin(charts) > 0.0], charts.system)


def chart_wrenches(grasps: ga.Grasps, friction: float = 0.5, edges: int = 8) -> Array:
    """The wrenches once more, from G alone, with the same first tangents and a length of 5 cm."""
    n = -grasps.contact_normals
    axis = grasps.T_palm_object[:, None, :3, :3] @ np.eye(3)[2]
    flat = np.broadcast_to(grasps.T_palm_object[:, None, :3, :3] @ np.eye(3)[0], n.shape)
    steep = np.abs(np.einsum("nmi,nmi->nm", n, np.broadcast_to(axis, n.shape))) > np.sqrt(0.5)
    s = np.cross(np.where(steep[..., None], flat, axis), n)
    s /= np.linalg.norm(s, axis=2, keepdims=True)
    t = np.cross(n, s)
    out = []
    for angle in 2.0 * np.pi * np.arange(edges) / edges:
        f = n + friction * (np.cos(angle) * s + np.sin(angle) * t)
        for i in range(f.shape[1]):
            out.append(np.einsum("nab,nb->na", grasps.G[:, :, 3 * i : 3 * i + 3], f[:, i]))
    W = np.stack(out, axis=1)
    W[..., 3:] /= 0.05
    return W


# The hull alone


@pytest.mark.parametrize("d", [3, 6])
def test_hulls_of_regular_polytopes(d: int) -> None:
    factorial = float(np.prod(np.arange(1, d + 1)))
    cross = np.vstack([np.eye(d), -np.eye(d)])
    cube = np.array(np.meshgrid(*[[-1.0, 1.0]] * d)).reshape(d, -1).T
    simplex = np.vstack([np.eye(d), np.full(d, (1.0 - np.sqrt(d + 1.0)) / d)])
    simplex -= simplex.mean(axis=0)
    edge = np.sqrt(2.0)
    for points, radius, volume in (
        (cross, 1.0 / np.sqrt(d), 2.0**d / factorial),
        (cube, 1.0, 2.0**d),
        (simplex, edge / np.sqrt(2.0 * d * (d + 1.0)), edge**d / factorial * np.sqrt((d + 1.0) / 2.0**d)),
    ):
        Q = np.linalg.qr(np.random.default_rng(d).normal(size=(d, d)))[0]
        for turned in (points, points @ Q, np.repeat(points @ Q, 2, axis=0)):
            assert wrenches.ball_radius(turned[None])[0] == pytest.approx(radius, rel=1e-12)
            assert wrenches.hull_volume(turned[None])[0] == pytest.approx(volume, rel=1e-12)
            moved = turned + 0.3 * radius * Q[0]
            assert 0.0 < wrenches.ball_radius(moved[None])[0] < radius
            assert wrenches.hull_volume(moved[None])[0] == pytest.approx(volume, rel=1e-12)


@pytest.mark.parametrize("d", [3, 6])
def test_hulls_that_do_not_hold_the_origin_or_are_flat(d: int) -> None:
    rng = np.random.default_rng(d)
    cloud = rng.normal(size=(4 * d, d))
    flat = cloud @ np.diag([1.0] * (d - 1) + [0.0]) @ np.linalg.qr(rng.normal(size=(d, d)))[0]
    shifted = cloud + 2.0 * np.abs(cloud).sum(axis=1).max()
    cube = np.array(np.meshgrid(*[[0.0, 1.0]] * d)).reshape(d, -1).T
    for points in (flat, shifted, cube, cloud[:d], np.zeros((20, d)), cloud[:1]):
        assert wrenches.ball_radius(points[None])[0] == 0.0
        assert wrenches.min_weight(points[None])[0] == 0.0
    for points in (flat, cloud[:d], np.zeros((20, d))):
        assert wrenches.hull_volume(points[None])[0] == 0.0
    assert wrenches.hull_volume(shifted[None])[0] == pytest.approx(ConvexHull(cloud).volume, rel=1e-9)


@pytest.mark.parametrize("contacts", [2, 3, 4, 5])
@pytest.mark.parametrize("edges", [3, 4, 5, 8])
@pytest.mark.parametrize("planar", [False, True])
def test_hulls_agree_with_qhull(contacts: int, edges: int, planar: bool) -> None:
    """Random contacts, and contacts with so many symmetries that facets have many corners."""
    rng = np.random.default_rng(100 * contacts + edges)
    flat = np.array([1.0, 1.0, 0.0]) if planar else np.ones(3)
    normals = rng.normal(size=(12, contacts, 3)) * flat
    normals[0] = ring(contacts)
    normals[1] = np.round(2.0 * normals[1]) + 0.01 * flat
    normals /= np.linalg.norm(normals, axis=2, keepdims=True)
    points = normals + 0.2 * rng.normal(size=normals.shape) * flat
    points[:3] = normals[:3]
    W = wrenches.contact_wrenches(points, normals, 0.9, edges, 0.7, planar)
    radii, volumes = wrenches.ball_radius(W), wrenches.hull_volume(W)
    for points_of_one, radius, volume in zip(W, radii, volumes, strict=True):
        if np.linalg.matrix_rank(points_of_one - points_of_one[0]) < W.shape[2]:
            assert radius == volume == 0.0
            continue
        qhull = ConvexHull(points_of_one)
        assert radius == pytest.approx(max(-qhull.equations[:, -1].max(), 0.0), abs=1e-9)
        assert volume == pytest.approx(qhull.volume, rel=1e-9)


@pytest.mark.parametrize("noise", [1e-5, 1e-7, 1e-9, 1e-10, 1e-11, 1e-12])
def test_hulls_of_points_that_are_nearly_in_one_plane(noise: float) -> None:
    """Symmetric grasps with contacts that are a little off: points come as near to planes as rounding goes."""
    rng = np.random.default_rng(11)
    for m, edges in ((3, 8), (4, 4), (4, 8), (5, 3), (5, 7)):
        points = np.repeat(ring(m)[None], 6, axis=0)
        points += noise * rng.normal(size=points.shape)
        points /= np.linalg.norm(points, axis=2, keepdims=True)
        W = wrenches.contact_wrenches(points, points, 1.0, edges)
        for one, radius, volume in zip(W, wrenches.ball_radius(W), wrenches.hull_volume(W), strict=True):
            qhull = ConvexHull(one)
            assert radius == pytest.approx(-qhull.equations[:, -1].max(), abs=1e-9)
            assert volume == pytest.approx(qhull.volume, rel=1e-7)


# Known answers


@pytest.mark.parametrize(("m", "friction"), [(3, 0.1), (3, 0.5), (3, 1.5), (4, 0.1), (4, 0.9), (5, 0.1), (5, 0.6)])
def test_fingers_round_a_disc(m: int, friction: float) -> None:
    """The hull is an antiprism: a regular polygon at either torque, turned by the friction angle to either side."""
    angle, half = np.arctan(friction), np.pi / m
    assert angle < half
    side = 1.0 / np.sqrt(1.0 + 2.0 * np.tan(half - angle) ** 2)
    polygons = m * np.sin(2.0 * half) / np.cos(angle) ** 2
    sides = 4.0 * m * np.sin(half) * np.cos(half - angle) / np.cos(angle)
    W = sphere_wrenches(ring(m), friction, planar=True)
    assert wrenches.ball_radius(W)[0] == pytest.approx(min(friction, side), rel=1e-12)
    assert wrenches.hull_volume(W)[0] == pytest.approx(friction * (polygons + sides) / 3.0, rel=1e-12)
    assert wrenches.min_weight(W)[0] == pytest.approx(1.0, rel=1e-12)


@pytest.mark.parametrize("friction", [0.2, 1.0, 3.0])
def test_two_opposite_fingers_in_the_plane(friction: float) -> None:
    """The hull is a tetrahedron: every other corner of a box with edges 2, 2 mu and 2 mu."""
    W = sphere_wrenches(ring(2), friction, planar=True)
    assert wrenches.ball_radius(W)[0] == pytest.approx(friction / np.sqrt(friction**2 + 2.0), rel=1e-12)
    assert wrenches.hull_volume(W)[0] == pytest.approx(8.0 / 3.0 * friction**2, rel=1e-12)


@pytest.mark.parametrize("friction", [0.1, 0.3, 1.0])
def test_four_fingers_in_a_tetrahedron_on_a_sphere(friction: float) -> None:
    """Weakest is a twist about one finger with a pull along it: w = (-s p, p) with s = mu sqrt((1 + s^2) / 2)."""
    assert round_radius(TETRAHEDRON, friction) == pytest.approx(friction / np.sqrt(2.0), rel=1.1e-4)
    many = sphere_wrenches(TETRAHEDRON, friction, 40)
    assert wrenches.ball_radius(many)[0] == pytest.approx(friction / np.sqrt(2.0), rel=4e-3)


@pytest.mark.parametrize("friction", [0.1, 0.3, 1.0])
def test_fingers_on_all_faces_of_a_cube(friction: float) -> None:
    """Weakest is a twist about a diagonal: all fingers are alike, with arms of sqrt(2 / 3) about it."""
    expected = friction * np.sqrt(2.0 / 3.0)
    assert round_radius(BOX_FACES, friction) == pytest.approx(expected, rel=1.1e-4)
    assert wrenches.ball_radius(sphere_wrenches(BOX_FACES, friction, 8))[0] == pytest.approx(expected, rel=1e-12)


def test_three_fingers_round_a_sphere() -> None:
    """With mu = 1 weakest is w = (-s p, p), p a finger: it feels s, the others (sqrt(3 (1 + s^2)) - s) / 2."""
    assert round_radius(ring(3), 1.0) == pytest.approx(1.0 / np.sqrt(3.0), rel=1.1e-4)


@pytest.mark.parametrize("friction", [0.3, 1.0])
def test_four_fingers_on_the_sides_of_a_cube(friction: float) -> None:
    """With edges along the axes a twist about a diagonal has max(|b_x|, |b_y|, |b_z|) mu against it."""
    W = sphere_wrenches(ring(4), friction, 4)
    assert wrenches.ball_radius(W)[0] == pytest.approx(friction / np.sqrt(3.0), rel=1e-12)


@pytest.mark.parametrize("edges", [3, 4, 8])
def test_min_weight_of_symmetric_grasps(edges: int) -> None:
    """Equal weights cancel by symmetry; against two fingers of a box's side the third bears half of all force."""
    for points in (ring(3), ring(4), BOX_FACES):
        assert wrenches.min_weight(sphere_wrenches(points, 0.4, 2 * edges))[0] == pytest.approx(1.0, rel=1e-12)
    points = np.array([[[0.5, 1.0, 0.0], [-0.5, 1.0, 0.0], [0.0, -1.0, 0.0]]])
    normals = np.array([[[0.0, 1.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0]]])
    for planar in (False, True):
        W = wrenches.contact_wrenches(points, normals, 0.6, 2 * edges, 1.0, planar)
        assert wrenches.min_weight(W)[0] == pytest.approx(0.75, rel=1e-12)


@pytest.mark.parametrize("seed", [None, 1, 2])
def test_indices_of_hands_that_hold_a_sphere_and_a_box(seed: int | None) -> None:
    """The same answers for the grasps of a hand, the object being anywhere; the length defaults to the largest arm."""
    sphere = held(0.04 * TETRAHEDRON, TETRAHEDRON, seed)
    assert quality.ferrari_canny_epsilon(sphere, 0.5, edges=None)[0] == pytest.approx(0.5 / np.sqrt(2.0), rel=1.1e-4)
    assert quality.min_weight(sphere)[0] == pytest.approx(1.0, rel=1e-9)
    assert quality.grasp_isotropy(sphere)[0] == pytest.approx(np.sqrt(2.0 / 3.0), rel=1e-9)
    assert quality.grasp_isotropy(sphere, 0.04 * np.sqrt(2.0 / 3.0))[0] == pytest.approx(1.0, rel=1e-9)
    box = held(0.04 * ring(4), ring(4), seed)
    assert quality.ferrari_canny_epsilon(box, 0.5, edges=4)[0] == pytest.approx(0.5 / np.sqrt(3.0), rel=1e-9)
    volume = wrenches.hull_volume(sphere_wrenches(ring(4), 0.5, 8))[0]
    assert quality.ferrari_canny_volume(box)[0] == pytest.approx(volume, rel=1e-9)
    assert quality.ferrari_canny_volume(box, length_unit=0.02)[0] == pytest.approx(8.0 * volume, rel=1e-9)
    three = held(0.04 * ring(3), ring(3), seed)
    assert quality.ferrari_canny_epsilon(three, 1.0, edges=None)[0] == pytest.approx(1.0 / np.sqrt(3.0), rel=1.1e-4)


def test_a_pinch_by_two_points_has_no_closure() -> None:
    grasps = held(0.04 * ring(2), ring(2))
    for index in quality.INDICES.values():
        if index not in (quality.joint_centrality, quality.soft_finger_epsilon):
            assert index(grasps)[0] == 0.0
    assert quality.soft_finger_epsilon(grasps)[0] > 0.0
    assert quality.force_closure_slack(grasps)[0] == -np.inf


# Second routes, on the can


def test_epsilon_and_volume_agree_with_qhull(charts: ga.Grasps, closed: ga.Grasps) -> None:
    for grasps in (charts, closed):
        some = ga.Grasps(grasps.problem, grasps.x[:: len(grasps) // 25], grasps.system)
        epsilon = quality.ferrari_canny_epsilon(some, 0.5, 0.05)
        volume = quality.ferrari_canny_volume(some, 0.5, 0.05)
        for W, e, v in zip(chart_wrenches(some), epsilon, volume, strict=True):
            qhull = ConvexHull(W)
            expected = -qhull.equations[:, -1].max()
            assert e == pytest.approx(max(expected, 0.0), abs=1e-9)
            assert v == pytest.approx(qhull.volume if expected > 0.0 else 0.0, rel=1e-8)


@pytest.fixture(scope="module")
def some(closed: ga.Grasps) -> ga.Grasps:
    return ga.Grasps(closed.problem, closed.x[:: len(closed) // 8], closed.system)


@pytest.mark.parametrize("edges", slow_but([3, 4, 8, 40], 3, 4, 8))
def test_round_cones_lie_between_pyramids(some: ga.Grasps, edges: int) -> None:
    """Pyramids inside and around the round cones, by Qhull."""
    exact = quality.ferrari_canny_epsilon(some, 0.5, 0.05, edges=None)
    inside, around = (chart_wrenches(some, mu, edges) for mu in (0.5, 0.5 / np.cos(np.pi / edges)))
    for i, value in enumerate(exact):
        lower, upper = (-ConvexHull(W[i]).equations[:, -1].max() for W in (inside, around))
        assert lower <= value * 1.0001 + 1e-12
        assert value <= upper + 1e-12
        if edges == 40:
            assert upper - lower < 0.06 * upper


def test_no_direction_has_less_against_it_than_epsilon(some: ga.Grasps) -> None:
    exact = quality.ferrari_canny_epsilon(some, 0.5, 0.05, edges=None)
    G = some.G.copy()
    G[:, 3:] /= 0.05
    directions = np.random.default_rng(7).normal(size=(20000, 6))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    for g, outward, value in zip(G, some.contact_normals, exact, strict=True):
        forces = (directions @ g).reshape(len(directions), -1, 3)
        along = -np.einsum("dmb,mb->dm", forces, outward)
        reach = along + 0.5 * np.sqrt(np.maximum((forces**2).sum(axis=2) - along**2, 0.0))
        assert reach.max(axis=1).min() >= value


def test_min_weight_agrees_with_linear_programming(charts: ga.Grasps, closed: ga.Grasps) -> None:
    for grasps in (charts, closed):
        some = ga.Grasps(grasps.problem, grasps.x[:: len(grasps) // 20], grasps.system)
        for edges in (4, 8):
            ours = quality.min_weight(some, 0.5, edges)
            for W, value in zip(chart_wrenches(some, 0.5, edges), ours, strict=True):
                n = len(W)
                solution = linprog(
                    np.r_[np.zeros(n), -1.0],
                    A_ub=np.hstack([-np.eye(n), np.ones((n, 1))]),
                    b_ub=np.zeros(n),
                    A_eq=np.vstack([np.c_[W.T, np.zeros(6)], np.r_[np.ones(n), 0.0]]),
                    b_eq=np.r_[np.zeros(6), 1.0],
                    bounds=[(None, None)] * (n + 1),
                )
                assert solution.status == 0
                assert value == pytest.approx(max(-n * solution.fun, 0.0), abs=1e-8)


def test_the_three_ideas_of_closure_agree(charts: ga.Grasps) -> None:
    margin = quality.force_closure_margin(charts) > 0.0
    assert margin.any()
    np.testing.assert_array_equal(quality.ferrari_canny_epsilon(charts, edges=None) > 0.0, margin)
    pyramids = quality.ferrari_canny_epsilon(charts) > 0.0
    np.testing.assert_array_equal(quality.min_weight(charts) > 0.0, pyramids)
    np.testing.assert_array_equal(quality.ferrari_canny_volume(charts) > 0.0, pyramids)
    assert not (pyramids & ~margin).any()


def test_more_friction_and_a_longer_unit_of_torque(closed: ga.Grasps) -> None:
    lower, upper = (quality.ferrari_canny_epsilon(closed, mu) for mu in (0.5, 0.6))
    assert (upper >= lower).all()
    assert (
        quality.ferrari_canny_epsilon(closed, length_unit=0.2) <= quality.ferrari_canny_epsilon(closed, length_unit=0.1)
    ).all()
    np.testing.assert_allclose(
        quality.ferrari_canny_volume(closed, length_unit=0.2) * 8.0,
        quality.ferrari_canny_volume(closed, length_unit=0.1),
        rtol=1e-9,
    )


def test_slack_is_the_margin_with_its_sign(charts: ga.Grasps) -> None:
    slack, margin = quality.force_closure_slack(charts), quality.force_closure_margin(charts)
    np.testing.assert_allclose(np.maximum(slack, 0.0), margin, atol=1e-12)
    outside = np.flatnonzero(slack < 0.0)
    for chart in outside[:: len(outside) // 8]:
        bound = margin_by_linear_programming(charts[int(chart)], 0.5)
        assert slack[chart] == pytest.approx(bound, rel=1e-3, abs=3e-4)
        assert slack[chart] <= bound + 1e-8


@pytest.mark.parametrize("turn", [0.3, 0.6, 0.9])
@pytest.mark.parametrize("friction", [0.2, 0.8])
def test_slack_of_symmetric_three_finger_grasp(turn: float, friction: float) -> None:
    """By symmetry the forces meet in the centre, in or out of their cones."""
    problem = symmetric_planar_problem(turn)
    grasps = ga.Grasps(problem, problem.x1_array)
    cosine = grasps.contact_points[0, 0] @ grasps.contact_normals[0, 0] / np.linalg.norm(grasps.contact_points[0, 0])
    tangent = np.sqrt(1.0 - cosine**2) / cosine
    expected = (friction - tangent) / 3.0 / np.sqrt(1.0 + friction**2)
    assert quality.force_closure_slack(grasps, friction)[0] == pytest.approx(expected, abs=1e-8)
    closed = expected > 0.0
    assert (quality.ferrari_canny_epsilon(grasps, friction)[0] > 0.0) == closed
    assert quality.min_weight(grasps, friction)[0] == pytest.approx(1.0 - tangent / friction if closed else 0.0)


# Isotropy and centrality


def test_isotropy_from_the_eigenvalues_of_GGt(charts: ga.Grasps) -> None:
    G = charts.G.copy()
    G[:, 3:] /= 0.05
    eigenvalues = np.linalg.eigvalsh(G @ G.transpose(0, 2, 1))
    expected = np.sqrt(np.maximum(eigenvalues[:, 0], 0.0) / eigenvalues[:, -1])
    np.testing.assert_allclose(quality.grasp_isotropy(charts, 0.05), expected, rtol=1e-6)


def test_isotropy_in_the_plane() -> None:
    problem = symmetric_planar_problem(0.3)
    grasps = ga.Grasps(problem, problem.x1_array)
    assert quality.grasp_isotropy(grasps, np.linalg.norm(grasps.contact_points[0, 0]))[0] == pytest.approx(
        1.0, rel=1e-6
    )
    assert quality.grasp_isotropy(grasps, 2.0 * np.linalg.norm(grasps.contact_points[0, 0]))[0] == pytest.approx(0.5)


def test_centrality_of_joints(can: ga.Problem) -> None:
    problem = held_problem(0.04 * ring(4), ring(4))
    X = np.repeat(problem.x1_array[None], 4, axis=0)
    four = [[1.0] * 4, [-1.0, 3.0, 3.0, -1.0], [0.0, 2.0, 1.0, 1.0], [3.0, 1.0, 1.0, 1.0]]
    X[:, :12] = np.tile(four, 3)
    np.testing.assert_allclose(quality.joint_centrality(ga.Grasps(problem, X)), [1.0, 0.0, 0.875, 0.75])
    planar = symmetric_planar_problem(0.3)  # its joints are continuous
    assert quality.joint_centrality(ga.Grasps(planar, planar.x1_array))[0] == 1.0
    lower, upper = can.hand.joint_limits
    q = can.x1_array[: len(lower)]
    expected = np.mean(
        [1.0 - (2.0 * (a - low) / (high - low) - 1.0) ** 2 for a, low, high in zip(q, lower, upper, strict=True)]
    )
    assert quality.joint_centrality(ga.Grasps(can, can.x1_array))[0] == pytest.approx(expected, rel=1e-12)


# Use and misuse


def test_indices_by_name(closed: ga.Grasps) -> None:
    for name in ("ferrari_canny_epsilon", "ferrari_canny_volume", "min_weight", "grasp_isotropy", "joint_centrality"):
        index = quality.INDICES[name]
        np.testing.assert_array_equal(quality.evaluate(name, closed), index(closed))
        assert "Source:" in (index.__doc__ or "")
        assert len(index(ga.Grasps(closed.problem, closed.x[:0], closed.system))) == 0
    one = ga.Grasps(closed.problem, closed.x[3], closed.system)
    assert quality.ferrari_canny_epsilon(one)[0] == quality.ferrari_canny_epsilon(closed)[3]


WRONG: dict[str, tuple[str, dict[str, Any], str]] = {
    **{
        f"{name} {key} {value}": (name, {key: value}, key)
        for name, keys in {
            "ferrari_canny_epsilon": ("friction", "length_unit"),
            "ferrari_canny_volume": ("friction", "length_unit"),
            "min_weight": ("friction",),
            "force_closure_margin": ("friction",),
            "force_closure_slack": ("friction",),
            "grasp_isotropy": ("length_unit",),
        }.items()
        for key in keys
        for value in (0.0, -1.0, float("nan"), float("inf"), "0.5", True)
    },
    **{
        f"{name} edges {edges}": (name, {"edges": edges}, "edges")
        for name in ("ferrari_canny_epsilon", "ferrari_canny_volume", "min_weight")
        for edges in (2, 0, -4, 8.0, "8", True, 10**4)
    },
    "round, friction": ("ferrari_canny_epsilon", {"friction": -0.5, "edges": None}, "friction"),
    "volume of round cones": ("ferrari_canny_volume", {"edges": None}, "edges"),
}


@pytest.mark.parametrize("what", WRONG)
def test_wrong_arguments(what: str, closed: ga.Grasps) -> None:
    name, arguments, word = WRONG[what]
    with pytest.raises(ga.GraspAtlasError, match=word) as caught:
        getattr(quality, name)(closed, **arguments)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("shape", [(3,), (2, 3), (2, 5, 4), (1, 2, 3, 6)])
def test_wrenches_of_another_shape(shape: tuple[int, ...]) -> None:
    for function in (wrenches.ball_radius, wrenches.hull_volume, wrenches.min_weight):
        with pytest.raises(ga.GraspAtlasError, match="shape"):
            function(np.zeros(shape))
    with pytest.raises(ga.GraspAtlasError, match="shape"):
        wrenches.round_ball_radius(np.zeros(shape), 0.5) if shape[-1] != 6 else wrenches.contact_axes(
            np.zeros(shape), np.zeros(shape), 1.0
        )


def test_more_wrenches_than_a_hull_takes() -> None:
    with pytest.raises(ga.GraspAtlasError, match="at most 4095"):
        wrenches.hull_volume(np.zeros((1, 4096, 6)))
    with pytest.raises(ga.GraspAtlasError, match="at most 255 contacts"):
        wrenches.round_ball_radius(np.zeros((1, 256, 3, 6)), 0.5)


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_wrenches_that_are_no_numbers(value: float) -> None:
    W = sphere_wrenches(TETRAHEDRON, 0.5)
    W[0, 3, 2] = value
    for function in (wrenches.ball_radius, wrenches.hull_volume, wrenches.min_weight):
        with pytest.raises(ga.GraspAtlasError, match="finite"):
            function(W)


def test_contacts_at_the_objects_origin_ask_for_a_length() -> None:
    grasps = held(np.zeros((3, 3)), ring(3))
    with pytest.raises(ga.GraspAtlasError, match="give length_unit"):
        quality.ferrari_canny_epsilon(grasps)
    assert quality.ferrari_canny_epsilon(grasps, length_unit=0.1)[0] == 0.0


def test_closure_is_asked_for_as_before(closed: ga.Grasps) -> None:
    assert ForceClosure(0.5).met(closed).all()
