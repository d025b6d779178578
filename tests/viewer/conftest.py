"""Results that the viewer is tried with."""

from __future__ import annotations

import pytest
from helpers import slow_but

import graspatlas as ga


@pytest.fixture(params=slow_but(["can_result", "bottle_result"], "can_result"), scope="module")
def result(request: pytest.FixtureRequest) -> ga.Result:
    found: ga.Result = request.getfixturevalue(request.param)
    return found
