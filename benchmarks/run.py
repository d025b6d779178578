"""Time the engine and print medians, on one thread unless a row says otherwise: ``make bench``.

Figures depend on the machine; compare them as ratios within one run. Every row also prints what it found, so that a
faster but wrong engine is seen at once.
"""

from __future__ import annotations

import platform
import statistics
import time
from collections.abc import Callable
from typing import Any

import numpy as np

import graspatlas as ga
from graspatlas import _core
from graspatlas.collision.checker import CollisionChecker

REPEATS = 7


def median_seconds(work: Callable[[], Any]) -> tuple[float, Any]:
    """Median time of a call over several, after one that is not counted; and what it returned."""
    result = work()
    times = []
    for _ in range(REPEATS):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return statistics.median(times), result


def atlas_row(name: str, system: ga.systems.AnySystem, x0: Any, radius: float, epsilon: float) -> None:
    """Time one atlas and print a row."""
    seconds, atlas = median_seconds(
        lambda: ga.build_atlas(system, x0, radius=radius, epsilon=epsilon, threads=1, progress=False)
    )
    rate = atlas.n_charts / seconds
    audit = 100 * atlas.audit.seconds / atlas.seconds
    print(
        f"{name:32} {atlas.n_charts:7d} charts {1e3 * seconds:9.1f} ms {rate:9.0f} charts/s, "
        f"{audit:.0f} % of it the audit   {atlas.status}"
    )


def grasp_rows(name: str, dimension: int, radius: float) -> None:
    """Time the atlas of a bundled problem and the indices of its charts."""
    problem = ga.load_problem(name)
    system = problem.system(dimension)
    atlas_row(f"{name} k={dimension} r={radius:g}", system, problem.x1_array, radius, 0.5)
    atlas = ga.build_atlas(system, problem.x1_array, radius=radius, epsilon=0.5, progress=False)
    for index in (
        "manipulability_volume",
        "force_closure_margin",
        "ferrari_canny_epsilon",
        "ferrari_canny_volume",
        "min_weight",
    ):
        index_row(index, problem, atlas)
    force_rows(problem, atlas)
    if dimension == 2:
        collision_row(problem, atlas)


def index_row(index: str, problem: ga.Problem, atlas: ga.Atlas) -> None:
    """Time a quality index on all charts of an atlas and print a row."""
    seconds, values = median_seconds(
        lambda: ga.quality.evaluate(index, ga.Grasps(problem, atlas.centers, atlas.system))
    )
    each, best = 1e6 * seconds / len(values), values.max()
    print(f"{'  ' + index:32} {len(values):7d} grasps {1e3 * seconds:9.1f} ms {each:9.2f} us each   best {best:.6g}")


def force_rows(problem: ga.Problem, atlas: ga.Atlas) -> None:
    """Time contact forces and holding forces of the charts with force closure, soft fingers, and print rows."""
    grasps = ga.Grasps(problem, atlas.centers, atlas.system)
    closed = grasps.x[ga.quality.force_closure_margin(grasps, 0.8, 0.003) > 0.0][:250]  # so few are on one thread
    grasps = ga.Grasps(problem, closed, atlas.system)
    grasps.contact_points  # noqa: B018  (computed once)
    for name, work in (
        ("contact forces", lambda: grasps.contact_forces(friction=0.8, torsional=0.003).margin),
        ("holding_force, to 1 %", lambda: ga.quality.holding_force(grasps, 0.8, None, 0.003, gap=0.01)),
        ("holding_force", lambda: ga.quality.holding_force(grasps, 0.8, None, 0.003)),
        ("holding_force with efforts", lambda: ga.quality.holding_force(grasps, 0.8, None, 0.003, efforts=0.5)),
    ):
        seconds, values = median_seconds(work)
        each, best = 1e6 * seconds / len(values), values.max()
        print(f"{'  ' + name:32} {len(values):7d} closed {1e3 * seconds:9.1f} ms {each:9.2f} us each   best {best:.6g}")


def collision_row(problem: ga.Problem, atlas: ga.Atlas) -> None:
    """Time the collision check of all charts of an atlas, on all cores, and print a row."""
    checker = CollisionChecker(problem)
    seconds, free = median_seconds(lambda: checker.free(atlas.centers))
    each = 1e6 * seconds / len(free)
    print(f"{'  collisions':32} {len(free):7d} grasps {1e3 * seconds:9.1f} ms {each:9.2f} us each   {free.sum()} free")


def thread_row(name: str, dimension: int, radius: float, threads: int) -> None:
    """Time one atlas on one thread and on several, and print the ratio and the memory of a chart."""
    problem = ga.load_problem(name)
    system = problem.system(dimension)
    times = {}
    for count in (1, threads):
        builders = []
        for _ in range(REPEATS):
            builder = _core.AtlasBuilder(system, problem.x1_array, radius, 0.5, count)
            start = time.perf_counter()
            builder.expand(2**62, float("inf"))
            builders.append(time.perf_counter() - start)
        times[count] = statistics.median(builders)
    print(
        f"{f'{name} k={dimension} r={radius:g}':32} {builder.n_charts:7d} charts: {threads} threads "
        f"{times[1] / times[threads]:.2f} times as fast as one; {builder.n_bytes / builder.n_charts:.0f} bytes a chart"
    )


def projection_row() -> None:
    """Time single projections of the can onto its manifold, from a chart's radius away."""
    problem = ga.load_problem("schunk_can")
    atlas = ga.build_atlas(problem.system(2), problem.x1_array, radius=0.17, epsilon=0.5, progress=False)
    directions = np.random.default_rng(0).normal(size=(atlas.n_charts, 2))
    steps = 0.17 * directions / np.linalg.norm(directions, axis=1, keepdims=True)
    seconds, _ = median_seconds(lambda: [atlas.point(i, u) for i, u in enumerate(steps)])
    print(
        f"{'can: one projection, from Python':32} {atlas.n_charts:7d} points {1e3 * seconds:9.1f} ms "
        f"{1e6 * seconds / atlas.n_charts:9.2f} us each"
    )


def main() -> None:
    """Print all rows."""
    print(
        f"graspatlas {ga.__version__}, Python {platform.python_version()}, {platform.machine()}; "
        f"medians of {REPEATS} runs"
    )
    atlas_row("sphere r=0.1", ga.systems.Sphere(3), [1.0, 0.0, 0.0], 0.1, 0.1)
    atlas_row("torus r=0.1", ga.systems.Torus(0.8, 0.5), [1.3, 0.0, 0.0], 0.1, 0.1)
    atlas_row("3-sphere r=0.2", ga.systems.Sphere(4), [1.0, 0.0, 0.0, 0.0], 0.2, 0.1)
    atlas_row("4-sphere r=0.4", ga.systems.Sphere(5), [1.0, 0.0, 0.0, 0.0, 0.0], 0.4, 0.3)
    grasp_rows("schunk_can", 2, 0.17)
    grasp_rows("schunk_oil_bottle", 2, 0.04)
    grasp_rows("schunk_oil_bottle", 3, 0.1)
    projection_row()
    for name, dimension, radius in (("schunk_can", 2, 0.05), ("schunk_oil_bottle", 3, 0.0575)):
        thread_row(name, dimension, radius, 2)


if __name__ == "__main__":
    main()
