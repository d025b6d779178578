"""Wrong use of the Python interface: an error that says what is wrong, never a crash and never a wrong answer."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from helpers import BENT, PythonSphere, Written, chain, robot, tripod_problem

import graspatlas as ga
from graspatlas import _core
from graspatlas.systems import Angles, Rotations, Sphere, Torus


def build(system, x0, **options):
    return ga.build_atlas(system, x0, **({"radius": 0.1, "epsilon": 0.1, "max_seconds": 5.0} | options))


def circle(residual=None, jacobian=None) -> Written:
    return Written(2, 1, residual or (lambda x: [x @ x - 1.0]), jacobian or (lambda x: [2.0 * x]))


WRONG_NUMBERS = [0, -1, float("nan"), float("inf"), "a", None, True, [0.1], 1j]


@pytest.mark.parametrize("name", ["radius", "epsilon"])
@pytest.mark.parametrize("value", WRONG_NUMBERS, ids=repr)
def test_radius_and_epsilon(name, value):
    with pytest.raises(ga.GraspAtlasError, match=name):
        build(Sphere(3), [0, 0, 1], **{name: value})


@pytest.mark.parametrize("value", [1, 1.5, 2])
def test_epsilon_is_below_one(value):
    with pytest.raises(ga.GraspAtlasError, match="epsilon must lie between 0 and 1"):
        build(Sphere(3), [0, 0, 1], epsilon=value)


@pytest.mark.parametrize("value", [0, -1, 1.5, "a", True, float("nan")], ids=repr)
def test_max_charts(value):
    with pytest.raises(ga.GraspAtlasError, match="max_charts must be a whole number"):
        build(Sphere(3), [0, 0, 1], max_charts=value)


@pytest.mark.parametrize("value", [0, -1, "a", True, float("nan")], ids=repr)
def test_max_seconds(value):
    with pytest.raises(ga.GraspAtlasError, match="max_seconds must be a positive number"):
        build(Sphere(3), [0, 0, 1], max_seconds=value)


def test_numpy_numbers_are_numbers():
    atlas = build(Sphere(3), [0, 0, 1], radius=np.float32(0.5), epsilon=np.float64(0.5), max_charts=np.int32(4))
    assert atlas.n_charts == 4


@pytest.mark.parametrize(
    "x0",
    [
        [1, 0],
        [1, 0, 0, 0],
        [[0, 0, 1]],
        1.0,
        [],
        None,
        "abc",
        [1j, 0, 0],
        [[1], [1, 2]],
        [np.nan, 0, 1],
        [np.inf, 0, 0],
    ],
    ids=repr,
)
def test_wrong_first_points(x0):
    with pytest.raises(ga.GraspAtlasError, match="x0"):
        build(Sphere(3), x0)


def test_first_points_far_away_and_where_the_jacobian_vanishes():
    near = build(Sphere(3), [0.0, 0.0, 3.0])
    np.testing.assert_allclose(near.centers[0], [0, 0, 1], atol=1e-9)
    with pytest.raises(ga.GraspAtlasError, match="could not be projected") as caught:
        build(Sphere(3), [1e150, 0, 0])
    assert len(str(caught.value)) < 200
    with pytest.raises(ga.GraspAtlasError, match="lost rank"):
        build(Sphere(3), [0, 0, 0])
    with pytest.raises(ga.GraspAtlasError, match=r"breaks the lower bound of variable 2 by 0\.5"):
        build(PythonSphere(3, lower=[-np.inf, -np.inf, 0.5]), [1, 0, 0])


def test_a_first_rotation_must_be_one():
    for x0 in ([0, 0, 0, 0], [0, 0, 0, 1e-200], [0, 0, 0, 2.0]):
        with pytest.raises(ga.GraspAtlasError, match="x0"):
            build(Rotations(), x0, radius=0.5, epsilon=0.5, max_seconds=0.2)
    atlas = build(Rotations(), [0, 0, 0, 1.0], radius=0.5, epsilon=0.5)
    np.testing.assert_allclose(np.linalg.norm(atlas.centers, axis=1), 1.0, atol=1e-12)


@pytest.mark.parametrize(
    "system", [42, None, "sphere", Sphere, lambda x: x], ids=lambda v: getattr(v, "__name__", repr(v))
)
def test_what_is_no_system(system):
    with pytest.raises(ga.GraspAtlasError, match=r"must be a graspatlas\.System"):
        build(system, [0, 0, 1])


@pytest.mark.parametrize("problem", [42, None, "schunk_can"], ids=repr)
def test_what_is_no_problem(problem):
    with pytest.raises(ga.GraspAtlasError, match="load_problem"):
        ga.optimize(problem)


def test_systems_of_impossible_size():
    for make in (lambda: Sphere(1), lambda: Sphere(0), lambda: Sphere(-1), lambda: Angles(0), lambda: Angles(-2)):
        with pytest.raises(ga.GraspAtlasError, match="variable"):
            make()
    for sizes in ((2, 2), (2, 3), (0, 0), (2, -1), (-1, 0)):
        with pytest.raises(ga.GraspAtlasError):
            ga.System(*sizes)
    for radii in ((0.5, 0.8), (0.5, 0.5), (1.0, 0.0), (np.nan, 0.5), (np.inf, 0.5), (1.0, -0.5)):
        with pytest.raises(ga.GraspAtlasError, match="torus"):
            Torus(*radii)
    with pytest.raises(ga.GraspAtlasError, match="dimensions"):
        build(Sphere(14), np.eye(14)[0])


@pytest.mark.parametrize(
    "bounds",
    [{"lower": [1, 2, 3]}, {"lower": 1, "upper": 0}, {"lower": np.nan}, {"lower": 0, "upper": 0}, {"upper": "a"}],
    ids=repr,
)
def test_wrong_bounds(bounds):
    with pytest.raises(ga.GraspAtlasError, match=r"bounds|lower"):
        ga.System(2, 1, **bounds)


SHAPES = {
    "none": None,
    "a number": 1.0,
    "nothing": [],
    "two": [1.0, 2.0],
    "three": [1.0, 2.0, 3.0],
    "deep": [[[1.0]]],
}


@pytest.mark.parametrize("name", SHAPES)
def test_wrong_shapes_from_a_system(name):
    with pytest.raises(ga.GraspAtlasError, match=r"residual\(x\) must return"):
        build(circle(residual=lambda x: SHAPES[name]), [1, 0])
    with pytest.raises(ga.GraspAtlasError, match=r"jacobian\(x\) must return"):
        build(circle(jacobian=lambda x: SHAPES[name]), [1, 0])


@pytest.mark.parametrize("value", ["abc", [object()], [[1], [1, 2]], [1j]], ids=["text", "object", "ragged", "complex"])
def test_no_numbers_from_a_system(value):
    for system in (circle(residual=lambda x: value), circle(jacobian=lambda x: value)):
        with pytest.raises((TypeError, ValueError)):
            build(system, [1, 0])


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_numbers_that_are_not_finite_from_a_system(value):
    with pytest.raises(ga.GraspAtlasError, match="could not be projected"):
        build(circle(residual=lambda x: [value]), [1, 0])
    with pytest.raises(ga.GraspAtlasError, match=r"could not be projected|rank"):
        build(circle(jacobian=lambda x: [[value, 0.0]]), [1, 0])


def test_nan_on_the_way_closes_charts_and_says_so():
    """Where the residual is NaN the manifold ends: the atlas stops there with the reason."""
    system = Written(3, 1, lambda x: [x @ x - 1.0 if x[2] > 0 else np.nan], lambda x: [2.0 * x])
    atlas = build(system, [0, 0, 1])
    assert not atlas.complete
    assert atlas.status is ga.Status.BLOCKED
    assert atlas.closed_vertices["not_converged"] > 10
    assert atlas.centers[:, 2].min() > 0.0
    assert np.isfinite(atlas.centers).all()


@pytest.mark.parametrize("error", [ValueError, ZeroDivisionError, RuntimeError, SystemExit])
@pytest.mark.parametrize("calls", [0, 60])
def test_an_exception_in_a_system_reaches_the_caller(error, calls):
    """From the first point as well as from the middle of the work, which runs without Python's global lock."""
    count = 0

    def residual(x):
        nonlocal count
        count += 1
        if count > calls:
            raise error("from the system")
        return [x @ x - 1.0]

    with pytest.raises(error, match="from the system"):
        build(Written(3, 1, residual, lambda x: [2.0 * x]), [0, 0, 1])


def test_an_interruption_in_a_system_keeps_the_charts():
    count = 0

    def residual(x):
        nonlocal count
        count += 1
        if count == 200:
            raise KeyboardInterrupt
        return [x @ x - 1.0]

    atlas = build(Written(3, 1, residual, lambda x: [2.0 * x]), [0, 0, 1])
    assert atlas.status is ga.Status.INTERRUPTED
    assert 10 < atlas.n_charts < 200
    assert not atlas.complete


def test_systems_without_methods():
    with pytest.raises((NotImplementedError, ga.GraspAtlasError)):
        build(ga.System(2, 1), [1, 0])

    class NoInit(ga.System):
        def __init__(self):
            pass

    with pytest.raises(TypeError, match="__init__"):
        NoInit()


def test_redundant_equations_are_reported():
    system = Written(3, 2, lambda x: [x @ x - 1.0, 3.0 * (x @ x - 1.0)], lambda x: [2.0 * x, 6.0 * x])
    with pytest.raises(ga.GraspAtlasError, match="redundant"):
        build(system, [0, 0, 1])


def test_a_double_root_is_no_manifold_for_newton():
    system = Written(3, 1, lambda x: [x[2] ** 2], lambda x: [[0.0, 0.0, 2.0 * x[2]]])
    with pytest.raises(ga.GraspAtlasError, match=r"projected|rank"):
        build(system, [0, 0, 0.1])


@pytest.mark.parametrize("scale", [0.1, 1.0, 1e4])
def test_the_size_of_the_manifold_does_not_matter(scale):
    """A sphere of radius 10,000 in its own units is a sphere: rounding there is larger than an absolute 1e-11."""
    system = Written(3, 1, lambda x: [x @ x - scale**2], lambda x: [2.0 * x])
    x0 = scale * np.array([0.6, 0.64, 0.48])
    # epsilon is a length too, in eq (17): below one unit, so the charts of the large sphere are small.
    atlas = build(system, x0, radius=min(0.2 * scale, 50.0), epsilon=0.2, max_charts=300)
    assert atlas.n_charts > 100
    np.testing.assert_allclose(np.linalg.norm(atlas.centers, axis=1), scale, rtol=1e-9)


def test_atlas_methods_check_their_arguments(sphere):
    with pytest.raises(ga.GraspAtlasError, match="u must hold 2"):
        sphere.point(0, [0.1])
    with pytest.raises(ga.GraspAtlasError, match="x must hold 3"):
        sphere.locate([0.0, 1.0])
    with pytest.raises(IndexError):
        sphere.point(10**6, [0.0, 0.0])


def test_problems_are_checked(can):
    with pytest.raises(ga.GraspAtlasError, match="no contact"):
        replace(can, contacts=())
    for scale in (0.0, -1.0, np.nan, np.inf):
        with pytest.raises(ga.GraspAtlasError, match="length_scale"):
            replace(can, length_scale=scale)
    for dimension in (0, 9, -1, 2.0, "2", None, True):
        with pytest.raises(ga.GraspAtlasError, match="dimension must be a whole number from 1 to 8"):
            can.system(dimension)
    nowhere = replace(can.contacts[0], frame="middle_distl")
    with pytest.raises(ga.GraspAtlasError, match="did you mean 'middle_distal'"):
        replace(can, contacts=(nowhere,))
    with pytest.raises(ga.GraspAtlasError, match="no default for radius, epsilon, quality"):
        ga.optimize(replace(can, defaults={"dimension": 2}))
    with pytest.raises(ga.GraspAtlasError, match="frozen at nan"):
        replace(can.contacts[0], frozen={"u": np.nan})
    with pytest.raises(ga.GraspAtlasError, match="object joint"):
        replace(can, object_joint="floating")


def test_contacts_with_normals_that_agree_are_refused(can):
    """The fingertip inside the can, touching it from the wrong side."""
    contact = can.contacts[0]
    flipped = replace(contact.hand, normal=tuple(-np.array(contact.hand.normal)))
    with pytest.raises(ga.GraspAtlasError, match="180 degrees"):
        replace(can, contacts=(replace(contact, hand=flipped), *can.contacts[1:]))


def test_a_first_grasp_at_its_limits_works(can):
    """Limits that x1 just meets, as a measured posture often does."""
    x1 = can.x1.joints
    hand = replace(can.hand, limits={name: (x1[name], x1[name] + 0.5) for name in ("thumb_pip", "index_abduction")})
    atlas = ga.build_atlas(replace(can, hand=hand).system(2), can.x1_array, radius=0.3, epsilon=0.5, max_charts=50)
    assert atlas.n_charts > 3


def test_a_first_grasp_that_projection_pushes_over_a_limit_names_it(can):
    """A millimetre off the contacts is allowed; where that costs a limit, the message says which."""
    x1 = can.x1
    hand = replace(can.hand, limits={"thumb_pip": (0.0, 1.0), "index_mcp": (x1.joints["index_mcp"], 1.5)})
    for shift in np.random.default_rng(0).normal(scale=2e-4, size=(8, 3)):
        moved = replace(x1, object_xyz=tuple(np.array(x1.object_xyz) + shift))
        problem = replace(can, hand=hand, x1=moved)
        try:
            atlas = ga.build_atlas(problem.system(2), problem.x1_array, radius=0.3, epsilon=0.5, max_charts=5)
        except ga.GraspAtlasError as error:
            message = str(error)
            assert any(joint in message for joint in ("thumb_pip", "index_mcp")), message
        else:
            assert atlas.n_charts > 1


def test_a_joint_without_room_is_refused(can):
    """Equal limits leave a manifold of one dimension less, which charts of k dimensions cannot cover."""
    with pytest.raises(ga.GraspAtlasError, match="limits of joint 'thumb_pip'"):
        replace(can.hand, limits={"thumb_pip": (0.0, 0.0)})


@pytest.mark.parametrize(
    "room",
    [
        1e-2,
        1e-4,
        1e-6,
        1e-9,
    ],
)
def test_a_joint_with_hardly_any_room_is_covered_or_not_called_global(can, room):
    """The grasps between such limits are a strip, as long as it is for wider ones: some thirty charts."""
    q = can.x1.joints["thumb_pip"]
    hand = replace(can.hand, limits={"thumb_pip": (q - room, q + room)})
    result = ga.optimize(replace(can, hand=hand), dimension=2, radius=0.2, require=())
    assert result.status is ga.Status.COMPLETE
    assert result.atlas.n_charts > 20 or not result.is_global


def test_redundant_contacts_are_reported(can):
    """The same contact twice adds five equations that say nothing."""
    twice = replace(can, contacts=(*can.contacts, can.contacts[0]))
    with pytest.raises(ga.GraspAtlasError, match=r"redundant|contact"):
        ga.optimize(twice)


@pytest.mark.parametrize("name", ["schunk_cam", "", "x/y", "nothing.json"])
def test_unknown_problems(name):
    with pytest.raises(ga.GraspAtlasError, match="problem"):
        ga.load_problem(name)


FINGER = chain("f", (0.0, 0.0, 0.1), ["0 0 1", "0 1 0"], 0.05)


def test_limits_of_a_continuous_joint_are_not_forgotten():
    """A joint that goes round has no limits; stating some means something, so it is refused or respected."""
    urdf = robot(chain("f", (0.0, 0.0, 0.1), ["0 0 1", "0 1 0"], 0.05, "continuous"))
    with pytest.raises(ga.GraspAtlasError, match=r"continuous|limits"):
        _ = ga.Hand("h", urdf, limits={"f0": (-1.0, 1.0)}).joint_limits


def test_joints_with_many_freedoms_are_refused():
    joint = '<joint name="j" type="{}"><parent link="palm"/><child link="b"/><axis xyz="0 0 1"/></joint>'
    for kind in ("floating", "planar"):
        hand = ga.Hand("h", robot('<link name="b"/>', joint.format(kind)))
        contact = ga.Contact("b", ga.patches.Point((0, 0, 0), (0, 0, 1)), ga.patches.Plane((0, 0, 0), (0, 0, -1)))
        with pytest.raises(ga.GraspAtlasError, match="'j'"):
            ga.Problem("p", hand, ga.Body("o", robot()), (contact,), ga.FirstGrasp({"j": 0.0}))


def test_a_broken_hand_is_reported_without_noise(capfd):
    for urdf in ("", "hello", "<robot", robot().replace("palm", "")):
        with pytest.raises(ga.GraspAtlasError, match="'h'"):
            _ = ga.Hand("h", urdf).joints
    out, err = capfd.readouterr()
    assert (out, err) == ("", "")


def test_contacts_on_joints_that_do_not_exist(can):
    model = _core.Model(can.hand.urdf, "none")
    frozen = _core.PatchParameter(False, 0.0, False, -1.0, 1.0)
    lower, upper = can.hand.joint_limits
    for joint in (-1, 99):
        side = _core.ContactSide(joint, np.eye(4), _core.PlanePatch(np.eye(4)), frozen, frozen)
        with pytest.raises(ga.GraspAtlasError, match=f"joint {joint}, the model has 14"):
            _core.GraspSystem(model, [(side, side)], np.eye(13), 0.01, list(lower), list(upper))


def test_wrong_arguments_of_compiled_parts(can):
    with pytest.raises(ga.GraspAtlasError, match="object's joint"):
        _core.Model(can.hand.urdf, "ball")
    with pytest.raises(ga.GraspAtlasError, match="q must hold 13"):
        can.hand.link_placements(np.zeros(5))
    with pytest.raises(ga.GraspAtlasError, match="columns"):
        can.full_system.grasp_arrays(np.zeros((2, 3)))
    with pytest.raises(ga.GraspAtlasError, match="length_unit"):
        _core.semi_axes(can.full_system, can.x1_array[None], 0.0)
    with pytest.raises(ga.GraspAtlasError, match="x must hold"):
        can.full_system.evaluate_residual([1.0])


def test_made_problems_round_trip():
    problem = tripod_problem(BENT)
    data = problem.to_dict()
    again = ga.Problem.from_dict(data)
    assert again.to_dict() == data
    assert again.x1_array.tobytes() == problem.x1_array.tobytes()
