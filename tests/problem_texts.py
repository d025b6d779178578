"""Texts of problem files that tests change."""

from __future__ import annotations

from pathlib import Path

import pytest

import graspatlas as ga
from graspatlas.problem_files import ProblemFileError, read_problem
from graspatlas.problems import problem_text

BUNDLED, _, ROBOTS = problem_text("schunk_can")
#: The can without the requirements at its end, so that cases can state their own.
CAN = BUNDLED.partition("\nrequirements:")[0] + "\n"
ALLEGRO = problem_text("allegro_cylinder_3")[0]


def read(text: str) -> ga.Problem:
    return read_problem(text, "can.yaml", ROBOTS)


def fault(text: str, folder: Path = ROBOTS) -> str:
    with pytest.raises(ProblemFileError) as caught:
        read_problem(text, "can.yaml", folder)
    assert "\n" not in str(caught.value)
    return str(caught.value)
