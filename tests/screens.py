"""Looks at meshes and pictures, and at pages in a headless browser."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from graspatlas.viewer.scene import meshes

Array = NDArray[np.float64]


def pixels(path: Path) -> Array:
    with Image.open(path) as image:
        return np.asarray(image.convert("RGB"), float) / 255.0


def share(picture: Array, colour: str) -> float:
    """How much of a picture has the can's blue, the oil's yellow, the contacts' red or the hand's grey."""
    red, green, blue = (picture[..., k] for k in range(3))
    if colour == "blue":
        found = (blue > 0.3) & (blue > 1.8 * red) & (blue > 1.25 * green)
    elif colour == "yellow":
        found = (np.minimum(red, green) > 0.35) & (blue < 0.8 * np.minimum(red, green))
    elif colour == "red":
        found = (red > 0.5) & (np.maximum(green, blue) < 0.3)
    else:
        found = (np.ptp(picture, axis=-1) < 0.05) & (red > 0.45) & (red < 0.78)
    return float(found.mean())


#: What every browser is started with: nothing but the page.
QUIET_FLAGS = [
    "--no-sandbox",
    "--enable-unsafe-swiftshader",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]
BROWSER_FLAGS = [
    "--headless",
    *QUIET_FLAGS,
    "--window-size=1200,800",
    "--virtual-time-budget=8000",
    "--enable-logging=stderr",
    "--v=0",
]


def find_browser() -> str:
    for name in ("chromium", "chromium-browser", "google-chrome"):
        if found := shutil.which(name):
            return found
    if os.environ.get("GRASPATLAS_REQUIRE_BROWSER") == "1":
        pytest.fail("no chromium, chromium-browser or google-chrome")
    pytest.skip("no chromium, chromium-browser or google-chrome")


def browse(address: str, folder: Path, *flags: str) -> str:
    """Open a page in a headless browser, which must not complain; returns what it prints."""
    run = subprocess.run(
        [find_browser(), *BROWSER_FLAGS, f"--user-data-dir={folder / 'profile'}", *flags, address],
        capture_output=True,
        text=True,
        timeout=120,
        check=True,
    )
    # What goes wrong in a page is printed as '[...:ERROR:CONSOLE:12] "..."' or '[...:INFO:CONSOLE:12] "Uncaught ..."'.
    console = [line for line in run.stderr.splitlines() if "CONSOLE" in line]
    assert not [line for line in console if re.search(r":ERROR:CONSOLE|Uncaught|THREE\.|Unsupported", line)]
    return run.stdout


def volume(mesh: meshes.Mesh) -> float:
    """Volume that a closed mesh encloses; negative when it is inside out."""
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    return float(np.sum(a * np.cross(b, c))) / 6.0
