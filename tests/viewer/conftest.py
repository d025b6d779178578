"""Results that the viewer is tried with."""

from __future__ import annotations

import pytest

import graspatlas as ga


@pytest.fixture(params=["can_result", "bottle_result"])
def result(request: pytest.FixtureRequest) -> ga.Result:
    found: ga.Result = request.getfixturevalue(request.param)
    return found
