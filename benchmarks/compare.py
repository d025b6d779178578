"""Hold graspatlas against what users would take instead, and see how its cost grows: ``make compare``.

All ratios are of processor times measured in this run, on this machine: what else it does counts less. The tables are
printed, and written to RESULTS.md beside this file. ``compare.py afford`` makes that section of it anew, and leaves the
others; so with the names of other sections.
"""

from __future__ import annotations

import os
import platform
import statistics
import sys
import time
from collections.abc import Callable, Iterator
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np
from afford import PATIENCE, afford_table, measure, write_page
from growth import Row, by_dimension, by_radius, by_threads
from numpy_atlas import NumpyAtlas

import graspatlas as ga
from graspatlas.reproduce.box_starts import multistart

RESULTS = Path(__file__).with_name("RESULTS.md")
REPEATS = 5
#: Seeds of the multi-start runs, and the time that each may take [s].
SEEDS = (0, 1, 2)
GIVE_UP = 25.0
RADIUS, EPSILON = 0.1, 0.1


class Surface(ga.System):
    """One equation in R^3, of functions that OMPL gets too."""

    def __init__(self, residual: Callable[[Any], Any], jacobian: Callable[[Any], Any]) -> None:
        super().__init__(n_variables=3, n_equations=1)
        self.written = (residual, jacobian)

    def residual(self, x: Any) -> Any:
        """R(x) [1]."""
        return np.array([self.written[0](x)])

    def jacobian(self, x: Any) -> Any:
        """J(x) [1, 3]."""
        return self.written[1](x)[None]


def torus(x: Any) -> float:
    """The torus of radii 0.8 and 0.5."""
    return (np.hypot(x[0], x[1]) - 0.8) ** 2 + x[2] * x[2] - 0.25


def torus_slope(x: Any) -> Any:
    """Its derivative."""
    factor = 2.0 * (1.0 - 0.8 / np.hypot(x[0], x[1]))
    return np.array([factor * x[0], factor * x[1], 2.0 * x[2]])


SURFACES = {
    "sphere": (ga.systems.Sphere(3), (1.0, 0.0, 0.0), lambda x: x @ x - 1.0, lambda x: 2.0 * x),
    "torus": (ga.systems.Torus(0.8, 0.5), (1.3, 0.0, 0.0), torus, torus_slope),
}


def median(work: Callable[[], Any], repeats: int = REPEATS) -> tuple[float, Any]:
    """Median processor time of a call, its threads added up, and what it returned."""
    times = []
    for _ in range(repeats):
        start = time.process_time()
        out = work()
        times.append(time.process_time() - start)
    return statistics.median(times), out


def table(head: str, rows: list[str]) -> list[str]:
    """A table in Markdown."""
    columns = head.count("|") + 1
    return [f"| {head} |", "|" + " --- |" * columns, *(f"| {row} |" for row in rows), ""]


def against_ompl() -> Iterator[str]:
    """Sphere and torus with OMPL's AtlasStateSpace, the equations in Python for both."""
    yield "## OMPL's AtlasStateSpace"
    yield ""
    try:
        from ompl_atlas import cover
    except ImportError as error:
        yield f"Not measured: the wheel `ompl` cannot be imported ({error})."
        yield ""
        return
    yield (
        f"Charts of radius {RADIUS}, epsilon {EPSILON}, the same equation in Python for both. OMPL makes charts where "
        "it samples: it is sampled until it says that no chart is on the frontier. Its charts are farther apart, so "
        "there are fewer; the last column divides that out."
    )
    yield ""
    rows = []
    for name, (compiled, x0, residual, slope) in SURFACES.items():
        options = {"radius": RADIUS, "epsilon": EPSILON, "progress": False}
        core_seconds, _ = median(lambda c=compiled, x=x0, o=options: ga.build_atlas(c, x, **o))
        ours_seconds, ours = median(lambda r=residual, s=slope, x=x0, o=options: ga.build_atlas(Surface(r, s), x, **o))
        covers = [cover(residual, slope, x0, radius=RADIUS, epsilon=EPSILON) for _ in range(REPEATS)]
        seconds = statistics.median(c.seconds for c in covers)
        charts = statistics.median(c.n_charts for c in covers)
        frontier = max(c.frontier_percent for c in covers)
        each = seconds / charts / (ours_seconds / ours.n_charts)
        rows.append(
            f"{name} | {ours.n_charts} in {ours_seconds:.3f} s | {core_seconds:.3f} s | "
            f"{charts:.0f} in {seconds:.2f} s, frontier {frontier:.0f} % | {seconds / ours_seconds:.1f} | {each:.1f}"
        )
    yield from table("surface | graspatlas | compiled equation | OMPL | time ratio | time ratio per chart", rows)


def against_numpy() -> Iterator[str]:
    """Sphere, torus and can with the plain NumPy atlas."""
    yield "## A plain NumPy atlas"
    yield ""
    yield "The same algorithm and tests in `numpy_atlas.py`, with the same compiled equations."
    yield ""
    can = ga.load_problem("schunk_can")
    cases: list[tuple[str, Any, Any, float, float]] = [
        (name, compiled, x0, RADIUS, EPSILON) for name, (compiled, x0, _, _) in SURFACES.items()
    ]
    cases.append(("schunk_can", can.system(2), can.x1_array, 0.17, 0.5))
    rows = []
    for name, system, x0, radius, epsilon in cases:
        ours, atlas = median(
            lambda s=system, x=x0, r=radius, e=epsilon: ga.build_atlas(s, x, radius=r, epsilon=e, progress=False)
        )
        plain, other = median(lambda s=system, x=x0, r=radius, e=epsilon: NumpyAtlas(s, r, e).build(x), repeats=1)
        rows.append(
            f"{name}, r = {radius:g} | {atlas.n_charts} in {ours:.3f} s | {len(other.centers)} in {plain:.2f} s | "
            f"{plain / ours:.0f}"
        )
    yield from table("manifold | graspatlas | NumPy | time ratio", rows)


def against_multistart() -> Iterator[str]:
    """The can with SLSQP from random starts, until it is as good as the atlas."""
    yield "## Multi-start SLSQP on the can"
    yield ""
    yield (
        "SciPy's SLSQP on the same equations and bounds, with their exact derivatives, from random starts in the box "
        "that the feasible grasps fill; until one start comes within 0.1 % of the atlas's best grasp (k = 2, "
        f"r = 0.17), or {GIVE_UP:.0f} s have passed. The atlas's time includes the index at every chart. Its "
        "best is the best of its charts, without requirements, which SLSQP does not have either; `climb` goes on from "
        "there, as each start of SLSQP does."
    )
    yield ""
    rows = []
    for index in ("inverse_condition_number", "smallest_semi_axis"):
        problem = ga.load_problem("schunk_can")
        options: dict[str, Any] = {"dimension": 2, "radius": 0.17, "epsilon": 0.5, "quality": index, "require": ()}
        ours, result = median(lambda p=problem, o=options: ga.optimize(p, **o, progress=False))
        climb_seconds, top = median(lambda r=result: ga.climb(r, r.best.chart), repeats=1)
        climbed = f"{top.quality / result.best.quality:.3f} in {climb_seconds:.2f} s"
        for seed in SEEDS:
            ends = multistart(result, GIVE_UP, seed)
            outcome = f"{ends.seconds:.1f} s" if ends.reached else f"not within {ends.seconds:.1f} s"
            ratio = f"{ends.seconds / ours:.0f}" if ends.reached else f"over {ends.seconds / ours:.0f}"
            share = ends.best / result.best.quality
            rows.append(
                f"{index} | {seed} | {result.atlas.n_charts} in {ours:.2f} s | {outcome} | {ratio} | "
                f"{ends.infeasible} | {ends.local} | {share:.3f} | {climbed}"
            )
    head = (
        "index | seed | atlas | SLSQP | time ratio | ended infeasible | ended lower | best over the atlas's | "
        "climb over the atlas's"
    )
    yield from table(head, rows)


def growth_table(title: str, rows: list[Row]) -> Iterator[str]:
    """How time and memory grow along a table."""
    yield f"### {title}"
    yield ""
    lines = []
    for before, row in zip([None, *rows], rows, strict=False):
        factors = (
            f"{row.n_charts / before.n_charts:.1f} | {row.processor_seconds / before.processor_seconds:.1f}"
            if before is not None
            else " | "
        )
        lines.append(
            f"{row.name} | {row.n_charts} | {row.seconds:.3f} | {row.processor_seconds:.3f} | "
            f"{factors} | {1e6 * row.processor_seconds / row.n_charts:.1f} | "
            f"{row.bytes_peak / 2**20:.0f} | {row.bytes_peak / row.n_charts / 1024:.1f} | {row.status}"
        )
    yield from table(
        "| charts | seconds | processor s | charts x | processor x | us a chart | peak MiB | KiB a chart | status",
        lines,
    )


def growth() -> Iterator[str]:
    """Time and memory against the radius, the dimension and the threads."""
    yield "## Growth"
    yield ""
    yield (
        "Each atlas in a process of its own; peak memory is what came to it while the atlas was made, its arrays "
        "included, and says little below a thousand charts."
    )
    yield ""
    yield from growth_table("The can, k = 2, radius halved four times", by_radius("schunk_can", 2, 0.34))
    yield from growth_table("The oil bottle, k = 3, radius halved four times", by_radius("schunk_oil_bottle", 3, 0.8))
    yield from growth_table("Unit spheres of 1 to 6 dimensions, epsilon = 0.3", by_dimension(0.3))
    yield from growth_table("The can, k = 2, r = 0.0425, threads", by_threads("schunk_can", 2, 0.0425))


def affordable() -> Iterator[str]:
    """What two to six dimensions cost."""
    yield "## Which k you can afford"
    yield ""
    yield (
        f"One thread, epsilon = 0.5; an atlas is given up after {PATIENCE:g} s. Seconds are of the processor, "
        "gigabytes what came to the process at the peak, the arrays of the atlas included. The last two columns are "
        "what a chart costs in the larger of the two atlases."
    )
    yield ""
    lines = afford_table(measure())
    write_page(lines)
    yield from lines
    yield ""


def machine() -> Iterator[str]:
    """Processor, memory and versions."""
    cpu, memory = platform.processor() or platform.machine(), 0.0
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="ascii", errors="replace").splitlines()
        cpu = next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), cpu)
        memory = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") / 2**30
    except OSError:
        pass
    found = []
    for package in ("graspatlas", "pin", "numpy", "scipy", "ompl"):
        try:
            found.append(f"{package} {version(package)}")
        except PackageNotFoundError:
            found.append(f"{package} {ga.__version__}" if package == "graspatlas" else f"{package} -")
    cores = len(os.sched_getaffinity(0))
    load = os.getloadavg()[0]
    yield f"Machine: {cpu}, {cores} cores, {memory:.0f} GiB; {platform.system()}, load {load:.1f} at the start."
    yield f"Python {platform.python_version()}, {', '.join(found)}."


SECTIONS = {
    "ompl": against_ompl,
    "numpy": against_numpy,
    "multistart": against_multistart,
    "growth": growth,
    "afford": affordable,
}


def report() -> Iterator[str]:
    """All lines of the report, as they are ready."""
    yield "# Comparisons"
    yield ""
    yield "Written by `make compare`; times are medians of a few runs, of the processor where nothing else is said;"
    yield "ratios are of times of one and the same run."
    yield ""
    yield from machine()
    yield ""
    for section in SECTIONS.values():
        yield from section()


def printed(lines: Iterator[str]) -> str:
    """Lines as they come, and then as one text."""
    out = []
    for line in lines:
        print(line, flush=True)
        out.append(line)
    return "\n".join(out).rstrip() + "\n"


def with_section(text: str, section: str) -> str:
    """A report with this section in the place of the one that has its heading, or at the end."""
    heading = section.partition("\n")[0] + "\n"
    before, found, rest = text.partition(heading)
    if not found:
        return f"{text}\n{section}"
    _, next_mark, after = rest.partition("\n## ")
    return before + section + (next_mark + after if next_mark else "")


def main() -> None:
    """Print the report line by line, and write it; with arguments only the sections that they name."""
    names = sys.argv[1:]
    if unknown := set(names) - set(SECTIONS):
        sys.exit(f"no section is called {', '.join(sorted(unknown))}; there are {', '.join(SECTIONS)}")
    start = time.perf_counter()
    if names:
        text = RESULTS.read_text(encoding="utf-8")
        for name in names:
            text = with_section(text, printed(SECTIONS[name]()))
    else:
        text = printed(report())
    RESULTS.write_text(text, encoding="utf-8")
    print(f"wrote {RESULTS.name} after {time.perf_counter() - start:.0f} s", file=sys.stderr)


if __name__ == "__main__":
    main()
