"""Fuzzing of every public entry: a clear error, a status or a right answer; never a crash, a hang or a silent lie.

What is drawn here is wrong in type, shape or size, or right by chance. Where a call is accepted, its answer is checked.
"""

from __future__ import annotations

import faulthandler
import json
import sys
from collections.abc import Callable, Iterator
from dataclasses import astuple, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers import BENT, Written, tripod_problem
from hypothesis import given, settings
from hypothesis import strategies as st

import graspatlas as ga
from graspatlas import patches, quality, requirements
from graspatlas.atlas.coverage import measure_coverage
from graspatlas.atlas.verification import check_atlas
from graspatlas.cli import main
from graspatlas.systems import Angles, Rotations, Sphere, Torus

# A test that hangs, even inside compiled code, ends the run with the stack of where it hangs [s].
HANG = 240.0


@pytest.fixture(autouse=True)
def _no_hang() -> Iterator[None]:
    faulthandler.dump_traceback_later(HANG, exit=True, file=sys.__stderr__)
    yield
    faulthandler.cancel_dump_traceback_later()


NAN, INF = float("nan"), float("inf")
ODD_NUMBERS = [
    0.0,
    -0.0,
    1.0,
    -1.0,
    0.5,
    NAN,
    INF,
    -INF,
    5e-324,
    1e-300,
    1e-12,
    1e12,
    1e300,
    sys.float_info.max,
    2**70,
    10**400,
]
odd_numbers = st.sampled_from(ODD_NUMBERS) | st.floats() | st.integers(-3, 12)
no_numbers = st.sampled_from(
    [
        None,
        True,
        False,
        "",
        "a",
        "1",
        "nan",
        b"1",
        1j,
        [],
        {},
        (),
        [None],
        ["a"],
        [[1.0], [1.0, 2.0]],
        object(),
        int,
        np.nan,
    ]
)
anything = no_numbers | odd_numbers | st.lists(odd_numbers, max_size=4) | st.text(max_size=4)
vectors = st.tuples(odd_numbers, odd_numbers, odd_numbers) | st.tuples(*[st.floats(-1.0, 1.0)] * 3)


def tried(call: Callable[[], Any], *also: type[Exception]) -> Any:
    """What a call gives, or None when it is refused in one line that is short enough to read."""
    try:
        return call()
    except ga.GraspAtlasError as error:
        message = str(error)
        assert message
        assert "\n" not in message
        assert len(message) < 700, message
        return None
    except also:
        return None


def few(examples: int) -> Any:
    return settings(max_examples=examples)


def check_answer(result: ga.Result | None) -> None:
    """What is accepted has a right answer: charts, index, best, and a claim of being global that holds."""
    if result is None:
        return
    failed = {check.claim for check in result.check().checks if not check.passed}
    if not result.is_global:  # then it does not say that nothing is missing
        failed = {claim for claim in failed if "vertices closed" not in claim and "without the atlas" not in claim}
    assert not failed
    json.dumps(result.summary(), allow_nan=False)


# ---------------------------------------------------------------------------------------------------- atlases


SYSTEMS = [
    (Sphere(2), [0.6, 0.8]),
    (Sphere(3), [0.0, 0.6, 0.8]),
    (Sphere(4), [0.0, 0.0, 0.6, 0.8]),
    (Torus(0.8, 0.5), [1.3, 0.0, 0.0]),
    (Angles(2), [3.1, -3.1]),
    (Rotations(), [0.0, 0.0, 0.0, 1.0]),
]


@given(
    case=st.sampled_from(SYSTEMS),
    radius=st.floats(0.0, 2.0) | odd_numbers | no_numbers,
    epsilon=st.floats(0.0, 1.0) | odd_numbers | no_numbers,
    max_charts=st.just(40) | anything,
)
@few(300)
def test_build_atlas_options(case, radius, epsilon, max_charts):
    system, x0 = case
    limits = {"max_charts": max_charts, "max_seconds": 0.05}
    atlas = tried(lambda: ga.build_atlas(system, x0, radius=radius, epsilon=epsilon, **limits))
    if atlas is not None:
        report = check_atlas(atlas)
        assert report, report


@given(case=st.sampled_from(SYSTEMS), data=st.data())
@few(150)
def test_build_atlas_first_points(case, data):
    system, x0 = case
    point = data.draw(anything | st.lists(odd_numbers, min_size=len(x0), max_size=len(x0)))
    atlas = tried(lambda: ga.build_atlas(system, point, radius=0.3, epsilon=0.3, max_charts=5))
    if atlas is not None:
        assert check_atlas(atlas)


@given(system=anything, max_seconds=anything)
@few(60)
def test_build_atlas_other_types(system, max_seconds):
    assert tried(lambda: ga.build_atlas(system, [1.0, 0.0], radius=0.1, epsilon=0.1)) is None
    options = {"radius": 0.5, "epsilon": 0.1, "max_charts": 9}
    atlas = tried(lambda: ga.build_atlas(Sphere(3), [0, 0, 1], max_seconds=max_seconds, **options))
    if atlas is not None:
        assert check_atlas(atlas)
        assert atlas.n_charts == 9 or (atlas.status is ga.Status.TIME_LIMIT and max_seconds < 1.0)
    elif isinstance(max_seconds, float):
        assert not 0.0 < max_seconds < INF


@given(n=anything, e=anything, lower=anything, upper=anything)
@few(150)
def test_systems_of_any_size(n, e, lower, upper):
    system = tried(lambda: ga.System(n, e, lower, upper), TypeError)
    if system is not None:
        assert (system.configuration_size, system.n_equations, system.dimension) == (n, e, n - e)
        finite = [np.isfinite(np.broadcast_to(np.asarray(bound, float), n)) for bound in (lower, upper)]
        assert len(system.bound_normals) == sum(int(flags.sum()) for flags in finite)
    torus = tried(lambda: Torus(n, e), TypeError)
    if torus is not None:
        assert n > e > 0.0
        assert abs(torus.evaluate_residual([n + e, 0.0, 0.0])[0]) <= 1e-12 * max(1.0, (n + e) ** 2)
    if not isinstance(n, int) or n < 1000:
        sphere = tried(lambda: Sphere(n), TypeError)
        assert sphere is None or sphere.evaluate_residual(np.eye(int(n))[0])[0] == 0.0
        angles = tried(lambda: Angles(n), TypeError)
        assert angles is None or (angles.dimension, angles.n_equations) == (n, 0)


@given(residual=anything, jacobian=anything, good=st.integers(0, 2))
@few(150)
def test_systems_that_return_anything(residual, jacobian, good):
    """The system is right for a while, then returns what it likes."""
    calls = 0

    def wrong(value, right):
        nonlocal calls
        calls += 1
        return right if calls <= 12 * good else value

    system = Written(3, 1, lambda x: wrong(residual, [x @ x - 1.0]), lambda x: wrong(jacobian, [2.0 * x]))
    atlas = tried(
        lambda: ga.build_atlas(system, [0.0, 0.6, 0.8], radius=0.3, epsilon=0.3, max_charts=10, max_seconds=0.5),
        TypeError,
        ValueError,
        OverflowError,
    )
    if atlas is not None:
        assert np.isfinite(atlas.centers).all()


@given(scale=st.floats(-6, 6), noise=st.floats(0.01, 10.0), seed=st.integers(0, 99))
@few(40)
def test_a_wrong_jacobian_is_found_out(scale, noise, seed):
    factor = 10.0**scale
    wrong = noise * np.random.default_rng(seed).normal(size=(1, 3))

    def build(jacobian):
        system = Written(3, 1, lambda x: [factor * (x @ x - 1.0)], jacobian)
        return ga.build_atlas(system, [0.0, 0.6, 0.8], radius=0.3, epsilon=0.3, max_charts=10)

    with pytest.raises(ga.GraspAtlasError, match="jacobian"):
        build(lambda x: factor * (2.0 * x[None] + wrong))
    assert build(lambda x: factor * 2.0 * x[None]).n_charts == 10


@pytest.mark.parametrize("scale", [0.5, -1.0, 1.02, 2.0])
def test_a_jacobian_that_misses_a_factor_is_found_out(scale):
    system = Written(3, 1, lambda x: [x @ x - 1.0], lambda x: [scale * 2.0 * x])
    with pytest.raises(ga.GraspAtlasError, match="jacobian"):
        ga.build_atlas(system, [0.0, 0.6, 0.8], radius=0.3, epsilon=0.3)


def test_equations_that_become_redundant_close_the_atlas_there():
    """A meridian of the upper half of a sphere; on the lower half its equation says nothing."""
    system = Written(
        3,
        2,
        lambda x: [x @ x - 1.0, x[1] * max(x[2], 0.0) ** 2],
        lambda x: [2.0 * x, [0.0, max(x[2], 0.0) ** 2, 2.0 * x[1] * max(x[2], 0.0)]],
    )
    atlas = ga.build_atlas(system, [0.0, 0.0, 1.0], radius=0.1, epsilon=0.2, max_charts=500)
    assert check_atlas(atlas)
    assert atlas.closed_vertices["curvature"] + atlas.closed_vertices["not_converged"] > 0
    assert atlas.n_charts < 100


def test_a_point_without_tangent_space_hides_nothing():
    """A double cone, bounded: at its apex the equation has no slope, and both halves are covered all the same."""

    class Cone(ga.System):
        def __init__(self):
            super().__init__(3, 1, lower=-0.4, upper=0.4)

        def residual(self, x):
            return [x[0] ** 2 + x[1] ** 2 - x[2] ** 2]

        def jacobian(self, x):
            return [[2.0 * x[0], 2.0 * x[1], -2.0 * x[2]]]

    atlas = ga.build_atlas(Cone(), [0.3, 0.0, 0.3], radius=0.05, epsilon=0.2)
    assert check_atlas(atlas)
    assert atlas.centers[:, 2].min() < -0.3
    assert measure_coverage(atlas, atlas.system).farthest < 0.5


@given(x=anything | vectors, u=anything, chart=anything)
@few(150)
def test_atlas_methods(sphere, x, u, chart):
    found = tried(lambda: sphere.locate(x))
    if found is not None:
        assert found[0] == -1 or found[1] < 0.2
    point = tried(lambda: sphere.point(0, u))
    assert point is None or abs(np.linalg.norm(point) - 1.0) < 1e-9
    tried(lambda: sphere.point(chart, [0.01, 0.0]), IndexError, TypeError, ValueError)


# ---------------------------------------------------------------------------------------------------- patches


def check_patch(patch: patches.Patch, u: float, v: float, point: tuple[float, float, float]) -> None:
    """The identities of a patch, at (u, v) and at what `locate` gives."""
    low, high = patch.interval("v") if "v" in patch.parameters else (-1.0, 1.0)
    places = [(u, min(max(v, low), high))]
    if np.abs(point).max() < 1e3:
        places.append(patch.locate(point))
    for place in places:
        values = patch.core().evaluate(*place)
        frame = np.array([values["a"], values["m"], values["b"]])
        np.testing.assert_allclose(frame @ frame.T, np.eye(3), atol=1e-9)
        assert np.isfinite(values["o"]).all()
        scale = 1.0 + np.abs(values["o_v"]).max()
        assert abs(values["o_u"] @ values["m"]) <= 1e-9 * (1.0 + np.abs(values["o_u"]).max())
        assert abs(values["o_v"] @ values["m"]) <= 1e-9 * scale


intervals = st.none() | st.tuples(odd_numbers, odd_numbers) | anything
axes = vectors | anything
lengths = st.floats(1e-3, 1.0) | odd_numbers
pairs = st.tuples(lengths, lengths) | anything


@given(
    kind=st.sampled_from(["point", "plane", "cylinder", "cone", "revolution", "ball", None]),
    values=st.fixed_dictionaries(
        {},
        optional={
            "position": axes, "origin": axes, "normal": axes, "axis": axes, "u_axis": axes,
            "u_interval": intervals, "v_interval": intervals,
            "radius": lengths | anything, "heights": pairs, "radii": pairs,
        },
    ),
    u=st.floats(-7.0, 7.0), v=st.floats(-2.0, 2.0), point=vectors,
)  # fmt: skip
@few(400)
def test_patches(kind, values, u, v, point):
    known = {"point": {"position", "normal"}, "plane": {"origin", "normal", "u_axis", "u_interval", "v_interval"}}
    turned = {"origin", "axis", "u_axis", "u_interval", "v_interval"}
    known |= {"cylinder": turned | {"radius"}, "cone": turned | {"heights", "radii"}}
    known["revolution"] = known["cone"]
    chosen = {name: value for name, value in values.items() if name in known.get(kind, values)}
    patch = tried(lambda: patches.patch_from_dict({"type": kind, **chosen}))
    if patch is not None:
        check_patch(patch, u, v, point)


@given(heights=st.lists(st.floats(-0.1, 0.1), min_size=2, max_size=6), radii=st.lists(lengths, min_size=2, max_size=6))
@few(100)
def test_outlines(heights, radii):
    patch = tried(lambda: patches.Revolution(heights=sorted(heights), radii=radii))
    if patch is not None and max(radii) < 10.0:
        check_patch(patch, 0.3, 0.5 * sum(patch.interval("v")), (0.1, 0.0, 0.1))


# ---------------------------------------------------------------------------------------------------- problems


def small_problem() -> ga.Problem:
    return tripod_problem(
        BENT, defaults={"dimension": 6, "radius": 0.5, "epsilon": 0.5, "quality": "smallest_semi_axis"}
    )


@pytest.fixture(scope="module")
def tripod() -> ga.Problem:
    return small_problem()


@pytest.fixture(scope="module")
def tripod_result(tripod) -> ga.Result:
    return ga.optimize(tripod, max_charts=8)


@given(dimension=anything, radius=anything, epsilon=anything, index=anything, require=anything)
@few(60)
def test_optimize(tripod, dimension, radius, epsilon, index, require):
    options: dict[str, Any] = {"dimension": 6, "radius": 0.5, "epsilon": 0.5, "quality": "smallest_semi_axis"}
    for name, value in {"dimension": dimension, "radius": radius, "epsilon": epsilon, "quality": index}.items():
        result = tried(lambda o=options | {name: value}: ga.optimize(tripod, **o, max_charts=4, max_seconds=0.2))
        check_answer(result)
    check_answer(tried(lambda: ga.optimize(tripod, require=require, max_charts=3)))
    assert tried(lambda: ga.optimize(require)) is None


@given(
    length_scale=odd_numbers | no_numbers,
    xyz=vectors | anything,
    quaternion=st.tuples(*[odd_numbers] * 4) | anything,
    angle=odd_numbers | no_numbers,
    parameters=anything,
    joint=anything,
)
@few(40)
def test_problems(tripod, length_scale, xyz, quaternion, angle, parameters, joint):
    joints = dict(tripod.x1.joints)
    wrong = [
        lambda: replace(tripod, length_scale=length_scale),
        lambda: replace(tripod, object_joint=joint),
        lambda: replace(tripod, contacts=joint),
        lambda: replace(tripod, x1=joint),
        lambda: replace(tripod, x1=ga.FirstGrasp(joints, object_xyz=xyz)),
        lambda: replace(tripod, x1=ga.FirstGrasp(joints, object_quat_xyzw=quaternion)),
        lambda: replace(tripod, x1=ga.FirstGrasp(joints | {"a1": angle})),
        lambda: replace(tripod, x1=ga.FirstGrasp(joint)),
        lambda: replace(tripod, x1=ga.FirstGrasp(joints, parameters=parameters)),
        lambda: replace(tripod, motions=joint),
        lambda: replace(tripod, hand=joint),
        lambda: replace(tripod, hand=replace(tripod.hand, limits={"a1": parameters})),
    ]
    for make in wrong:
        problem = tried(make)
        if problem is not None:
            check_answer(tried(lambda p=problem: ga.optimize(p, max_charts=3, max_seconds=0.2)))


@given(
    frame=anything, hand=anything, body=anything, frozen=anything | st.dictionaries(st.sampled_from("uvw"), anything)
)
@few(150)
def test_contacts(tripod, frame, hand, body, frozen):
    contact = tripod.contacts[0]
    changes = ({"frame": frame}, {"hand": hand}, {"object": body}, {"frozen": frozen}, {"hand_frozen": frozen})
    for change in changes:
        made = tried(lambda c=change: replace(contact, **c))
        if made is not None:
            problem = tried(lambda m=made: replace(tripod, contacts=(m, *tripod.contacts[1:])))
            if problem is not None:
                assert ga.Problem.from_dict(problem.to_dict()).to_dict() == problem.to_dict()
                check_answer(tried(lambda p=problem: ga.optimize(p, max_charts=2, max_seconds=0.2)))


@given(
    samples=anything | st.lists(st.lists(odd_numbers, min_size=3, max_size=3), max_size=4), joints=anything, s=anything
)
@few(200)
def test_hand_motions(samples, joints, s):
    tried(lambda: ga.HandMotions.from_samples(samples, joints))
    tried(lambda: ga.HandMotions(joints, samples, samples))
    motions = tried(lambda: ga.HandMotions.from_samples(samples, "abc"))
    if motions is not None:
        np.testing.assert_allclose(motions.E.T @ motions.E, np.eye(3), atol=1e-9)
        kept = tried(lambda: motions.kept(s))
        assert kept is None or kept.shape == (3, 3 - s)
        other = tried(lambda: motions.reordered(joints))
        assert other is None or set(other.joints) <= set("abc")
        turned = motions.reordered("cab")
        np.testing.assert_array_equal(turned.mean, motions.mean[[2, 0, 1]])
        np.testing.assert_allclose(turned.variances, motions.variances, atol=1e-9 * (1.0 + motions.variances.max()))


@given(data=st.data())
@few(60)
def test_damaged_urdfs(tripod, tmp_path, capfd, data):
    text = data.draw(st.sampled_from([tripod.hand.urdf, '<robot name="plate"><link name="plate"/></robot>']))
    path = tmp_path / "damaged.urdf"
    path.write_bytes(damaged(text.encode(), data))
    hand = tried(lambda: ga.Hand.from_urdf(path))
    if hand is not None and tried(lambda: hand.joints):
        problem = tried(lambda: replace(tripod, hand=hand))
        if problem is not None:
            check_answer(tried(lambda: ga.optimize(problem, max_charts=2, max_seconds=0.2)))
    body = tried(lambda: ga.Body.from_urdf(path))
    assert body is None or "<robot" in body.urdf


def damaged(content: bytes, data: Any) -> bytes:
    """Bytes with a piece cut out, doubled, or replaced by others."""
    start = data.draw(st.integers(0, len(content)))
    end = data.draw(st.integers(start, min(len(content), start + 80)))
    piece = data.draw(
        st.sampled_from([b"", content[start:end] * 2, b"<", b'"', b"nan", b"1e999", b"-", b"0 0 0", b"\xff"])
    )
    return content[:start] + piece + content[end:]


json_values = (
    st.none() | st.booleans() | odd_numbers | st.text(max_size=3) | st.lists(odd_numbers, max_size=4) | st.just({})
)


def change_leaf(tree: Any, data: Any) -> None:
    """Replace one value somewhere in a tree of dicts and lists, or drop it."""
    while True:
        keys = list(tree) if isinstance(tree, dict) else list(range(len(tree)))
        key = data.draw(st.sampled_from(keys))
        if isinstance(tree[key], dict | list) and tree[key] and data.draw(st.booleans()):
            tree = tree[key]
            continue
        if data.draw(st.integers(0, 4)) == 0:
            del tree[key]
        else:
            tree[key] = data.draw(json_values)
        return


@given(data=st.data())
@few(150)
def test_damaged_problem_files(tripod, tmp_path, capfd, data):
    content = json.loads(json.dumps(tripod.to_dict()))
    change_leaf(content, data)
    text = json.dumps(content).encode()
    if data.draw(st.integers(0, 3)) == 0:
        text = damaged(text, data)
    path = tmp_path / "problem.json"
    path.write_bytes(text)
    problem = tried(lambda: ga.load_problem(path))
    if problem is not None:
        assert ga.Problem.from_dict(problem.to_dict()).to_dict() == problem.to_dict()
        check_answer(tried(lambda: ga.optimize(problem, max_charts=3, max_seconds=0.2)))


# ---------------------------------------------------------------------------------------------------- results


@pytest.fixture(scope="module")
def stored(tripod_result, tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("fuzz") / "result.npz"
    tripod_result.save(path)
    return path


@given(data=st.data())
@few(60)
def test_damaged_results(stored, tmp_path, data):
    path = tmp_path / "result.npz"
    path.write_bytes(damaged(stored.read_bytes(), data))
    result = tried(lambda: ga.load_result(path))
    if result is not None:  # what was damaged does not matter: the archive has a sum of each part
        kept = ga.load_result(stored)
        assert result.problem.to_dict() == kept.problem.to_dict()
        for name, array in {**kept.atlas.to_arrays(), "qualities": kept.qualities, "accepted": kept.accepted}.items():
            part = getattr(result if name in ("qualities", "accepted") else result.atlas, name)
            assert part.tobytes() == array.tobytes()


ENTRIES = {
    "f": [0.0, -1.0, 0.5, NAN, INF, -INF, 1e-300, 1e12, 1e300],
    "b": [True, False],
    "i": [-9, -2, -1, 0, 1, 7, 8, 99],
    "u": [0, 1, 3, 200],
}


@given(header_too=st.booleans(), place=st.integers(0, 10**6), whole=st.booleans(), data=st.data())
@few(100)
def test_results_with_other_content(stored, tmp_path, capfd, header_too, place, whole, data):
    """A file that is whole, with a header or an array that is not what it should be."""
    with np.load(stored) as file:
        arrays = {name: file[name] for name in file.files}
    if header_too:
        header = json.loads(str(arrays["header"]))
        change_leaf(header, data)
        arrays["header"] = np.array(json.dumps(header))
    else:
        name = sorted(arrays)[place % len(arrays)]
        array = arrays[name]
        if whole or array.dtype.kind not in ENTRIES:
            other = [0.0, [1.0, 2.0], [[NAN]], "text", [True], []]
            arrays[name] = np.array(other[place // 100 % len(other)])
        else:
            entries = ENTRIES[array.dtype.kind]
            array.flat[place // 100 % array.size] = entries[place % len(entries)]
    path = tmp_path / "result.npz"
    np.savez(path, **arrays)
    result = tried(lambda: ga.load_result(path))
    if result is not None:
        report = tried(lambda: result.check())
        summary = tried(lambda: result.summary())
        if report:
            system = result.problem.system(result.dimension)
            assert max(np.abs(system.evaluate_residual(x)).max() for x in result.atlas.centers) < 1e-9
            assert (
                summary["quality"]["best"] == result.qualities[result.accepted].max(initial=-INF) or not summary["best"]
            )
            json.dumps(summary, allow_nan=False)


@given(chart=anything, max_steps=anything)
@few(100)
def test_result_methods(tripod_result, chart, max_steps):
    result = tripod_result
    grasp = tried(lambda: result.grasp(chart))
    if grasp is not None:
        np.testing.assert_array_equal(grasp.x, result.atlas.centers[chart])
        assert (grasp.chart, grasp.quality) == (chart, result.qualities[chart])
    climbs = [tried(lambda: ga.climb(result, chart, max_steps=1))]
    if not isinstance(max_steps, int) or max_steps < 3:
        climbs.append(tried(lambda: ga.climb(result, 0, max_steps=max_steps)))
    for climb in climbs:
        if climb is not None:
            assert climb.quality >= climb.qualities[0] == result.qualities[climb.chart]
            assert quality.evaluate(result.quality, ga.Grasps(result.problem, climb.x))[0] == pytest.approx(
                climb.quality
            )
            assert np.abs(result.atlas.system.evaluate_residual(climb.x)).max() < 1e-8


@given(value=anything)
@few(60)
def test_what_is_no_result(value):
    for use in (
        lambda: ga.climb(value, 0),
        lambda: ga.local_maxima(value),
        lambda: ga.export_html(value, "no.html"),
        lambda: ga.save_picture(value, "no.png"),
    ):
        assert tried(use) is None


# ---------------------------------------------------------------------------------------------------- qualities


@given(value=odd_numbers | no_numbers)
@few(80)
def test_quality_options(tripod, value):
    grasps = ga.Grasps(tripod, tripod.x1_array, tripod.system(6))
    for index in (quality.inverse_condition_number, quality.manipulability_volume, quality.smallest_semi_axis):
        result = tried(lambda i=index: i(grasps, value), TypeError)
        assert result is None or (result >= 0.0).all()
    margin = tried(lambda: quality.force_closure_margin(grasps, value), TypeError)
    assert margin is None or 0.0 <= margin[0] <= 1.0


@given(returned=anything, batched=st.booleans())
@few(100)
def test_indices_and_predicates_that_return_anything(tripod, returned, batched):
    def index(_):
        return returned

    index.batched = batched
    grasps = ga.Grasps(tripod, [tripod.x1_array] * 2, tripod.system(6))
    values = tried(lambda: quality.evaluate(index, grasps))
    if values is not None:
        np.testing.assert_array_equal(values, np.broadcast_to(np.asarray(returned, float), 2))
        assert np.isfinite(values).all()
    elif isinstance(returned, float) and not batched:
        assert not np.isfinite(returned)
    assert str(returned) in quality.INDICES or tried(lambda: quality.evaluate(returned, grasps), TypeError) is None
    flags = tried(lambda: requirements.screen([index], grasps))
    assert (flags is None) == (not isinstance(returned, bool) or batched)
    assert flags is None or flags[0].tolist() == [returned] * 2
    assert tried(lambda: requirements.screen([returned], grasps)) is None


@given(first=anything, second=anything)
@few(150)
def test_requirements(first, second):
    for make in (
        lambda: ga.ForceClosure(first, second),
        lambda: ga.CollisionFree(first, second),
        lambda: ga.JointMargin(first),
    ):
        made = tried(make)
        if made is not None:
            again = requirements.parse_requirement(str(made))
            assert type(again) is type(made)
            np.testing.assert_allclose(astuple(again), astuple(made), rtol=1e-5)
    if str(first) not in requirements.REQUIREMENTS:
        assert tried(lambda: requirements.parse_requirement(f"{first}:{second}")) is None
    read = tried(lambda: requirements.parse_requirement(f"force_closure:{first}:{second}"))
    assert read is None or (read.friction, read.margin) == (float(first), float(second or 0.0))


@given(X=anything | st.lists(st.lists(odd_numbers, min_size=22, max_size=22), max_size=2))
@few(100)
def test_grasps_of_anything(tripod, X):
    grasps = tried(lambda: ga.Grasps(tripod, X))
    if grasps is not None:
        for read in (
            lambda: grasps.semi_axes,
            lambda: quality.force_closure_margin(grasps),
            lambda: grasps.contact_points,
        ):
            values = tried(read)
            assert values is None or len(values) == len(grasps)


@given(angles=st.lists(st.floats(-3.0, 3.0), min_size=9, max_size=9), turn=st.floats(-3.0, 3.0), v=vectors)
@few(50)
def test_grasps_that_touch_nothing(tripod, angles, turn, v):
    """Any posture, any pose: rotations are rotations, and every push on the object is what the contacts push."""
    x = tripod.x1_array.copy()
    x[:9] = angles
    x[9:12] = np.clip(np.nan_to_num(v), -1.0, 1.0)
    x[12:16] = [0.0, np.sin(turn / 2.0), 0.0, np.cos(turn / 2.0)]
    one = ga.Grasps(tripod, x)[0]
    R = one.T_palm_object[:3, :3]
    np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(one.contact_normals, axis=1), 1.0, atol=1e-12)
    np.testing.assert_allclose(one.T_palm_object @ one.T_object_palm, np.eye(4), atol=1e-12)
    assert (np.diff(one.semi_axes) >= 0.0).all()
    assert one.semi_axes[0] >= 0.0
    forces = np.random.default_rng(0).normal(size=(3, 3))
    arms = one.contact_points - one.object_xyz
    wrench = np.r_[forces.sum(axis=0), np.cross(arms, forces).sum(axis=0)]
    np.testing.assert_allclose(one.G @ forces.ravel(), wrench, atol=1e-9)


@given(size=st.integers(-2, 2**40) | anything)
@few(60)
def test_picture_sizes(tripod_result, tmp_path, size):
    if not isinstance(size, int) or isinstance(size, bool) or size < 320 or size > 4000:
        assert tried(lambda: ga.save_picture(tripod_result, tmp_path / "p.png", width=size)) is None
        assert tried(lambda: ga.save_picture(tripod_result, tmp_path / "p.png", height=size)) is None


# ---------------------------------------------------------------------------------------------------- the command line


WORDS = [
    "list", "optimize", "view", "check-result", "schunk_can", "schunk_oil_bottle", "planar_hand", "nothing", "--json",
    "--help", "--version", "--dimension", "--radius", "--epsilon", "--quality", "--require", "--max-charts",
    "--max-seconds", "--output", "1", "2", "0", "-1", "nan", "inf", "1e-300", "1e300", "0.5", "", "force_closure",
    "force_closure:0", "joint_margin:1:2", "collision_free:nan", "smallest_semi_axis", "--html", "x.html", "\0",
    "/dev/null", "/proc/nothing/x",
]  # fmt: skip


@given(words=st.lists(st.sampled_from(WORDS), max_size=6), start=st.sampled_from([[], ["optimize", "planar_hand"]]))
@few(150)
def test_command_lines(tmp_path, monkeypatch, capfd, words, start):
    monkeypatch.chdir(tmp_path)
    limits = ["--max-charts", "4", "--max-seconds", "0.2"] if start else []
    try:
        status = main([*start, *words, *limits])
    except SystemExit as end:
        status = int(end.code or 0)
    out, err = capfd.readouterr()
    assert status in (0, 1, 2)
    assert "Traceback" not in err
    if status == 2:
        assert err.startswith("graspatlas: error: ")
        assert len(err.splitlines()) == 1
        assert out == ""
