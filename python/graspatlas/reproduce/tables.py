"""All numbers of a report as CSV and as JSON; both hold the same."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterator, Mapping, Sequence

from graspatlas.reproduce.report import Section

__all__ = ["to_csv", "to_json"]

COLUMNS = ("experiment", "run", "quantity", "paper", "here", "unit", "why")


def _rows(sections: Sequence[Section]) -> Iterator[dict[str, str | float | int | None]]:
    for section in sections:
        for n in section.numbers:
            values = (section.name, n.run, n.quantity, n.paper, n.ours, n.unit, n.why)
            yield dict(zip(COLUMNS, values, strict=True))


def to_csv(sections: Sequence[Section]) -> str:
    """One line a number; an empty field where the paper prints none."""
    stream = io.StringIO()
    writer = csv.DictWriter(stream, COLUMNS, lineterminator="\n")
    writer.writeheader()
    for row in _rows(sections):
        writer.writerow({key: repr(v) if isinstance(v, float) else v for key, v in row.items()})
    return stream.getvalue()


def to_json(sections: Sequence[Section], machine: Mapping[str, str | int]) -> str:
    """The same numbers, what was found about the paper's claims, and what they were measured on."""
    data = {
        "format": "graspatlas report",
        "machine": dict(machine),
        "numbers": list(_rows(sections)),
        "claims": [
            {"experiment": section.name, "claim": claim.claim, "found": claim.found}
            for section in sections
            for claim in section.claims
        ],
    }
    return json.dumps(data, indent=1) + "\n"
