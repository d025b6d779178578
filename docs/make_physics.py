"""Measures which quality index tells whether a grasp holds, and writes the tables of physics.md.

For each bundled problem random charts are tried in MuJoCo, and indices are compared with what happened. Run from the
root of the repository; all tables take half an hour on two cores, or name some of `indices`, `closed`, `defaults`:

    python docs/make_physics.py closed defaults
"""

from __future__ import annotations

import sys
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from scipy.stats import rankdata, spearmanr

import graspatlas as ga
from graspatlas.quality import INDICES
from graspatlas.requirements.force_closure import stated_friction

#: How many charts of each problem are tried, and the random seed.
SAMPLE, SEED = 120, 1
#: Indices that take friction, and those of them that know soft fingers.
WITH_FRICTION = ("force_closure_margin", "ferrari_canny_epsilon", "ferrari_canny_volume", "min_weight", "holding_force")
SOFT = ("force_closure_margin", "soft_finger_epsilon", "holding_force")
PAGE = Path(__file__).parent / "physics.md"
#: Charts of each problem in the other tables, distances of their pregrasps [m], and charts of the hard trials.
FEWER, DISTANCES, HARD = 60, (0.005, 0.02), 100
#: What the problems' own fingertips may sink in, now that shapes touch exactly [m].
TOUCH_DEPTH = 5e-5


def area_under_curve(values: np.ndarray, held: np.ndarray) -> float:
    """Probability that a grasp that holds has a larger value than one that does not; NaN where all do, or none does."""
    n, m = int(held.sum()), int((~held).sum())
    if not n or not m:
        return float("nan")
    return float((rankdata(values)[held].sum() - n * (n + 1) / 2.0) / (n * m))


def rank_correlation(values: np.ndarray, forces: np.ndarray) -> float:
    """Spearman's; NaN where one of them is the same for all."""
    if np.ptp(values) == 0.0 or np.ptp(forces) == 0.0:
        return float("nan")
    return float(spearmanr(values, forces).statistic)


def value_of(name: str, grasps: ga.Grasps, friction: float, torsional: float) -> np.ndarray:
    """An index under the friction of the trials, where it takes one."""
    options: dict[str, float] = {"friction": friction} if name in WITH_FRICTION else {}
    if name == "soft_finger_epsilon":
        options = {"friction": friction}
    if name in SOFT and torsional > 0.0:
        options["torsional"] = torsional
    return np.asarray(partial(INDICES[name], **options)(grasps))


def tried(name: str) -> tuple[ga.Result, ga.Simulation]:
    """A sample of the collision-free charts of a problem, tried with the friction that the problem states."""
    problem = ga.load_problem(name)
    friction = stated_friction(problem.requirements) or (0.5, 0.0)
    free = [r for r in problem.requirements if isinstance(r, ga.CollisionFree)] or [ga.CollisionFree()]
    result = ga.optimize(problem, require=free)
    stated = [ga.ForceClosure(friction[0], 0.0, friction[1])]
    charts = np.sort(np.random.default_rng(SEED).permutation(result.candidates())[:SAMPLE])
    with_stated = replace(result, requirements=(*result.requirements, *stated))
    trials = ga.simulate(
        with_stated, protocol="shake", stated_contacts=True, charts=charts.tolist(), distance=0.005, breaking=True
    )
    return result, trials


def compare_indices() -> list[str]:
    """Every index against what happened to grasps that are free of collision."""
    heads, forces, areas, errors = [], {n: [] for n in INDICES}, {n: [] for n in INDICES}, []
    for name in ga.bundled_problems():
        result, trials = tried(name)
        grasps = ga.Grasps(result.problem, result.atlas.centers[trials.charts])
        held, broke = trials.held, np.minimum(trials.breaking_forces, 40.0)
        for index in INDICES:
            values = value_of(index, grasps, trials.friction, trials.torsional)
            forces[index].append(rank_correlation(values, broke))
            areas[index].append(area_under_curve(values, held))
        predicted = value_of("holding_force", grasps, trials.friction, trials.torsional)
        errors.append((name, trials, predicted, median_error(predicted, broke, (predicted > 0.0) & held)))
        heads.append(name)
        print(f"{name}: {int(held.sum())} of {len(held)} held, {trials.seconds:.0f} s", file=sys.stderr)
    return table_of_indices(heads, forces, areas, errors)


def median_error(predicted: np.ndarray, broke: np.ndarray, which: np.ndarray) -> float:
    """Of the breaking force, relative to the prediction's; NaN for none."""
    return float(np.median(np.abs(broke[which] / predicted[which] - 1.0))) if which.any() else float("nan")


def closed_grasps() -> list[str]:
    """The holding force against the breaking force of grasps that hard fingers close at friction 0.5."""
    rows = [["problem", "rank correlation", "median error", "simulated by predicted", "held 1 N"]]
    for name in ga.bundled_problems():
        require = [ga.ForceClosure(0.5, 0.02), ga.CollisionFree(touch_depth=TOUCH_DEPTH)]
        result = ga.optimize(ga.load_problem(name), require=require)
        if not result.accepted.any():
            continue
        trials = ga.simulate(result, protocol="shake", sample=FEWER, seed=SEED)
        grasps = ga.Grasps(result.problem, result.atlas.centers[trials.charts])
        predicted, broke = ga.quality.holding_force(grasps, 0.5), trials.breaking_forces
        error = median_error(predicted, broke, predicted > 0.0)
        ratio = f"{np.median(broke / predicted):.2f}"
        held = f"{int(trials.held.sum())} of {len(trials)}"
        rows.append([f"`{name}`", number(rank_correlation(predicted, broke)), f"{100 * error:.0f} %", ratio, held])
        print(*rows[-1], file=sys.stderr)
    return lines_of(rows)


def default_grasps() -> list[str]:
    """What the tests of the field say of the bundled problems' accepted charts and refined bests."""
    near, far = (f"{1e3 * distance:g} mm off" for distance in DISTANCES)
    rows = [["problem", "refined best", near, far, "distance of contacts at most", "hard, closed at 0.3"]]
    for name in ga.bundled_problems():
        problem = ga.load_problem(name)
        result = ga.optimize(problem, refine=True)
        best = ga.simulate(result)
        plain = replace(result, refinement=None)
        both = [ga.simulate(plain, sample=FEWER, seed=SEED, distance=distance) for distance in DISTANCES]
        gap = max(float(np.abs(trials.contact_distances).max()) for trials in both)
        counts = [f"{int(trials.held.sum())} of {len(trials)}" for trials in both]
        require = [ga.ForceClosure(0.3, 0.02), ga.CollisionFree(touch_depth=TOUCH_DEPTH)]
        closed, hard = ga.optimize(problem, require=require), "none closes"
        if closed.accepted.any():
            trials = ga.simulate(closed, protocol="dexgraspbench-hard", sample=HARD, seed=SEED)
            hard = f"{int(trials.held.sum())} of {len(trials)}"
        pushes = f"{int(best.survived[0].sum())} of {best.survived.shape[1]} pushes"
        rows.append([f"`{name}`", pushes, *counts, f"{1e3 * gap:.2g} mm", hard])
        print(*rows[-1], file=sys.stderr)
    return lines_of(rows)


TABLES = {"indices": compare_indices, "closed": closed_grasps, "defaults": default_grasps}


def main() -> None:
    """Measure what is asked for, and put it between its marks in the page."""
    for name in sys.argv[1:] or TABLES:
        lines = TABLES[name]()
        start, end = f"<!-- {name} -->", f"<!-- end of {name} -->"
        before, rest = PAGE.read_text(encoding="utf-8").split(start)
        _, after = rest.split(end)
        PAGE.write_text("\n".join([before + start, *lines, end]) + after, encoding="utf-8")


def lines_of(rows: list[list[str]]) -> list[str]:
    """A table whose first row is its head."""
    lines = ["| " + " | ".join(row) + " |" for row in rows]
    return [lines[0], "|---" * len(rows[0]) + "|", *lines[1:]]


def number(value: float) -> str:
    """A number of a table; a dash for none."""
    return "-" if np.isnan(value) else f"{value:.2f}"


def table_of_indices(heads: list[str], forces: dict, areas: dict, errors: list) -> list[str]:
    """What was tried, then the rank correlations and the areas under the curve."""
    titles = ("problem", "friction", "tried", "held", "closed", "of the closed held", "median error of `holding_force`")
    lines = ["| " + " | ".join(titles) + " |", "|---" * len(titles) + "|"]
    for name, trials, predicted, error in errors:
        closed = predicted > 0.0
        share = f"{int((closed & trials.held).sum())} of {int(closed.sum())}"
        percent = "-" if np.isnan(error) else f"{100 * error:.0f} %"
        contacts = f"{trials.friction:g}" + (f", {1e3 * trials.torsional:g} mm" if trials.torsional else "")
        counts = (len(trials), int(trials.held.sum()), int(closed.sum()))
        lines.append("| " + " | ".join(map(str, (f"`{name}`", contacts, *counts, share, percent))) + " |")
    for title, table in (("Rank correlation with the breaking force", forces), ("Area under the curve", areas)):
        lines += ["", f"**{title}**", "", "| index | " + " | ".join(f"`{head}`" for head in heads) + " |"]
        lines.append("|---|" + "---|" * len(heads))
        order = sorted(table, key=lambda index: -np.nanmean([*table[index], -1.0]))
        lines += [f"| `{index}` | " + " | ".join(map(number, table[index])) + " |" for index in order]
    return lines


if __name__ == "__main__":
    main()
