"""Fixtures that several files share; the atlases are traced once for the whole run."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

import graspatlas as ga
from graspatlas.cli import main

settings.register_profile(
    "graspatlas",
    deadline=None,
    derandomize=True,
    database=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.function_scoped_fixture],
)
settings.load_profile("graspatlas")


@pytest.fixture(scope="session")
def can() -> ga.Problem:
    return ga.load_problem("schunk_can")


@pytest.fixture(scope="session")
def bottle() -> ga.Problem:
    return ga.load_problem("schunk_oil_bottle")


@pytest.fixture(scope="session")
def can_result(can: ga.Problem) -> ga.Result:
    return ga.optimize(can, dimension=2, radius=0.17, epsilon=0.5, quality="manipulability_volume", require=[])


@pytest.fixture(scope="session")
def bottle_result(bottle: ga.Problem) -> ga.Result:
    return ga.optimize(bottle, dimension=2, radius=0.04, epsilon=0.5, quality="manipulability_volume", require=[])


@pytest.fixture(scope="session")
def small_result(bottle: ga.Problem) -> ga.Result:
    return ga.optimize(bottle, dimension=2, radius=0.2, epsilon=0.5, quality="manipulability_volume", require=[])


@pytest.fixture(scope="session")
def saved(tmp_path_factory: pytest.TempPathFactory, small_result: ga.Result) -> Path:
    """The same in a file."""
    path = tmp_path_factory.mktemp("saved") / "result.npz"
    small_result.save(path)
    return path


@pytest.fixture(scope="session")
def planar_result() -> ga.Result:
    return ga.optimize(ga.load_problem("planar_hand"))


@pytest.fixture(scope="session")
def gripper() -> ga.Result:
    return ga.optimize(ga.load_problem("gripper_skittle"), refine=True)


@pytest.fixture(scope="session")
def sphere() -> ga.Atlas:
    return ga.build_atlas(ga.systems.Sphere(3), [0.0, 0.0, 1.0], radius=0.1, epsilon=0.1)


@pytest.fixture
def cli(capfd: pytest.CaptureFixture[str]) -> Callable[..., tuple[int, str, str]]:
    """Run the command line in this process; what the compiled libraries print is caught too."""

    def run(*words: object) -> tuple[int, str, str]:
        capfd.readouterr()
        try:
            status = main([str(word) for word in words])
        except SystemExit as exit_:
            status = int(exit_.code or 0)
        out, err = capfd.readouterr()
        return status, out, err

    return run
