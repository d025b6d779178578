"""docs/gallery.md shows every bundled problem, its figures are right, and its pictures are what its script makes."""

from __future__ import annotations

import re
import subprocess
import sys

import numpy as np
import pytest
from helpers import ROOT
from PIL import Image
from screens import pixels

import graspatlas as ga

DOCS = ROOT / "docs"
PAGE = (DOCS / "gallery.md").read_text(encoding="utf-8")
#: Largest picture [bytes].
LARGEST = 150_000


def row_of(name: str) -> str:
    """The one row of the page's tables that shows a problem."""
    (row,) = [line for line in PAGE.splitlines() if line.startswith("|") and f"images/gallery_{name}.png)" in line]
    return row


@pytest.mark.parametrize("name", ga.bundled_problems())
def test_every_bundled_problem_is_shown(name):
    problem, row = ga.load_problem(name), row_of(name)
    assert f"[{name}](../python/graspatlas/problems/{name}.yaml)" in row
    assert f"t = {problem.full_dimension}, k = {problem.defaults['dimension']}; " in row
    assert re.search(r"`python \S+\.py[a-z0-9_ ]*`", row), "the command that makes the picture"
    picture = DOCS / "images" / f"gallery_{name}.png"
    assert picture.stat().st_size < LARGEST
    with Image.open(picture) as image:
        assert image.size == (640, 480)


def test_every_picture_is_of_a_bundled_problem():
    shown = {path.stem.removeprefix("gallery_") for path in (DOCS / "images").glob("gallery_*.png")}
    assert shown == set(ga.bundled_problems())


def test_commands_exist():
    for script in re.findall(r"`python (\S+\.py)", PAGE):
        assert (DOCS.parent / script).is_file(), script


@pytest.mark.slow
def test_the_script_makes_the_picture(tmp_path):
    words = [str(DOCS / "make_gallery.py"), "planar_hand", "--output", str(tmp_path)]
    done = subprocess.run([sys.executable, "-W", "error", *words], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    assert "t = 3, k = 2" in done.stdout
    made, kept = pixels(tmp_path / "gallery_planar_hand.png"), pixels(DOCS / "images" / "gallery_planar_hand.png")
    assert np.abs(made - kept).mean() < 0.01
