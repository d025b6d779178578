"""Which k can be afforded: charts, time and memory of bundled problems in two to six dimensions, as a table.

The table is part of RESULTS.md and of the page of the manual that names it, which are written anew where it stands.
"""

from __future__ import annotations

from math import ceil, floor, log10
from pathlib import Path

from growth import Row, measured, problem_atlas

import graspatlas as ga

#: The bundled problems that have so many dimensions: how the table names them, and with which radii they are covered.
PROBLEMS = {
    "schunk_oil_bottle": ("the bottle", {2: 0.03, 3: 0.2, 4: 0.4, 5: 0.8, 6: 1.0}),
    "schunk_can": ("the can", {2: 0.03, 3: 0.2, 4: 0.8, 5: 1.2, 6: 1.4}),
}
#: When an atlas is given up [s].
PATIENCE = 60.0
#: The page of the manual, and what stands round the table there.
PAGE = Path(__file__).parents[1] / "docs" / "hand_motions.md"
BEGIN, END = "<!-- written by make compare -->\n", "<!-- end of what is written by make compare -->\n"


def measure() -> dict[str, dict[int, Row]]:
    """The atlases on one thread, each in a process of its own: by problem and k."""
    return {
        name: {
            k: measured(f"{radius:g}", problem_atlas(name, k, radius, threads=1, max_seconds=PATIENCE))
            for k, radius in radii.items()
        }
        for name, (_, radii) in PROBLEMS.items()
    }


def afford_table(found: dict[str, dict[int, Row]]) -> list[str]:
    """Lines of the table in Markdown: a row for each k, with what a chart costs in the atlas that has most."""
    heads = [f"{name}: r | charts | s | GB" for name, _ in PROBLEMS.values()]
    head = " | ".join(["k", *heads, "us a chart", "kB a chart"])
    lines = [f"| {head} |", "|" + " --- |" * (head.count("|") + 1)]
    for k in next(iter(found.values())):
        rows = [by_k[k] for by_k in found.values()]
        largest = max(rows, key=lambda row: row.n_charts)
        cells = [cell for row in rows for cell in (row.name, *_costs(row))]
        each = (1e6 * largest.processor_seconds, 1e-3 * largest.bytes_peak)
        cells += [rounded_up(sum_of_all / largest.n_charts) for sum_of_all in each]
        lines.append(f"| {' | '.join([str(k), *cells])} |")
    return lines


def _costs(row: Row) -> tuple[str, str, str]:
    """Charts, seconds of the processor and gigabytes; of an atlas that was given up there are more."""
    more = "over " if row.status == str(ga.Status.TIME_LIMIT) else ""
    return f"{more}{row.n_charts:,}", more + rounded(row.processor_seconds), more + rounded(1e-9 * row.bytes_peak)


def rounded(value: float) -> str:
    """Two digits."""
    return f"{float(f'{value:.2g}'):g}"


def rounded_up(value: float) -> str:
    """Two digits, not less than the value."""
    unit = 10.0 ** (floor(log10(value)) - 1)
    return f"{ceil(value / unit) * unit:,.{max(0, -floor(log10(unit)))}f}"


def between_marks(text: str, lines: list[str]) -> str:
    """A page with these lines instead of those between the marks.

    Raises:
        ValueError: If the page lacks a mark.
    """
    before, begin, rest = text.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not (begin and end):
        raise ValueError(f"the page lacks {BEGIN.strip()} or {END.strip()}")
    return before + BEGIN + "\n" + "\n".join(lines) + "\n\n" + END + after


def write_page(lines: list[str]) -> None:
    """Put the table into the manual."""
    PAGE.write_text(between_marks(PAGE.read_text(encoding="utf-8"), lines), encoding="utf-8")
