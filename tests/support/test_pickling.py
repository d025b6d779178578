"""Problems, results and their parts go to other processes and come back, to the bit; what they print is short."""

from __future__ import annotations

import copy
import multiprocessing
import pickle
from concurrent.futures import ProcessPoolExecutor
from typing import Any

import numpy as np
import pytest
from helpers import PythonSphere, Written, tripod_problem

import graspatlas as ga
from graspatlas import _core, patches
from graspatlas.analysis.densify import densify
from graspatlas.atlas.verification import check_atlas
from graspatlas.problem.assembly import random_points
from graspatlas.quality import evaluate
from graspatlas.systems import Angles, AnySystem, Rotations, Sphere, Torus

COPIES = {"pickled": lambda thing: pickle.loads(pickle.dumps(thing)), "deep": copy.deepcopy, "shallow": copy.copy}
LONGEST = 200  # of what is printed


@pytest.fixture(params=COPIES.values(), ids=COPIES.keys())
def again(request: pytest.FixtureRequest) -> Any:
    return request.param


@pytest.fixture(scope="module")
def result() -> ga.Result:
    names = ["inverse_condition_number", "joint_centrality"]
    requirements = [ga.JointMargin(0.01), ga.ForceClosure(0.5, 1e-4)]
    return ga.optimize(
        ga.load_problem("schunk_can"), quality=names, require=requirements, refine=True, radius=0.25, max_charts=300
    )


def things(result: ga.Result) -> dict[str, Any]:
    """One of each public class that holds data."""
    problem, atlas = result.problem, result.atlas
    path = ga.shortest_path(result, 0, 5)
    climb = ga.climb(result, 3, max_steps=1)
    # A search that ends at once: its component is the result that it begins with.
    components = ga.Components((result,), (1,), 1, 1, 0, 1, ga.SearchStatus.COVERED, 0.1)
    listed = [
        problem, problem.hand, problem.object, problem.hand.mechanism, problem.motions, problem.contacts[0], atlas,
        result, result.best, ga.Grasps(problem, atlas.centers), result.refinement, result.check(), climb,
        *ga.peaks_of(result, [climb])[:1], densify(result, 0.2, share=0.02), path, components, atlas.system,
        ga.load_problem("allegro_cylinder_3"), ga.shortest_path(atlas, 0, 3), problem.x1,
    ]  # fmt: skip
    return {f"{type(thing).__name__} {i}": thing for i, thing in enumerate(listed)}


@pytest.fixture(scope="module")
def public(result: ga.Result) -> dict[str, Any]:
    return things(result)


def same(a: Any, b: Any) -> bool:
    """Whether two objects hold the same, numbers to the bit."""
    if type(a) is not type(b):
        return False
    if isinstance(a, np.ndarray):
        return a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes()
    if isinstance(a, AnySystem):
        return repr(a) == repr(b) and same(a.bound_normals, b.bound_normals)
    if isinstance(a, dict):
        return list(a) == list(b) and all(same(a[name], b[name]) for name in a)
    if isinstance(a, tuple | list):
        return len(a) == len(b) and all(map(same, a, b))
    if isinstance(a, float):
        return np.float64(a).tobytes() == np.float64(b).tobytes()
    if hasattr(a, "__dict__") and not callable(a):
        return same(pickled_state(a), pickled_state(b))
    return bool(a == b)


def pickled_state(thing: Any) -> dict[str, Any]:
    return thing.__getstate__() if hasattr(thing, "__getstate__") else vars(thing)


def test_everything_public_comes_back(public, again):
    for name, thing in public.items():
        assert same(again(thing), thing), name


def test_what_is_printed_is_one_short_line(public):
    for name, thing in public.items():
        text = repr(thing)
        assert "\n" not in text, name
        assert len(text) < (600 if isinstance(thing, ga.FirstGrasp) else LONGEST), name
    assert repr(public["Problem 0"]) == "<Problem 'schunk_can': hand 'schunk_sah', object 'can', 3 contacts>"
    assert repr(public["Atlas 6"]).startswith("<Atlas of 300 charts, k = 2, r = 0.25, epsilon = 0.5: cut short")


def test_a_name_with_line_breaks_is_printed_on_one_line():
    body = ga.Body("a\n\x1b[31mb", "<robot name='r'><link name='l'/></robot>")
    assert repr(body) == r"<Body 'a\n\x1b[31mb' of a URDF of 40 characters>"


def test_a_spline_prints_no_knots():
    points = [[(0.01 * i, 0.01 * j, 0.0) for j in range(40)] for i in range(40)]
    spline = patches.BSpline(points, u_knots=[0.0] * 4 + list(range(1, 37)) + [37.0] * 4)
    outline = patches.Revolution(heights=tuple(0.001 * i for i in range(200)), radii=(0.02,) * 200)
    for patch in (spline, patches.Curve(spline, [(0.1 * i, 0.5) for i in range(5, 300)]), outline):
        assert len(repr(patch)) < LONGEST


def test_a_result_that_came_back_works(result, again):
    other = again(result)
    assert other.best.x.tobytes() == result.best.x.tobytes()
    assert other.refined_best.quality == result.refined_best.quality
    assert other.check().passed
    assert other.values("min_weight").tobytes() == result.values("min_weight").tobytes()
    assert other.atlas.locate(result.atlas.centers[7]) == result.atlas.locate(result.atlas.centers[7])
    assert (other.meets(result.atlas.centers) == result.accepted).all()
    assert ga.climb(other, 3, max_steps=2).x.tobytes() == ga.climb(result, 3, max_steps=2).x.tobytes()


def test_in_a_spawned_process(result):
    """A problem goes there and a result comes back; a batch of grasps goes there and its values come back."""
    problem = result.problem
    grasps = ga.Grasps(problem, result.atlas.centers)
    options = {"quality": "grasp_isotropy", "require": (), "max_charts": 50}
    here = ga.optimize(problem, **options)
    with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as pool:
        there = pool.submit(ga.optimize, problem, **options).result()
        assert same(there.atlas.to_arrays(), here.atlas.to_arrays())
        assert same(there.qualities, here.qualities)
        assert same(pool.submit(evaluate, "manipulability_volume", grasps).result(), grasps.semi_axes.prod(axis=1))
        assert pool.submit(check_atlas, result.atlas).result().passed
        with pytest.raises(ga.GraspAtlasError, match="dimension must be"):
            pool.submit(ga.optimize, problem, dimension=99).result()


def test_what_was_only_computed_is_left_out(result):
    """A pickle is no larger for what was looked at before."""
    fresh = ga.load_problem("schunk_can")
    size = len(pickle.dumps(fresh))
    assert fresh.full_dimension > 0
    assert fresh.full_system.tangent_size > 0
    assert len(pickle.dumps(fresh)) == size
    before = len(pickle.dumps(result))
    assert result.atlas.volumes.sum() > 0.0
    assert result.worst.quality <= result.best.quality
    assert len(pickle.dumps(result)) == before


# Systems and patches, compiled


@pytest.mark.parametrize("system", [Sphere(4), Torus(2.0, 0.3), Angles(3), Rotations()], ids=lambda s: type(s).__name__)
def test_toy_systems(system, again):
    other = again(system)
    assert type(other) is type(system)
    x = np.linspace(0.4, 0.7, system.configuration_size)
    x /= np.linalg.norm(x)
    assert same(other.evaluate_jacobian(x), system.evaluate_jacobian(x))
    assert same(other.embed(x), system.embed(x))


@pytest.mark.parametrize("name", ga.bundled_problems())
def test_grasp_systems(name, again):
    problem = ga.load_problem(name)
    for system in (problem.full_system, problem.system(problem.defaults.get("dimension", problem.largest_dimension))):
        other = again(system)
        (start,) = random_points(problem.full_system, problem.reference_array, problem.object_joint_model, 1)
        x = system.integrate(start, np.full(system.tangent_size, 0.1))
        assert other.bound_names == system.bound_names
        assert same(dict(other.grasp_arrays(x[None])), dict(system.grasp_arrays(x[None])))
        for of in ("evaluate_residual", "evaluate_jacobian", "slack", "embed"):
            assert same(getattr(other, of)(x), getattr(system, of)(x)), of


PLANE = patches.Plane((0.0, 0.0, 0.1), (0.0, 1.0, 0.2), u_interval=(-0.1, 0.1), v_interval=(-0.2, 0.3))
PATCHES = [
    PLANE,
    patches.Point((0.1, 0.2, 0.3), (0.0, 0.6, 0.8)),
    patches.Cylinder(radius=0.03, v_interval=(-0.1, 0.1), flipped=True),
    patches.Cone(heights=(0.0, 0.1), radii=(0.02, 0.05)),
    patches.Revolution(heights=(0.0, 0.05, 0.1), radii=(0.02, 0.05, 0.03)),
    patches.Sphere(radius=0.1),
    patches.Torus(ring_radius=0.1, tube_radius=0.02),
    patches.Ellipsoid(semi_axes=(0.1, 0.2, 0.3)),
    patches.Bezier([[(0.0, 0.0, 0.0), (0.0, 0.1, 0.0)], [(0.1, 0.0, 0.0), (0.1, 0.1, 0.03)]]),
    patches.BSpline([[(0.1 * i, 0.1 * j, 0.01 * i * j) for j in range(4)] for i in range(5)]),
    patches.Curve(PLANE, [(0.0, 0.0), (0.05, 0.1), (0.08, 0.25)]),
]


@pytest.mark.parametrize("patch", PATCHES, ids=lambda p: p.kind)
def test_patches(patch, again):
    assert again(patch) == patch
    core = patch.core()
    other = again(core)
    assert type(other) is type(core)
    assert same(other.evaluate(0.3, 0.4), core.evaluate(0.3, 0.4))


# Systems in Python


class Shifted(PythonSphere):
    """A sphere with an attribute of its own, and another way to be made."""

    def __init__(self, shift: float) -> None:
        super().__init__(3, lower=[-np.inf, -0.5, -2.0], upper=[0.7, np.inf, 1.5])
        self.shift = np.array([shift, 0.0, 0.0])

    def residual(self, x: Any) -> Any:
        return super().residual(x - self.shift)

    def jacobian(self, x: Any) -> Any:
        return super().jacobian(x - self.shift)


class Stated(Shifted):
    """One that says itself what is kept of it."""

    def __getstate__(self) -> dict[str, float]:
        return {"shift": float(self.shift[0])}

    def __setstate__(self, state: dict[str, float]) -> None:
        self.shift = np.array([state["shift"], 0.0, 0.0])


class Named(Sphere):
    """A compiled system with an attribute of its own."""


@pytest.mark.parametrize("kind", [Shifted, Stated])
def test_systems_in_python(kind, again):
    system = kind(0.25)
    other = again(system)
    assert type(other) is kind
    x = np.array([0.1, 0.2, -1.0])
    assert same(other.shift, system.shift)
    assert same(other.slack(x), system.slack(x))
    assert same(other.evaluate_jacobian(x), system.evaluate_jacobian(x))
    atlases = [ga.build_atlas(s, [0.25, 0.0, -1.0], radius=0.3, epsilon=0.2).to_arrays() for s in (system, other)]
    assert same(*atlases)


def test_a_subclass_of_a_compiled_system_keeps_its_attributes(again):
    system = Named(3)
    system.name = "unit"
    assert again(system).name == "unit"
    assert again(system).tangent_size == 3


# Callables


def tilt(grasp: ga.Grasp) -> float:
    """An index of one's own that a module has by its name."""
    return float(grasp.T_palm_object[2, 2])


def high(grasp: ga.Grasp) -> bool:
    return bool(grasp.object_xyz[2] > -1.0)


def test_functions_of_a_module_travel(again):
    made = ga.optimize(
        tripod_problem(), dimension=6, radius=0.3, epsilon=0.5, quality=tilt, require=[high], max_charts=10
    )
    other = again(made)
    assert other.quality is tilt
    assert other.requirements == (high,)
    assert other.meets(made.atlas.centers).all()


def test_lambdas_are_left_to_the_pickler():
    """Pickle refuses them and names them; copies and cloudpickle, which Dask falls back on, keep them."""
    cloudpickle = pytest.importorskip("cloudpickle")
    made = ga.optimize(
        tripod_problem(),
        dimension=6,
        radius=0.3,
        epsilon=0.5,
        quality=lambda grasp: grasp.T_palm_object[2, 2],
        max_charts=10,
    )
    with pytest.raises((pickle.PicklingError, AttributeError), match="lambda"):
        pickle.dumps(made)
    assert copy.deepcopy(made).values(made.quality).tobytes() == made.qualities.tobytes()
    other = pickle.loads(cloudpickle.dumps(made))
    assert other.values(other.quality).tobytes() == made.qualities.tobytes()
    assert evaluate(other.quality, ga.Grasps(other.problem, made.atlas.centers)).tobytes() == made.qualities.tobytes()
    system = Written(3, 1, lambda x: [x @ x - 1.0], lambda x: [2.0 * x])
    assert copy.deepcopy(system).evaluate_residual([1.0, 0.0, 0.0]) == 0.0
    assert pickle.loads(cloudpickle.dumps(system)).evaluate_residual([1.0, 0.0, 0.0]) == 0.0


def test_errors_travel():
    error = pickle.loads(pickle.dumps(ga.GraspAtlasError("why")))
    assert type(error) is ga.GraspAtlasError
    assert str(error) == "why"
    assert isinstance(pickle.loads(pickle.dumps(ga.Status.COMPLETE)), ga.Status)
    assert issubclass(_core.GraspAtlasError, ValueError)
