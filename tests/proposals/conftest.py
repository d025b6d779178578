"""A can that the Allegro hand takes, proposed once for all tests that read what comes out."""

from __future__ import annotations

from pathlib import Path

import pytest
import trimesh

import graspatlas as ga

HAND = "allegro_right_hand"
LINKS = ["link_3.0_tip", "link_7.0_tip", "link_15.0_tip"]


@pytest.fixture(scope="session")
def can_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("mesh") / "can.stl"
    trimesh.creation.cylinder(0.03, 0.1).export(path)
    return path


@pytest.fixture(scope="session")
def output(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("proposals")


@pytest.fixture(scope="session")
def proposed(can_file: Path, output: Path) -> ga.Proposals:
    return ga.propose(HAND, can_file, output, links=LINKS, top=2, max_seconds=None)
