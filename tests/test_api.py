"""The public interface is documented, and every example runs."""

from __future__ import annotations

import inspect
import os
import subprocess
import sys
from types import ModuleType

import pytest
from helpers import ROOT, slow_but

import graspatlas as ga

EXAMPLES = sorted((ROOT / "examples").glob("*.py"))
PACKAGES = ("atlas", "grasps", "hand", "optimizer", "paths", "problem", "requirements", "result", "search", "sweep")
MODULES = [
    *(ga, ga.motions, ga.patches, ga.quality, ga.systems),
    *(__import__(f"graspatlas.{name}", fromlist=["x"]) for name in PACKAGES),
]


@pytest.mark.parametrize("module", MODULES, ids=lambda m: m.__name__)
def test_every_public_name_exists_and_is_documented(module):
    assert module.__doc__
    for name in module.__all__:
        thing = getattr(module, name)
        if inspect.isclass(thing) or inspect.isroutine(thing) or isinstance(thing, ModuleType):
            assert inspect.getdoc(thing), f"{module.__name__}.{name}"


def public_members():
    for name in ga.__all__:
        cls = getattr(ga, name)
        if not inspect.isclass(cls) or issubclass(cls, Exception):
            continue
        for member, value in inspect.getmembers(cls):
            if member.startswith("_") or member in dir(int) or member in dir(str):
                continue
            if callable(value) or isinstance(value, property) or hasattr(value, "func"):
                yield name, member, value


@pytest.mark.parametrize(
    ("owner", "member", "value"), list(public_members()), ids=lambda v: v if isinstance(v, str) else ""
)
def test_every_public_method_is_documented(owner, member, value):
    assert inspect.getdoc(value), f"{owner}.{member}"


def test_all_is_complete_and_sorted():
    assert list(ga.__all__) == sorted(ga.__all__)
    public = {
        name for name, value in vars(ga).items() if not name.startswith("_") and not isinstance(value, ModuleType)
    }
    public |= {name for name in ga.__all__ if name.startswith("plot_")}  # imported on first use
    assert public == {name for name in ga.__all__ if not isinstance(getattr(ga, name), ModuleType)}


def test_errors_are_value_errors():
    assert issubclass(ga.GraspAtlasError, ValueError)


def test_bundled_problems_are_all_right():
    names = ga.bundled_problems()
    assert {"schunk_can", "schunk_oil_bottle"} <= set(names)
    for name in names:
        problem = ga.load_problem(name)
        assert problem.name == name
        assert problem.description
        again = ga.Problem.from_dict(problem.to_dict())
        assert again.to_dict() == problem.to_dict()
        result = ga.optimize(problem, max_charts=40, require=[])
        assert result.check().passed
        assert result.best.quality >= result.worst.quality


def test_there_are_examples():
    assert len(EXAMPLES) >= 2


@pytest.mark.parametrize(
    "path",
    slow_but(EXAMPLES, ROOT / "examples" / "sphere.py"),
    ids=lambda p: p.stem,
)
def test_example_runs(path, tmp_path):
    done = subprocess.run(
        [sys.executable, "-W", "error", str(path)],
        cwd=tmp_path,
        env={name: value for name, value in os.environ.items() if name != "DISPLAY"},
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout
    assert "FAILED" not in done.stdout
