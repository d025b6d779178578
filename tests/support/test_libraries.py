"""Pinocchio or coal of another installation, as ROS has them, neither break the import nor end in a riddle."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from graspatlas.libraries import LIBRARIES, in_the_way

pytestmark = pytest.mark.skipif(
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


def test_our_libraries_come_before_those_on_the_library_path(tmp_path):
    for name in LIBRARIES:
        fake(tmp_path, name)
    found = run(LD_LIBRARY_PATH=str(tmp_path))
    assert found.returncode == 0, found.stderr
    assert found.stdout == "[ True]\n"


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
