"""A small problem that the fuzzing tests share, and a limit of time for each of them."""

from __future__ import annotations

import faulthandler
import sys
from collections.abc import Iterator

import pytest
from helpers import BENT, tripod_problem

import graspatlas as ga

# A test that hangs, even inside compiled code, ends the run with the stack of where it hangs [s].
HANG = 240.0


@pytest.fixture(autouse=True)
def _no_hang() -> Iterator[None]:
    faulthandler.dump_traceback_later(HANG, exit=True, file=sys.__stderr__)
    yield
    faulthandler.cancel_dump_traceback_later()


def small_problem() -> ga.Problem:
    return tripod_problem(
        BENT, defaults={"dimension": 6, "radius": 0.5, "epsilon": 0.5, "quality": "smallest_semi_axis"}
    )


@pytest.fixture(scope="session")
def tripod() -> ga.Problem:
    return small_problem()


@pytest.fixture(scope="session")
def tripod_result(tripod) -> ga.Result:
    return ga.optimize(tripod, max_charts=8)
