"""The identities that every system must satisfy, on all systems and every kind of contact."""

from __future__ import annotations

from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from helpers import PythonSphere, bare_system, chain, random_rotation, robot
from hypothesis import given
from hypothesis import strategies as st
from oracles import manifolds

import graspatlas as ga
from graspatlas import _core, patches
from graspatlas.patches import Bezier, BSpline, Cone, Curve, Cylinder, Ellipsoid, Patch, Plane, Point, Revolution
from graspatlas.systems import Angles, Rotations, Sphere, Torus, jacobian_error
from graspatlas.testing import check_system

AXIS = {"origin": (0.001, -0.002, 0.003), "axis": (0.3, 0.9, -0.2), "u_axis": (0.7, 0.1, 0.7)}
SHEET = np.random.default_rng(1).normal(0.0, 0.002, (5, 4, 3))
SHEET[..., 0] += np.linspace(-0.03, 0.03, 5)[:, None]
SHEET[..., 2] += np.linspace(-0.02, 0.02, 4)
PATCHES: dict[str, Patch] = {
    "point": Point((0.01, 0.002, 0.004), (0.2, -0.3, 0.9)),
    "plane": Plane((0.01, 0.0, 0.004), (0.1, 0.9, 0.2), (0.5, 0.1, 0.3), (-0.03, 0.02), (-0.01, 0.04)),
    "cylinder": Cylinder(radius=0.02, v_interval=(-0.03, 0.04), **AXIS),
    "arc of a cylinder": Cylinder(radius=0.02, u_interval=(-1.0, 2.0), v_interval=(-0.03, 0.04), **AXIS),
    "cone": Cone(heights=(-0.02, 0.05), radii=(0.01, 0.04), **AXIS),
    "revolution": Revolution(heights=(-0.02, 0.0, 0.01, 0.03), radii=(0.015, 0.02, 0.018, 0.03), **AXIS),
    "sphere": patches.Sphere(radius=0.02, **AXIS),
    "torus": patches.Torus(ring_radius=0.03, tube_radius=0.01, flipped=True, **AXIS),
    "ellipsoid": Ellipsoid(semi_axes=(0.02, 0.03, 0.04), **AXIS),
    "bezier": Bezier(control_points=SHEET),
    "bspline": BSpline(control_points=SHEET, degrees=(3, 2), u_interval=(0.1, 0.8), flipped=True),
    "bspline in metres": BSpline(
        control_points=SHEET,
        u_knots=(-0.03,) * 4 + (0.0,) + (0.03,) * 4,
        v_knots=(-0.02,) * 4 + (0.03,) * 4,
        unit="m",
    ),
    "curve": Curve(patches.Sphere(radius=0.02, **AXIS), ((-0.5, -0.3), (0.2, 0.4), (0.9, 0.3))),
}
Names = tuple[str, ...]
HAND = robot(
    chain("a", (0.05, 0.0, 0.02), ["0 0 1", "0 1 0", "1 0 0"], 0.04),
    chain("b", (-0.05, 0.01, 0.0), ["1 0 0", "0 1 0"], 0.05),
)


def side(joint: int, patch: Patch, free: tuple[str, ...]) -> _core.ContactSide:
    parameters = []
    for name, value in (("u", 0.4), ("v", 0.01)):
        interval = patch.interval(name) if name in patch.parameters else (-1.0, 1.0)
        low, high = interval or (-np.pi, np.pi)
        parameters.append(_core.PatchParameter(name in free, value, interval is None, low, high))
    T = np.eye(4)
    T[:3, 3] = 0.02, -0.01, 0.005
    return _core.ContactSide(joint, T, patch.core(), *parameters)


@cache
def contact_system(
    hand: str, hand_free: tuple[str, ...], body: str, body_free: tuple[str, ...], motions: int
) -> object:
    """Two contacts of a five-joint hand: first the patches asked for, then two points; `motions` of five kept."""
    model = _core.Model(HAND, "free_flyer")
    sides = [
        (side(3, PATCHES[hand], hand_free), side(model.object_joint, PATCHES[body], body_free)),
        (side(5, PATCHES["point"], ()), side(model.object_joint, PATCHES["cylinder"], ("u", "v"))),
    ]
    kept = np.linalg.qr(np.random.default_rng(0).normal(size=(5, 5)))[0][:, :motions] if motions < 5 else np.eye(5)
    return _core.GraspSystem(model, sides, kept, 0.013, model.lower_limits, model.upper_limits)


def frees(patch: str) -> list[tuple[str, ...]]:
    names = PATCHES[patch].parameters
    return [(), *((name,) for name in names), *([names] if len(names) == 2 else [])]


ON_OBJECT = [("point", (), body, free, motions) for body in PATCHES for free in frees(body) for motions in (5, 4)]
ON_HAND = [
    (hand, free, body, ("u", "v") if body != "point" else (), motions)
    for hand in PATCHES
    for free in frees(hand)
    for body, motions in (("point", 5), ("revolution", 4))
]
CONTACTS = list(dict.fromkeys(ON_OBJECT + ON_HAND))


def grasp_point(system: object, rng: np.random.Generator, hand_q: int) -> np.ndarray:
    """Any configuration: the contacts need not touch."""
    n = system.configuration_size
    x = np.empty(n)
    x[:hand_q] = rng.uniform(-1.0, 1.0, hand_q)
    x[hand_q : hand_q + 3] = rng.uniform(-0.1, 0.1, 3)
    x[hand_q + 3 : hand_q + 7] = random_rotation(rng)
    x[hand_q + 7 :] = rng.uniform(-0.01, 0.02, n - hand_q - 7)
    return x


def unit_rows(rng: np.random.Generator, n: int) -> np.ndarray:
    return random_rotation(rng) if n == 4 else rng.normal(size=n)


CONTINUOUS = robot(chain("f", (0.0, 0.0, 0.1), ["0 0 1", "0 1 0"], 0.05, "continuous"))
SLIDING = robot(chain("f", (0.0, 0.0, 0.1), ["0 0 1", "0 1 0"], 0.05, "prismatic"))


def continuous_point(rng: np.random.Generator) -> np.ndarray:
    a, b = rng.uniform(-np.pi, np.pi, 2)
    return np.array([np.cos(a), np.sin(a), np.cos(b), np.sin(b)])


SYSTEMS = {
    "circle": lambda: (Sphere(2), lambda rng: rng.normal(size=2)),
    "sphere": lambda: (Sphere(3), lambda rng: rng.normal(size=3)),
    "5-sphere": lambda: (Sphere(6), lambda rng: rng.normal(size=6)),
    "python": lambda: (PythonSphere(4, lower=-2.0, upper=np.inf), lambda rng: rng.normal(size=4)),
    "torus": lambda: (Torus(0.8, 0.3), lambda rng: rng.normal(size=3)),
    "angles": lambda: (Angles(3), lambda rng: rng.uniform(-np.pi, np.pi, 3)),
    "rotations": lambda: (Rotations(), random_rotation),
    "continuous joints": lambda: (bare_system(CONTINUOUS), continuous_point),
    "prismatic joints": lambda: (bare_system(SLIDING), lambda rng: rng.uniform(-1, 1, 2)),
    "free flyer": lambda: (
        bare_system(CONTINUOUS, "free_flyer"),
        lambda rng: np.r_[continuous_point(rng), rng.normal(size=3), random_rotation(rng)],
    ),
    "planar object": lambda: (
        bare_system(CONTINUOUS, "planar"),
        lambda rng: np.r_[continuous_point(rng), rng.normal(size=2), continuous_point(rng)[:2]],
    ),
    "can, all": lambda: bundled("schunk_can", 8),
    "can, reduced": lambda: bundled("schunk_can", 2),
    "bottle, all": lambda: bundled("schunk_oil_bottle", 9),
    "bottle, reduced": lambda: bundled("schunk_oil_bottle", 3),
    "contacts": lambda: (
        contact_system("cone", ("u", "v"), "revolution", ("u", "v"), 4),
        lambda rng: grasp_point(contact_system("cone", ("u", "v"), "revolution", ("u", "v"), 4), rng, 5),
    ),
}


def bundled(name: str, dimension: int):
    system = ga.load_problem(name).system(dimension)
    return system, lambda rng: grasp_point(system, rng, 13)


@cache
def named(name: str):
    return SYSTEMS[name]()


seeds = st.integers(0, 10**6)
KNOWN = [
    manifolds.Ellipsoid(1.0, 0.7, 0.1, factor=3.0),
    manifolds.Shells(0.05),
    manifolds.Neck(0.05, 3),
    manifolds.Rooms(0.05),
    manifolds.Spiral(0.3, 3),
    manifolds.Helicoid(0.3, 3),
    manifolds.Crossing(),
    manifolds.Cone(),
]
every_system = pytest.mark.parametrize("name", SYSTEMS)


def step(rng: np.random.Generator, size: int, longest: float) -> np.ndarray:
    v = rng.normal(size=size)
    return v * (rng.uniform(0.0, longest) / np.linalg.norm(v))


def related(name: str, rng: np.random.Generator) -> tuple[object, np.ndarray, np.ndarray, np.ndarray]:
    """A system, a point, a tangent vector, and the point that it leads to."""
    system, sample = named(name)
    x = sample(rng)
    v = step(rng, system.tangent_size, 1.5)
    return system, x, v, system.integrate(x, v)


@every_system
@given(seed=seeds)
def test_identities(name, seed):
    system, sample = named(name)
    check_system(system, [sample(np.random.default_rng(seed))], longest=1.5, tolerance=1e-6, seed=seed)


@pytest.mark.parametrize("contact", CONTACTS, ids=lambda c: "-".join(map(str, c)).replace("'", ""))
def test_jacobian_of_every_contact(contact):
    system = contact_system(*contact)
    assert system.n_equations == 10
    assert system.n_parameters == len(contact[1]) + len(contact[3]) + 2
    rng = np.random.default_rng(6)
    check_system(system, [grasp_point(system, rng, 5) for _ in range(4)], tolerance=1e-6)


PLANAR_PATCHES: dict[str, tuple[Patch, Names]] = {
    "point": (Point((0.01, 0.002, 0.0), (0.6, 0.8, 0.0)), ()),
    "line": (Plane((0.01, 0.0, 0.0), (0.8, -0.6, 0.0), (0.6, 0.8, 0.0), (-0.03, 0.02)), ("u",)),
    "arc": (Cylinder(radius=0.02, origin=(0.01, 0.02, 0.0), axis=(0.0, 0.0, -1.0)), ("u",)),
}


@pytest.mark.parametrize("kept", [6, 5])
@pytest.mark.parametrize("body", PLANAR_PATCHES)
@pytest.mark.parametrize("hand", PLANAR_PATCHES)
def test_jacobian_of_planar_contacts(hand, body, kept):
    """Three equations a contact in the plane."""
    fingers = [chain(name, (x, 0.0, 0.0), ["0 0 1"] * 3, 0.05) for name, x in (("a", -0.03), ("b", 0.03))]
    model = _core.Model(robot(*fingers), "planar")
    T = np.eye(4)
    T[:2, 3] = 0.05, 0.0
    sides = []
    for joint in (3, 6):
        ends = []
        for where, place, name in ((joint, T, hand), (model.object_joint, np.eye(4), body)):
            patch, free = PLANAR_PATCHES[name]
            u = _core.PatchParameter("u" in free, 0.3, name == "arc", -1.0, 1.0)
            ends.append(
                _core.ContactSide(where, place, patch.core(), u, _core.PatchParameter(False, 0.0, False, -1, 1))
            )
        sides.append(tuple(ends))
    motions = np.linalg.qr(np.random.default_rng(1).normal(size=(6, 6)))[0][:, :kept] if kept < 6 else np.eye(6)
    system = _core.GraspSystem(model, sides, motions, 0.013, model.lower_limits, model.upper_limits)
    assert (system.n_equations, system.object_dof) == (6, 3)
    rng = np.random.default_rng(2)
    for _ in range(5):
        angle = rng.uniform(-3.0, 3.0)
        parameters = rng.uniform(-0.01, 0.02, system.n_parameters)
        x = np.r_[rng.uniform(-1, 1, 6), rng.uniform(-0.1, 0.1, 2), np.cos(angle), np.sin(angle), parameters]
        check_system(system, [x], tolerance=1e-6)


@pytest.mark.parametrize("system", KNOWN, ids=lambda system: type(system).__name__)
def test_identities_of_the_systems_that_tests_are_made_of(system):
    check_system(system, system.x0 + 0.1 * np.random.default_rng(3).normal(size=(10, len(system.x0))))


def test_differences_of_many_points_are_those_of_each(bottle, sphere):
    for atlas in (ga.optimize(bottle, radius=0.3, require=[]).atlas, sphere):
        x, system = atlas.centers, atlas.system
        one_by_one = np.array([system.difference(a, b) for a, b in pairwise(x)])
        np.testing.assert_array_equal(system.differences(x[:-1], x[1:]), one_by_one)
        a, b = atlas.neighbour_pairs[-1]
        distance = np.linalg.norm(system.difference(x[a], x[b]))  # whose squares are added up in another order
        assert atlas.neighbour_distances[-1] == pytest.approx(distance, rel=1e-14)
        assert len(atlas.neighbour_distances) == len(atlas.neighbour_pairs)
        for wrong in ((x[:3], x[:2]), (x[:3, :-1], x[:3]), (x[0], x[0])):
            with pytest.raises(ga.GraspAtlasError, match=r"X[01] must have \d+ columns, one row for each pair"):
                system.differences(*wrong)


def test_jacobian_error_finds_a_wrong_jacobian():
    class Wrong(PythonSphere):
        def jacobian(self, x):
            return 2.001 * x[None]

    assert jacobian_error(Wrong(3), [0.0, 0.6, 0.8]) == pytest.approx(0.001 * 0.8, rel=1e-4)


@pytest.mark.parametrize("name", ["rotations", "free flyer", "can, all", "bottle, reduced", "contacts"])
@given(seed=seeds)
def test_a_quaternion_and_its_negative_are_one_point(name, seed):
    system, x, v, moved = related(name, np.random.default_rng(seed))
    start = {"rotations": 0, "free flyer": 7, "contacts": 8}.get(name, 16)
    twin = moved.copy()
    twin[start : start + 4] *= -1.0
    np.testing.assert_allclose(system.difference(x, twin), v, atol=1e-9)
    np.testing.assert_allclose(system.difference(moved, twin), 0.0, atol=1e-9)
    np.testing.assert_array_equal(system.embed(moved), system.embed(twin))
    np.testing.assert_allclose(system.evaluate_residual(moved), system.evaluate_residual(twin), atol=1e-9)
    w = 0.1 * v
    assert np.linalg.norm(system.difference(system.integrate(moved, w), system.integrate(twin, w))) < 1e-9


@given(seed=seeds)
def test_whole_turns_do_not_matter(seed):
    rng = np.random.default_rng(seed)
    system = Angles(3)
    x0, x1 = rng.uniform(-np.pi, np.pi, (2, 3))
    turned = x1 + 2 * np.pi * rng.integers(-5, 6, 3)
    np.testing.assert_allclose(np.exp(1j * system.difference(x0, turned)), np.exp(1j * (x1 - x0)), atol=1e-9)
    assert np.abs(system.difference(x0, turned)).max() <= np.pi
    np.testing.assert_allclose(system.embed(x1), system.embed(turned), atol=1e-9)


@given(seed=seeds, chart=st.integers(0, 200), length=st.floats(0.0, 1.0))
def test_chart_maps_stay_on_the_manifold(sphere, bottle, seed, chart, length):
    """Eqs (14) and (15): R(x) = 0 and, where addition is plain, Phi' (x - x_i) = u."""
    rng = np.random.default_rng(seed)
    for atlas in chart_map_atlases():
        i = chart % atlas.n_charts
        u = rng.normal(size=atlas.dimension)
        u *= length * atlas.radius / np.linalg.norm(u)
        x = atlas.point(i, u)
        assert x is not None
        assert np.abs(atlas.system.evaluate_residual(x)).max() < 1e-9
        above = atlas.bases[i] @ atlas.system.difference(atlas.centers[i], x)
        curved = atlas.system.configuration_size > 10
        assert np.abs(above - u).max() < (0.2 * atlas.radius if curved else 1e-9)
        if length == 0.0:
            assert np.linalg.norm(atlas.system.difference(atlas.centers[i], x)) < 1e-9


@cache
def chart_map_atlases() -> list[ga.Atlas]:
    bottle = ga.load_problem("schunk_oil_bottle")
    return [
        ga.build_atlas(Sphere(3), [0, 0, 1], radius=0.2, epsilon=0.1),
        ga.build_atlas(Sphere(5), [0, 0, 0, 0, 1], radius=0.6, epsilon=0.3),
        ga.build_atlas(Torus(0.8, 0.5), [1.3, 0, 0], radius=0.2, epsilon=0.1),
        ga.build_atlas(bottle.system(2), bottle.x1_array, radius=0.1, epsilon=0.5),
        ga.build_atlas(bottle.system(3), bottle.x1_array, radius=0.3, epsilon=0.5),
    ]


def test_chart_maps_fail_where_there_is_no_manifold(sphere):
    assert sphere.point(0, [1.5, 0.0]) is None
    assert sphere.point(0, [np.nan, 0.0]) is None


def test_bases_are_orthonormal_and_tangent():
    for atlas in chart_map_atlases():
        for x, basis in zip(atlas.centers, atlas.bases, strict=True):
            np.testing.assert_allclose(basis @ basis.T, np.eye(atlas.dimension), atol=1e-12)
            J = atlas.system.evaluate_jacobian(x)
            assert np.abs(J @ basis.T).max() < 1e-12 * max(np.abs(J).max(), 1.0)


def test_patch_kinds_are_all_covered():
    kinds = {PATCHES[name].kind for contact in CONTACTS for name in (contact[0], contact[2])}
    classes = [cls for cls in vars(patches).values() if isinstance(cls, type) and issubclass(cls, Patch)]
    assert kinds == {cls.kind for cls in classes if cls is not Patch}
    assert {len(contact[1]) for contact in CONTACTS} == {len(contact[3]) for contact in CONTACTS} == {0, 1, 2}
