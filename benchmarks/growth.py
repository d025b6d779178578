"""Time and memory of an atlas as its charts shrink, its dimension grows, and threads share the work."""

from __future__ import annotations

import multiprocessing
import os
import resource
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

import graspatlas as ga
from graspatlas.support.machine import available_threads

PAGE = os.sysconf("SC_PAGE_SIZE")


@dataclass(frozen=True)
class Row:
    """One atlas: its charts, wall and processor time, what memory came to its process meanwhile, and how it ended."""

    name: str
    n_charts: int
    seconds: float
    processor_seconds: float
    bytes_peak: int
    status: str


def resident() -> int:
    """Memory of this process [bytes]."""
    with open("/proc/self/statm", encoding="ascii") as file:
        return int(file.read().split()[1]) * PAGE


def _measure(build: Callable[[], ga.Atlas], results: Any) -> None:
    before, start = resident(), time.process_time()
    atlas = build()
    used = time.process_time() - start
    peak = 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    results.put((atlas.n_charts, atlas.seconds, used, max(peak - before, 0), str(atlas.status)))


def measured(name: str, build: Callable[[], ga.Atlas]) -> Row:
    """Build an atlas in a process of its own, so that its peak of memory is its own too."""
    context = multiprocessing.get_context("fork")
    results = context.SimpleQueue()
    child = context.Process(target=_measure, args=(build, results))
    child.start()
    row = results.get()
    child.join()
    return Row(name, *row)


def problem_atlas(name: str, dimension: int, radius: float, **options: Any) -> Callable[[], ga.Atlas]:
    """Work that builds the atlas of a bundled problem, which is loaded at once."""
    problem = ga.load_problem(name)
    system = problem.system(dimension)
    return lambda: ga.build_atlas(system, problem.x1_array, radius=radius, epsilon=0.5, progress=False, **options)


def sphere_atlas(dimension: int, radius: float) -> Callable[[], ga.Atlas]:
    """Work that builds the atlas of a sphere of this dimension."""
    system, x0 = ga.systems.Sphere(dimension + 1), np.eye(dimension + 1)[0]
    return lambda: ga.build_atlas(system, x0, radius=radius, epsilon=0.3, progress=False)


def by_radius(name: str, dimension: int, radius: float) -> list[Row]:
    """Charts of a problem with a radius that is halved four times."""
    radii = [radius / 2**i for i in range(5)]
    return [measured(f"r = {r:g}", problem_atlas(name, dimension, r)) for r in radii]


def by_dimension(radius: float) -> list[Row]:
    """Spheres of one to six dimensions; with five and six the charts are larger."""
    radii = {**dict.fromkeys(range(1, 5), radius), 5: 0.7, 6: 0.8}
    return [measured(f"k = {k}, r = {r:g}", sphere_atlas(k, r)) for k, r in radii.items()]


def by_threads(name: str, dimension: int, radius: float) -> list[Row]:
    """The same atlas with more and more threads."""
    counts = [n for n in (1, 2, 4, 8, 16) if n <= available_threads()]
    return [measured(f"{n} threads", problem_atlas(name, dimension, radius, threads=n)) for n in counts]
