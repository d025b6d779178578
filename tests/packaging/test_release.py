"""What is said of a release in several places is the same everywhere, and what its workflows run exists."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest
import yaml
from helpers import ROOT

import graspatlas as ga
from graspatlas.doctor import EXTRAS, NEEDED

if not (ROOT / ".github").is_dir():
    pytest.skip("the workflows are in the repository alone", allow_module_level=True)

PROJECT = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
WORKFLOWS = sorted((ROOT / ".github" / "workflows").glob("*.yml"))
PYTHONS = re.findall(r"Programming Language :: Python :: (3\.\d+)", PROJECT)


def runs(path: Path) -> list[str]:
    """What the steps of a workflow run."""
    jobs = yaml.safe_load(path.read_text(encoding="utf-8"))["jobs"].values()
    return [step["run"] for job in jobs for step in job.get("steps", []) if "run" in step]


def test_the_version_is_one_and_has_its_changes() -> None:
    words = [sys.executable, str(ROOT / ".github" / "release_notes.py")]
    done = subprocess.run([*words, ga.__version__], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "### " in done.stdout
    assert f'version: "{ga.__version__}"' in (ROOT / "recipe" / "recipe.yaml").read_text(encoding="utf-8")
    done = subprocess.run([*words, "9.9.9"], capture_output=True, text=True)
    assert done.returncode == 1
    assert "make them one" in done.stderr


def test_the_same_pythons_everywhere() -> None:
    tests = yaml.safe_load((ROOT / ".github" / "workflows" / "tests.yml").read_text(encoding="utf-8"))
    assert tests["jobs"]["tests"]["strategy"]["matrix"]["python"] == PYTHONS
    assert f'requires-python = ">={PYTHONS[0]}"' in PROJECT
    wheels = re.findall(r"cp(3)(\d+)-\*", PROJECT)
    assert [".".join(parts) for parts in wheels] == PYTHONS


@pytest.mark.parametrize("path", WORKFLOWS, ids=lambda path: path.stem)
def test_workflows_run_what_there_is(path: Path) -> None:
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE))
    for line in runs(path):
        for target in re.findall(r"\bmake ([a-z-]+)", line):
            assert target in targets, line
        for script in re.findall(r"python (\S+\.py)", line):
            assert (ROOT / script).is_file(), line


@pytest.mark.parametrize("example", sorted((ROOT / "examples").glob("*.py")), ids=lambda path: path.stem)
def test_examples_say_what_they_need(example: Path) -> None:
    """Their PEP 723 header, by which `uv run` sets up an environment."""
    head = re.match(r"# /// script\n((?:#.*\n)+?)# ///\n\"\"\"", example.read_text(encoding="utf-8"))
    assert head, example
    assert f'requires-python = ">={PYTHONS[0]}"' in head[1]
    assert 'dependencies = ["graspatlas"]' in head[1]
    assert 'graspatlas = { path = ".." }' in head[1]


def test_the_doctor_looks_at_what_is_needed() -> None:
    needed = PROJECT.partition("\ndependencies = [")[2].partition("]")[0]
    stated = {name.lower() for name in re.findall(r'^  "([A-Za-z_-]+)', needed, re.MULTILINE)}
    assert {name.lower() for name in NEEDED} <= stated
    assert stated - {"libpinocchio", "libcoal", "cmeel-qhull", "eiquadprog"} == {name.lower() for name in NEEDED}
    extras = PROJECT.partition("[project.optional-dependencies]")[2]
    for name, extra in EXTRAS.items():
        assert re.search(rf'^{extra} = \[.*"{name}', extras, re.MULTILINE), name
