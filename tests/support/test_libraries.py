"""Pinocchio or coal of another installation, as ROS has them, neither break the import nor end in a riddle."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from graspatlas import libraries
from graspatlas.libraries import LIBRARIES, PINS, in_the_way, other_versions

needs_compiler = pytest.mark.skipif(
    sys.platform != "linux" or shutil.which("c++") is None, reason="needs Linux and a compiler"
)
LOAD = (
    "import graspatlas as ga; print(ga.CollisionFree().met(ga.Grasps(p := ga.load_problem('schunk_can'), p.x1_array)))"
)


def fake(folder: Path, name: str) -> Path:
    """A library of this name that has nothing in it."""
    folder.mkdir(exist_ok=True)
    path = folder / f"{name}.so"
    args = ["c++", "-shared", "-fPIC", "-x", "c++", "/dev/null", f"-Wl,-soname,{path.name}", "-o", str(path)]
    subprocess.run(args, check=True)
    return path


def run(**environment: str) -> subprocess.CompletedProcess[str]:
    """Import the package and check a grasp for collisions, in a process of its own."""
    return subprocess.run(
        [sys.executable, "-c", LOAD], env={**os.environ, **environment}, capture_output=True, text=True
    )


@needs_compiler
def test_our_libraries_come_before_those_on_the_library_path(tmp_path):
    for name in LIBRARIES:
        fake(tmp_path, name)
    found = run(LD_LIBRARY_PATH=str(tmp_path))
    assert found.returncode == 0, found.stderr
    assert found.stdout == "[ True]\n"


@needs_compiler
@pytest.mark.parametrize("name", ["libpinocchio_default", "libpinocchio_parsers", "libcoal"])
def test_a_library_that_is_loaded_before_ours_is_named(name, tmp_path):
    path = fake(tmp_path / "opt", name)
    found = run(LD_PRELOAD=str(path))
    assert found.returncode == 1
    last = found.stderr.strip().splitlines()[-1]
    assert last.startswith(f"ImportError: graspatlas cannot load its own Pinocchio and coal because of {path}: import")
    assert "Traceback" not in last


def test_our_own_are_not_in_the_way():
    assert not [path for path in in_the_way() if "cmeel.prefix" in str(path)]


def test_the_pins_are_those_of_the_build_and_of_the_installation():
    text = (Path(__file__).parents[2] / "pyproject.toml").read_text(encoding="utf-8")
    for name, version in PINS.items():
        stated = re.findall(rf'"{name}(?:\[build\])?==([0-9.]+)"', text)
        assert len(stated) >= 2, name
        assert set(stated) == {version}, name
    assert other_versions() == {}


def test_another_version_of_a_library_is_one_line(tmp_path):
    """As a newer libcoal that another package has brought in; it is not even loaded."""
    other = tmp_path / "libcoal-9.9.dist-info"
    other.mkdir()
    (other / "METADATA").write_text("Metadata-Version: 2.1\nName: libcoal\nVersion: 9.9\n")
    code = f"""
import os, sys
sys.path.insert(0, {str(tmp_path)!r})
seen = os.path.isdir
os.path.isdir = lambda path: not str(path).endswith("libcoal-{PINS["libcoal"]}.dist-info") and seen(path)
import graspatlas
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 1
    last = done.stderr.strip().splitlines()[-1]
    assert last == (
        f"ImportError: graspatlas {libraries.__version__} is compiled for libcoal {PINS['libcoal']}, but libcoal 9.9 "
        f"is installed, which its C++ core cannot use: pip install libcoal=={PINS['libcoal']}"
    )


@needs_compiler
def test_the_doctor_comes_where_the_core_does_not_load(tmp_path):
    path = fake(tmp_path / "opt", "libcoal")
    words = [sys.executable, "-m", "graspatlas", "doctor", "--json"]
    done = subprocess.run(words, env={**os.environ, "LD_PRELOAD": str(path)}, capture_output=True, text=True)
    assert done.returncode == 1, done.stderr
    findings = json.loads(done.stdout)
    core = next(finding for finding in findings if finding["subject"] == "compiled core")
    assert core["mark"] == "problem"
    assert str(path) in core["text"]
    assert any(finding["subject"] == "in the way" and str(path) in finding["text"] for finding in findings)
