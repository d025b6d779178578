"""Measures which quality index tells whether a grasp holds, and writes the tables of physics.md.

For each bundled problem a random sample of the charts that are free of collision is tried in MuJoCo, and each index is
compared with what happened. Run from the root of the repository; it takes some twenty minutes on two cores:

    python docs/make_physics.py
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
MARKS = ("<!-- tables -->", "<!-- end of tables -->")


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


def main() -> None:
    """Try, compare, write."""
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
        both = (predicted > 0.0) & held
        error = float(np.median(np.abs(predicted[both] / broke[both] - 1.0))) if both.any() else float("nan")
        errors.append((name, trials, predicted, error, int(both.sum())))
        heads.append(name)
        print(f"{name}: {int(held.sum())} of {len(held)} held, {trials.seconds:.0f} s", file=sys.stderr)
    write(heads, forces, areas, errors)


def number(value: float) -> str:
    """A number of a table; a dash for none."""
    return "-" if np.isnan(value) else f"{value:.2f}"


def write(heads: list[str], forces: dict, areas: dict, errors: list) -> None:
    """Put the tables between the marks of the page."""
    titles = ("problem", "friction", "tried", "held", "closed", "of the closed held", "median error of `holding_force`")
    lines = ["| " + " | ".join(titles) + " |", "|---" * len(titles) + "|"]
    for name, trials, predicted, error, _ in errors:
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
    page = PAGE.read_text(encoding="utf-8")
    before, rest = page.split(MARKS[0])
    _, after = rest.split(MARKS[1])
    PAGE.write_text("\n".join([before + MARKS[0], *lines, MARKS[1]]) + after, encoding="utf-8")


if __name__ == "__main__":
    main()
