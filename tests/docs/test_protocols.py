"""The figures of the protocols in docs/simulation.md are those of the code."""

from __future__ import annotations

import re

import numpy as np
import pytest
from pages import read

from graspatlas.simulation.protocols import PROTOCOLS

ROWS = {
    m[1]: [cell.strip() for cell in m[2].split("|")]
    for m in re.finditer(
        r"^\| `([\w-]+)` \|(.*)\|$", read("simulation.md").split("## Protocols")[1].split("## What is")[0], re.MULTILINE
    )
}


def test_every_protocol_has_its_row() -> None:
    assert list(ROWS) == list(PROTOCOLS)


@pytest.mark.parametrize("name", PROTOCOLS)
def test_figures_of_a_protocol(name: str) -> None:
    p = PROTOCOLS[name]
    mass, friction, soft, servos, push, lost = ROWS[name]
    assert mass == f"{1e3 * p.mass:g} g"
    assert friction == f"{p.friction:g}"
    assert soft == (f"{1e3 * p.torsional:g} mm" if p.torsional else "no")
    if servos != "the same":
        assert servos.startswith(f"{p.stiffness:g} N m/rad")
    else:
        assert (p.stiffness, p.largest_torque) == (5.0, 3.0)
    assert push.startswith(f"{p.force:g} N, {p.seconds:g} s")
    assert ("in a row" in push, "breaking" in push) == (p.in_a_row, p.breaks)
    turn = f", {np.degrees(p.turn):.0f}°" if np.isfinite(p.turn) else ""
    assert lost == f"{1e3 * p.shift:g} mm{turn}"
