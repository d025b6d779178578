"""The table of docs/hand_motions.md that says which k one can afford is the measured one."""

from __future__ import annotations

import re

from helpers import ROOT
from pages import read

MARKS = re.compile(r"<!-- written by make compare -->\n\n(.*?)\n\n<!-- end of what is written", re.DOTALL)
SECTION = re.compile(r"^## Which k you can afford\n.*?^(\| k .*?)\n\n", re.DOTALL | re.MULTILINE)


def test_the_table_is_that_of_the_results() -> None:
    """`make compare` writes both: whoever changes one by hand, or writes one alone, is found out."""
    shown = MARKS.search(read("hand_motions.md"))
    measured = SECTION.search((ROOT / "benchmarks" / "RESULTS.md").read_text(encoding="utf-8") + "\n")
    assert shown
    assert measured
    assert shown[1] == measured[1]
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in shown[1].splitlines()]
    assert [row[0] for row in rows[2:]] == ["2", "3", "4", "5", "6"]
    assert len({len(row) for row in rows}) == 1
