"""How reliably the best of all feasible grasps is found: the same search with several seeds.

``python benchmarks/best_of_all.py [PROBLEM ...] [--seeds N]`` searches each problem, all bundled ones by default, with
its own index and requirements. A row gives the best value of all seeds, by what share the worst seed misses it, medians
of seconds, climbs and peaks, and the largest share of climbs that may end elsewhere. Beside it stands what the climbs
of ``refine="feasible"``, which start at the charts of the one atlas, reach of that best.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass
from statistics import median

import graspatlas as ga

#: Seeds of a problem, unless stated otherwise.
SEEDS = 5


@dataclass(frozen=True)
class Run:
    """One search: its best value, how it ended, its time [s], and what it says of itself."""

    best: float
    status: str
    seconds: float
    climbs: int
    peaks: int
    share_missing: float


def search(problem: ga.Problem, seed: int) -> Run:
    """One search over all feasible grasps.

    Raises:
        GraspAtlasError: If no grasp that meets the requirements is found.
    """
    start = time.perf_counter()
    refinement = ga.optimize(problem, motions="all", seed=seed, progress=False).refinement
    assert refinement is not None
    assert refinement.search is not None
    said = refinement.search
    return Run(
        best=float(refinement.qualities[0]),
        status=f"{said.status}, {refinement.statuses[0]}",
        seconds=time.perf_counter() - start,
        climbs=said.climbs,
        peaks=said.peaks,
        share_missing=said.share_missing,
    )


def best_from_one_atlas(problem: ga.Problem) -> float:
    """What climbs in F reach from the best charts of the problem's own atlas; 0 where no chart is accepted."""
    result = ga.optimize(problem, refine="feasible", progress=False)
    return result.refined_best.quality if result.accepted.any() else 0.0


def row(name: str, seeds: int) -> str:
    """One problem, searched with so many seeds."""
    problem = ga.load_problem(name)
    try:
        runs = [search(problem, seed) for seed in range(seeds)]
    except ga.GraspAtlasError as error:
        return f"{name:20} {error}"
    best = max(run.best for run in runs)
    spread = 1.0 - min(run.best for run in runs) / best
    status = " / ".join(sorted({run.status for run in runs}))
    return (
        f"{name:20} {best:12.6g} {spread:9.1e} {median(run.seconds for run in runs):8.1f} s "
        f"{median(run.climbs for run in runs):7.0f} {median(run.peaks for run in runs):6.0f} "
        f"{max(run.share_missing for run in runs):7.2%} {best_from_one_atlas(problem) / best:8.1%}   {status}"
    )


def main() -> None:
    """Print a row for each problem."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("problems", nargs="*", default=ga.bundled_problems(), help="all bundled ones by default")
    parser.add_argument("--seeds", type=int, default=SEEDS, help=f"{SEEDS} by default")
    options = parser.parse_args()
    print(
        f"{'problem':20} {'best':>12} {'spread':>9} {'time':>10} {'climbs':>7} {'peaks':>6} {'missing':>7} "
        f"{'1 atlas':>8}   how the searches and their best ended"
    )
    for name in options.problems:
        print(row(name, options.seeds), flush=True)


if __name__ == "__main__":
    main()
