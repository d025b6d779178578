"""The holding force against linear programmes, closed forms, and what must hold of it."""

from __future__ import annotations

import numpy as np
import pytest
from helpers import chain, robot
from oracles.holding_lp import HoldingProgramme

import graspatlas as ga
from graspatlas import quality
from graspatlas.requirements import parse_requirement, requirement_from_dict

FRICTION, BUDGET = 0.6, 12.0


def closed_grasps(name: str, count: int, friction: float = FRICTION, torsional: float = 0.0) -> ga.Grasps:
    """Grasps with force closure, as various as they are found."""
    problem = ga.load_problem(name)
    found = ga.Grasps(problem, ga.find_grasps(problem, count=40, seed=4))
    closed = found.x[quality.force_closure_margin(found, friction, torsional) > 1e-3]
    assert len(closed) >= count
    return ga.Grasps(problem, closed[:: len(closed) // count][:count])


def held_at(points: np.ndarray, normals: np.ndarray, object_joint: str = "free_flyer") -> ga.Grasps:
    """A body touched at points with these inward normals, by fingers of three sliding joints along the palm's axes."""
    names, axes = "abcdefgh"[: len(points)], ["1 0 0", "0 1 0", "0 0 1"]
    planar = object_joint == "planar"
    fingers = [chain(n, p, axes[: 2 if planar else 3], 0.0, "prismatic") for n, p in zip(names, points, strict=True)]
    contacts = tuple(
        ga.Contact(f"{n}_tip", ga.patches.Point((0, 0, 0), tuple(f)), ga.patches.Plane(tuple(p), tuple(-f)))
        for n, p, f in zip(names, points, normals, strict=True)
    )
    hand, body = ga.Hand("sliders", robot(*fingers)), ga.Body.box("body", (0.1, 0.1, 0.1))
    x1 = ga.FirstGrasp(dict.fromkeys(hand.joints, 0.0))
    problem = ga.Problem(
        name="held", hand=hand, object=body, contacts=contacts, x1=x1, object_joint=object_joint, length_scale=0.01
    )
    return ga.Grasps(problem, problem.x1_array)


OPPOSITE = np.array([[-0.04, 0.0, 0.0], [0.04, 0.0, 0.0]]), np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]])
FACES = np.array([[s * 0.04, 0.0, t * 0.03] for s in (-1, 1) for t in (-1, 1)]), np.repeat(OPPOSITE[1], 2, axis=0)


@pytest.mark.parametrize("name", ["allegro_sphere_3", "allegro_box_4", "schunk_can", "planar_hand"])
@pytest.mark.parametrize("limited", [False, True], ids=["budget", "efforts"])
def test_the_force_lies_between_those_of_pyramids_inside_and_outside(name, limited):
    grasps = closed_grasps(name, 3)
    joints = len(grasps.problem.hand.mechanism.actuated)
    forces = quality.holding_force(grasps, FRICTION, BUDGET, efforts=0.2 if limited else False)
    rough = quality.holding_force(grasps, FRICTION, BUDGET, efforts=0.2 if limited else False, gap=0.01)
    for grasp, force, below in zip(grasps, forces, rough, strict=True):
        efforts = np.full(joints, 0.2) if limited else None
        inside, outside = (
            HoldingProgramme(grasp, FRICTION, BUDGET, efforts, outside=side).ball_radius() for side in (False, True)
        )
        assert 0.0 < 0.999 * inside <= force <= 1.001 * outside
        assert outside <= 1.02 * inside
        assert 0.99 * force <= below <= force * (1.0 + 1e-5)


@pytest.mark.parametrize("name", ["allegro_sphere_3", "planar_hand"])
def test_loads_along_directions_by_linear_programmes(name):
    grasps = closed_grasps(name, 3)
    axes, joints = grasps.problem.object_joint_model.translations, len(grasps.problem.hand.mechanism.actuated)
    holding = quality.holding_force(grasps, FRICTION, BUDGET, efforts=0.3)
    for direction in np.random.default_rng(5).normal(size=(4, axes)):
        loads = quality.resisted_load(grasps, direction, FRICTION, BUDGET, efforts=0.3)
        assert (loads >= holding * (1.0 - 1e-5)).all()
        unit = direction / np.linalg.norm(direction)
        for grasp, load in zip(grasps, loads, strict=True):
            inside, outside = (
                HoldingProgramme(grasp, FRICTION, BUDGET, np.full(joints, 0.3), outside=side).along(unit)
                for side in (False, True)
            )
            assert inside * (1.0 - 1e-5) <= load <= outside * (1.0 + 1e-9)
    same = quality.resisted_load(grasps, np.tile(direction, (len(grasps), 1)), FRICTION, BUDGET, efforts=0.3)
    np.testing.assert_array_equal(same, loads)


def test_contact_forces_balance_what_is_resisted_and_no_more():
    grasps = closed_grasps("allegro_sphere_3", 3)
    direction = np.array([0.6, 0.0, -0.8])
    loads = quality.resisted_load(grasps, direction, FRICTION, BUDGET)
    for share in (0.99, 1.01):
        forces = grasps.contact_forces(normal_force=BUDGET, friction=FRICTION, load=share * loads[:, None] * direction)
        assert ((forces.margin > 0.0) == (share < 1.0)).all()


@pytest.mark.parametrize(
    ("points", "torsional", "joint"),
    [(OPPOSITE, 0.01, "free_flyer"), (FACES, 0.0, "free_flyer"), (OPPOSITE, 0.0, "planar")],
    ids=["two soft fingers", "four fingers on two faces", "in the plane"],
)
def test_opposite_faces_hold_by_a_double_cone(points, torsional, joint):
    """Sides press with n and m, n + m <= N; without torque both rub alike, |t| <= 2 mu min(n, m).

    What is withstood along the axis is |n - m|, so across it mu (N - |n - m|): a double cone, in which the largest ball
    has the radius mu N / sqrt(1 + mu^2).
    """
    grasps = held_at(*points, joint)
    for friction in (0.2, 0.7):
        expected = friction * BUDGET / np.sqrt(1.0 + friction**2)
        force = quality.holding_force(grasps, friction, BUDGET, torsional)
        assert force == pytest.approx(expected, rel=2e-5)
        assert force <= expected * (1.0 + 1e-9)
        axis, across = np.eye(2 if joint == "planar" else 3)[:2]
        assert quality.resisted_load(grasps, 3.0 * axis, friction, BUDGET, torsional) == pytest.approx(BUDGET, rel=2e-6)
        load = quality.resisted_load(grasps, -across, friction, BUDGET, torsional)
        assert load == pytest.approx(friction * BUDGET, rel=2e-6)
        assert quality.resisted_load(grasps, axis + across, friction, BUDGET, torsional) == pytest.approx(
            np.sqrt(2.0) * friction * BUDGET / (1.0 + friction), rel=2e-6
        )


def test_efforts_alone_bound_the_forces():
    """Fingers along the axes: |f_x| <= E of each side, so tangential forces of mu E, 2 mu E in all, and E along x.

    Across x all of it is free while both sides press with E; so the body is, in x, from -E to E with nothing across at
    the ends, where one side does not press: |t| <= 2 mu (E - |f_x|), of which the ball has 2 mu E / sqrt(1 + 4 mu^2).
    """
    grasps, friction, effort = held_at(*FACES), 0.4, 3.0
    for budget in (1e3, np.inf):
        force = quality.holding_force(grasps, friction, budget, efforts=effort)
        each = 2.0 * effort
        assert force == pytest.approx(2.0 * friction * each / np.sqrt(1.0 + 4.0 * friction**2), rel=3e-5)
    sideways = {f"{finger}2": 0.1 for finger in "abcd"}
    weak = quality.holding_force(grasps, friction, np.inf, efforts={**sideways, **{f"{f}0": effort for f in "abcd"}})
    assert weak == pytest.approx(0.4, rel=1e-3)


def test_the_urdf_states_efforts(can):
    grasps = closed_grasps("schunk_can", 2, 0.8)
    efforts = grasps.problem.hand.efforts_by_name
    stated = quality.holding_force(grasps, 0.8, np.inf, efforts=True)
    np.testing.assert_array_equal(stated, quality.holding_force(grasps, 0.8, np.inf, efforts=efforts))
    assert (stated > quality.holding_force(grasps, 0.8, np.inf, efforts={n: e / 2 for n, e in efforts.items()})).all()
    planar = closed_grasps("planar_hand", 1)
    with pytest.raises(ga.GraspAtlasError, match="has no effort limit"):
        quality.holding_force(planar, efforts=True)


@pytest.mark.parametrize(("name", "torsional"), [("allegro_box_4", 0.0), ("three_finger_cup", 0.01)])
def test_more_friction_and_more_force_hold_more(name, torsional):
    grasps = closed_grasps(name, 4, torsional=torsional)

    def force(friction: float = FRICTION, budget: float = BUDGET, **more: float) -> np.ndarray:
        return quality.holding_force(grasps, friction, budget, torsional, **more)

    base = force()
    assert (base > 0.0).all()
    np.testing.assert_allclose(force(budget=2.0 * BUDGET), 2.0 * base, rtol=1e-9)
    assert (force(friction=1.1 * FRICTION) > base).all()
    limited = force(efforts=0.3)
    assert (limited < base).all()
    np.testing.assert_allclose(force(budget=2.0 * BUDGET, efforts=0.6), 2.0 * limited, rtol=1e-4)
    assert (force(efforts=0.35) > limited).all()
    assert (force(torque_length=0.05, gap=0.05) <= base).all()
    np.testing.assert_allclose(
        quality.holding_force(grasps, FRICTION, None, torsional),
        quality.holding_force(grasps, FRICTION, 5.0 * len(grasps.problem.contacts), torsional),
        rtol=0.0,
    )


@pytest.mark.parametrize("name", ["planar_hand", "allegro_sphere_3"])
def test_with_torques_it_is_the_epsilon_of_ferrari_and_canny(name):
    """Round cones, torques about the origin, which is the centre of mass, and a budget of normal force."""
    grasps, length = closed_grasps(name, 2), 0.04
    assert not grasps.problem.object.center_of_mass.any()
    epsilon = quality.ferrari_canny_epsilon(grasps, FRICTION, length, None)
    force = quality.holding_force(grasps, FRICTION, BUDGET, torque_length=length, gap=0.01)
    assert (force <= BUDGET * epsilon * (1.0 + 2e-4)).all()
    assert (force >= 0.99 * BUDGET * epsilon).all()


def test_no_closure_no_force():
    grasps = held_at(*OPPOSITE)
    assert quality.holding_force(grasps, 0.5) == 0.0  # two hard fingers: G has lost rank
    assert quality.resisted_load(grasps, [0.0, 0.0, 1.0], 0.5) == 0.0
    one_side = held_at(FACES[0] * [0.0, 1.0, 1.0] + [[0, 0.02, 0], [0, -0.02, 0]] * 2, np.tile([1.0, 0.0, 0.0], (4, 1)))
    assert quality.holding_force(one_side, 0.5) == 0.0


def test_arguments_that_make_no_sense():
    grasps = held_at(*FACES)
    wrong = {
        "friction": 0.0,
        "normal_force": np.inf,
        "torsional": -1.0,
        "torque_length": -0.1,
        "efforts": -1.0,
        "gap": 0.0,
    }
    for name, value in wrong.items():
        with pytest.raises(ga.GraspAtlasError, match=name):
            quality.holding_force(grasps, **{name: value})
    with pytest.raises(ga.GraspAtlasError, match="gap must be at least 1e-05"):
        quality.holding_force(grasps, gap=1e-7)
    for efforts, said in (({}, "names no joint"), ({"z9": 1.0}, "z9"), ({"a0": 0.0}, "a0"), ("strong", "efforts")):
        with pytest.raises(ga.GraspAtlasError, match=said):
            quality.holding_force(grasps, efforts=efforts)
    for direction in ([0.0, 0.0, 0.0], [1.0, 0.0], [[1.0, 0.0, 0.0]] * 2, [np.nan, 0.0, 0.0]):
        with pytest.raises(ga.GraspAtlasError, match="direction"):
            quality.resisted_load(grasps, direction)


def test_the_requirement_as_text_data_and_slack():
    requirement = ga.HoldingForce(2.0, 0.6)
    assert str(requirement) == "holding_force:2:0.6"
    assert str(ga.HoldingForce(2.0, torsional=0.01)) == "holding_force:2:0.5:0:0.01"
    for stated in (requirement, ga.HoldingForce(2.0, 0.6, 15.0, 0.003, 0.05), ga.HoldingForce()):
        assert parse_requirement(str(stated)) == stated
        assert requirement_from_dict(stated.to_dict()) == stated
    for name in ("at_least", "friction", "normal_force", "torsional", "torque_length"):
        with pytest.raises(ga.GraspAtlasError, match=name):
            ga.HoldingForce(**{name: -1.0})
    problem = ga.load_problem("allegro_sphere_3")
    grasps = ga.Grasps(problem, ga.find_grasps(problem, count=30, seed=4))
    forces = quality.holding_force(grasps, 0.6, gap=0.01)
    least = float(np.median(forces[forces > 0.0]))
    asked = ga.HoldingForce(least, 0.6)
    np.testing.assert_array_equal(asked.met(grasps), forces >= least)
    slacks = asked.slacks_near(grasps)(grasps)[:, 0]
    sure = np.abs(forces / least - 1.0) > 0.01
    np.testing.assert_array_equal(slacks[sure] >= 0.0, asked.met(grasps)[sure])
    assert (slacks[forces == 0.0] <= -1.0).all()
    assert (slacks[forces == 0.0] >= -2.0).all()
