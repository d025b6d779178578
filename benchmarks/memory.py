"""Where the memory of an atlas in the making goes, in bytes a chart: ``python benchmarks/memory.py``.

Each atlas grows on one thread in a process of its own. The builder counts what it holds itself; what came to the
process at the peak of growth is more by what the heap needs, and the peak of all by what arrays take before the builder
has given as much back.
"""

from __future__ import annotations

import multiprocessing
import resource
from typing import Any

import numpy as np
from growth import resident

import graspatlas as ga
from graspatlas import _core
from graspatlas.atlas.growth import AUDIT_POINTS, AUDIT_SHARE

#: By name: the problem, or the sphere's dimension; k; radius; epsilon.
CASES: dict[str, tuple[str | None, int, float, float]] = {
    "sphere": (None, 2, 0.008, 0.1),
    "3-sphere": (None, 3, 0.06, 0.1),
    "can": ("schunk_can", 2, 0.026, 0.5),
    "bottle, k = 3": ("schunk_oil_bottle", 3, 0.055, 0.5),
    "bottle, k = 4": ("schunk_oil_bottle", 4, 0.4, 0.5),
    "bottle, k = 5": ("schunk_oil_bottle", 5, 0.8, 0.5),
    "bottle, k = 6": ("schunk_oil_bottle", 6, 1.0, 0.5),
}


def system_of(name: str | None, k: int) -> tuple[ga.systems.AnySystem, Any]:
    """A system and its first point."""
    if name is None:
        return ga.systems.Sphere(k + 1), np.eye(k + 1)[0]
    problem = ga.load_problem(name)
    return problem.system(k), problem.x1_array


def peak() -> int:
    """Largest memory of this process so far [bytes]."""
    return 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def grow(arguments: tuple[Any, ...], results: Any) -> None:
    """Grow an atlas and take its arrays; counts what each step held at most."""
    _core.AtlasBuilder(*arguments).expand(20, 1.0)  # what is made once in a process
    before = resident()
    builder = _core.AtlasBuilder(*arguments)
    builder.expand(10**9, 60.0)
    grown = peak() - before
    builder.audit(max(AUDIT_POINTS, round(AUDIT_SHARE * builder.n_charts)), 60.0)
    held = builder.n_bytes
    arrays = builder.take_arrays()
    sizes = (held, grown, peak() - before, sum(array.nbytes for array in arrays.values()))
    results.put((builder.n_charts, *(round(size / builder.n_charts) for size in sizes)))


def main() -> None:
    """Print a row for each case."""
    print("| case | charts | builder | peak of growth | peak | arrays |\n" + "| --- " * 6 + "|")
    context = multiprocessing.get_context("fork")
    for title, (name, k, radius, epsilon) in CASES.items():
        results = context.SimpleQueue()
        arguments = (*system_of(name, k), radius, epsilon, 1)
        child = context.Process(target=grow, args=(arguments, results))
        child.start()
        print(f"| {title} | {' | '.join(str(number) for number in results.get())} |", flush=True)
        child.join()


if __name__ == "__main__":
    main()
