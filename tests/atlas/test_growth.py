"""The same atlas on any number of threads, and growth that ends at limits."""

from __future__ import annotations

import os
import subprocess
import sys

import numpy as np
import pytest
from helpers import PythonSphere, Written, assert_same_atlas

import graspatlas as ga
from graspatlas import _core
from graspatlas.atlas.growth import Growth, outlook
from graspatlas.atlas.verification import check_atlas
from graspatlas.support.machine import available_bytes, available_threads
from graspatlas.systems import Angles, Rotations, Sphere, Torus

SPHERE = {"radius": 0.1, "epsilon": 0.1}


def grasp_case(name, dimension, radius):
    problem = ga.load_problem(name)
    return problem.system(dimension), problem.x1_array, {"radius": radius, "epsilon": 0.5}


CASES = {
    "sphere": lambda: (Sphere(3), [0.0, 0.0, 1.0], {"radius": 0.03, "epsilon": 0.1}),
    "3-sphere": lambda: (Sphere(4), [0.0, 0.0, 0.0, 1.0], {"radius": 0.25, "epsilon": 0.1}),
    "torus": lambda: (Torus(0.8, 0.5), [1.3, 0.0, 0.0], SPHERE),
    "two angles": lambda: (Angles(2), [3.0, -3.0], {"radius": 0.2, "epsilon": 0.5}),
    "rotations": lambda: (Rotations(), [0.0, 0.0, 0.0, 1.0], {"radius": 0.4, "epsilon": 0.5}),
    "can": lambda: grasp_case("schunk_can", 2, 0.17),
    "bottle": lambda: grasp_case("schunk_oil_bottle", 2, 0.04),
    "bottle, k = 3": lambda: grasp_case("schunk_oil_bottle", 3, 0.2),
    "planar": lambda: grasp_case("planar_hand", 2, 0.1),
}


@pytest.mark.parametrize("name", CASES)
def test_same_atlas_on_any_number_of_threads(name):
    system, x0, options = CASES[name]()
    one = ga.build_atlas(system, x0, threads=1, **options)
    assert one.complete
    assert one.n_charts > 100
    for threads in (2, 3, 7):
        assert_same_atlas(one, ga.build_atlas(system, x0, threads=threads, **options))


@pytest.mark.parametrize("limit", [1, 2, 63, 64, 65, 100, 500, 1000])
def test_limit_of_charts_is_met_exactly(limit):
    one, many = (ga.build_atlas(Sphere(3), [0, 0, 1], max_charts=limit, threads=n, **SPHERE) for n in (1, 5))
    assert one.n_charts == limit
    assert one.status is many.status is ga.Status.CHART_LIMIT
    assert_same_atlas(one, many)


def test_slices_of_work_do_not_matter():
    """Charts and time may run out anywhere: the work goes on as if it had never stopped."""
    x0 = np.array([0.0, 0.0, 0.0, 1.0])
    whole, sliced, counted = (_core.AtlasBuilder(Sphere(4), x0, 0.3, 0.1, n) for n in (1, 3, 2))
    whole.expand(10**9, 1e9)
    slices = 0
    while not sliced.complete:
        sliced.expand(10**9, 1e-4)
        slices += 1
    while not counted.complete:
        counted.expand(counted.n_charts + 7, 1e9)
    assert slices > 3
    for name, array in whole.arrays().items():
        assert array.tobytes() == sliced.arrays()[name].tobytes(), name
        assert array.tobytes() == counted.arrays()[name].tobytes(), name


def test_a_chart_with_more_neighbours_than_one_task_may_make():
    """Charts round one in five dimensions: more than 64; the chart comes again in the next generation."""
    one, two = (
        ga.build_atlas(Angles(5), np.zeros(5), radius=1.0, epsilon=0.5, threads=n, max_charts=300) for n in (1, 2)
    )
    around_first = (one.neighbour_pairs[:, 0] == 0).sum()
    assert around_first > 64
    assert_same_atlas(one, two)


def test_a_system_in_python_has_one_thread():
    builder = _core.AtlasBuilder(PythonSphere(3), np.array([0.0, 0.0, 1.0]), 0.1, 0.1, 4)
    assert builder.n_threads == 1
    assert _core.AtlasBuilder(Sphere(3), np.array([0.0, 0.0, 1.0]), 0.1, 0.1, 4).n_threads == 4
    theirs = ga.build_atlas(PythonSphere(3), [0, 0, 1], threads=4, **SPHERE)
    assert_same_atlas(theirs, ga.build_atlas(Sphere(3), [0, 0, 1], threads=4, **SPHERE))


@pytest.mark.parametrize("error", [KeyboardInterrupt, ZeroDivisionError])
def test_an_error_in_a_python_system_leaves_a_usable_atlas(error):
    calls = [0]

    def residual(x):
        calls[0] += 1
        if calls[0] == 500:
            raise error
        return [x @ x - 1.0]

    system = Written(3, 1, residual, lambda x: [2.0 * x])
    builder = _core.AtlasBuilder(system, np.array([0.0, 0.0, 1.0]), 0.1, 0.1, 2)
    with pytest.raises(error):
        builder.expand(10**9, 1e9)
    assert 50 < builder.n_charts < 1000
    assert len(builder.arrays()["centers"]) == builder.n_charts
    builder.expand(10**9, 1e9)
    assert builder.complete
    assert builder.n_charts == pytest.approx(1170, rel=0.02)


def test_limit_of_memory_cuts_the_atlas_short():
    atlas = ga.build_atlas(Sphere(4), [0, 0, 0, 1], radius=0.02, epsilon=0.1, max_bytes=2e7, threads=2)
    assert atlas.status is ga.Status.MEMORY_LIMIT
    assert 1000 < atlas.n_charts < 200_000
    assert "limit of memory" in str(atlas.status)
    assert check_atlas(ga.build_atlas(Sphere(4), [0, 0, 0, 1], radius=0.05, epsilon=0.1, max_bytes=1e6)).passed


def test_bytes_are_counted():
    """What the builder says it holds, against the arrays that it makes, which are about as large."""
    builder = _core.AtlasBuilder(Sphere(4), np.array([0.0, 0.0, 0.0, 1.0]), 0.1, 0.1, 2)
    builder.expand(10**9, 1e9)
    arrays = sum(array.nbytes for array in builder.arrays().values())
    assert 500 < builder.n_bytes / builder.n_charts < 3000
    assert arrays < builder.n_bytes < 3 * arrays


@pytest.mark.parametrize(("k", "radius", "threads"), [(2, 0.05, 1), (2, 0.05, 2), (3, 0.1, 2), (4, 0.45, 2)])
def test_arrays_that_are_taken_are_those_that_are_copied(k: int, radius: float, threads: int) -> None:
    builder = _core.AtlasBuilder(Sphere(k + 1), np.eye(k + 1)[0], radius, 0.3, threads)
    builder.expand(10**9, 1e9)
    copied, taken = builder.arrays(), builder.take_arrays()
    assert len(copied["centers"]) == builder.n_charts > 500
    assert list(copied) == list(taken)
    for name, array in copied.items():
        np.testing.assert_array_equal(array, taken[name], err_msg=name)


#: What a process of its own says of its memory [bytes], by the names of /proc: getrusage would count its parent's, too.
MEMORY = """
import numpy as np, graspatlas as ga
from graspatlas import _core

def memory(name):
    with open("/proc/self/status") as lines:
        return next(1024 * int(line.split()[1]) for line in lines if line.startswith(name + ":"))
"""
reads_proc = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="reads /proc")


def printed_by(program: str) -> list[float]:
    """The numbers that a program prints which looks at its own memory, in pages of the usual size."""
    environment = {**os.environ, "NUMPY_MADVISE_HUGEPAGE": "0"}
    done = subprocess.run(
        [sys.executable, "-c", MEMORY + program], capture_output=True, text=True, check=True, env=environment
    )
    return [float(word) for word in done.stdout.split()]


@reads_proc
def test_an_atlas_and_its_arrays_are_not_held_at_the_same_time() -> None:
    """The peak of memory is hardly more than what was held before arrays were made."""
    (share,) = printed_by(
        "builder = _core.AtlasBuilder(ga.systems.Sphere(4), np.eye(4)[0], 0.04, 0.3, 1)\n"
        "builder.expand(40_000, 1e9)\n"
        "before = memory('VmHWM')\n"
        "arrays = builder.take_arrays()\n"
        "print((memory('VmHWM') - before) / sum(array.nbytes for array in arrays.values()))\n"
    )
    assert share < 0.3


#: By k: a bundled problem, the radius, and what a chart may take at the peak [bytes].
PEAKS = {
    2: ("schunk_can", 0.06, 1300),
    3: ("schunk_oil_bottle", 0.1, 2600),
    4: ("schunk_oil_bottle", 0.4, 6000),
}


@reads_proc
@pytest.mark.parametrize("k", PEAKS)
def test_peak_of_memory_for_each_chart(k: int) -> None:
    """All that comes to the process while `build_atlas` makes an atlas of some 40 MB."""
    name, radius, most = PEAKS[k]
    charts, each = printed_by(
        f"problem = ga.load_problem('{name}')\n"
        f"system, x1, sizes = problem.system({k}), problem.x1_array, dict(radius={radius}, epsilon=0.5)\n"
        "ga.build_atlas(system, x1, **sizes, threads=1, max_charts=100)\n"
        "before = memory('VmRSS')\n"
        "atlas = ga.build_atlas(system, x1, **sizes, threads=1)\n"
        "print(atlas.n_charts, (memory('VmHWM') - before) / atlas.n_charts)\n"
    )
    assert charts > 5000
    assert 400 < each < most


def test_what_the_machine_has():
    assert available_threads() >= 1
    assert available_bytes() > 1e8


@pytest.mark.parametrize("name", ["threads", "max_bytes"])
@pytest.mark.parametrize("value", [0, -1, float("nan"), "two", True])
def test_wrong_threads_and_memory_are_refused(name, value):
    with pytest.raises(ga.GraspAtlasError, match=name):
        ga.build_atlas(Sphere(3), [0, 0, 1], **{name: value}, **SPHERE)


@pytest.mark.parametrize(
    ("name", "radius"),
    [("schunk_can", 0.06), ("schunk_oil_bottle", 0.015), ("sphere", 0.02)],
    ids=["can", "bottle", "sphere"],
)
def test_expected_size_is_about_right(name, radius):
    if name == "sphere":
        system, x0, options = Sphere(3), [0.0, 0.0, 1.0], {"radius": radius, "epsilon": 0.1}
    else:
        system, x0, options = grasp_case(name, 2, radius)
    builder = _core.AtlasBuilder(system, np.asarray(x0), options["radius"], options["epsilon"], 2)
    growth = Growth(builder, system, np.asarray(x0), options["radius"], options["epsilon"])
    builder.expand(2000, 10.0)
    early = growth.expected_size(10.0)
    builder.expand(10**9, 1e9)
    assert builder.complete
    assert early == pytest.approx(builder.n_charts, rel=0.2)


def test_expected_size_of_a_manifold_too_small_for_coarse_charts():
    builder = _core.AtlasBuilder(Angles(2), np.zeros(2), 1.0, 0.5, 1)
    growth = Growth(builder, Angles(2), np.zeros(2), 1.0, 0.5)
    builder.expand(3, 1.0)
    assert growth.expected_size(1.0) is None
    assert outlook(builder, None, 1.0) == f"{builder.n_open} open"
    assert outlook(builder, 95_123, 1.0).endswith(" open; about 95,000 charts in all, 31707 s left")


def test_an_atlas_says_how_many_projections_it_took() -> None:
    """One for each chart of a sphere, where every step succeeds, and of charts that are too large more."""
    fine = ga.build_atlas(Sphere(3), [0, 0, 1], radius=0.1, epsilon=0.1)
    assert fine.n_projections == fine.n_charts
    coarse = ga.build_atlas(Sphere(3), [0, 0, 1], radius=0.8, epsilon=0.1)
    assert coarse.n_projections > 2 * coarse.n_charts


def test_steps_that_would_break_a_bound_are_foreseen() -> None:
    """A cap of the 4-sphere in large charts, at whose rim steps of the full radius end outside."""
    cap = PythonSphere(5, lower=[-np.inf] * 4 + [0.7])
    atlas = ga.build_atlas(cap, [0, 0, 0, 0, 1], radius=0.5, epsilon=0.3)
    assert atlas.status == "complete"
    assert atlas.n_charts < atlas.n_projections < 2.5 * atlas.n_charts
    assert atlas.centers[:, 4].min() < 0.72


def test_a_chart_takes_two_jacobians() -> None:
    """One above its centre, with which steps go down as far as they can, and one there; the audit asks for some."""

    class Counted(PythonSphere):
        jacobians = 0

        def jacobian(self, x: np.ndarray) -> np.ndarray:
            self.jacobians += 1
            return super().jacobian(x)

    system = Counted(3)
    atlas = ga.build_atlas(system, [0, 0, 1], radius=0.1, epsilon=0.1)
    assert np.abs(np.linalg.norm(atlas.centers, axis=1) - 1.0).max() < 1e-12
    assert 2 * atlas.n_charts - 2 <= system.jacobians < 3 * atlas.n_charts
