"""Wrong words after graspatlas propose: one line each, that says what came and what to do next."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
import trimesh
from proposals.conftest import HAND

from graspatlas.cli import main

#: Words that replace or follow `HAND can.stl --output out`, and what is said.
WRONG = {
    "no such hand": (["nohand", "can.stl"], r"hand 'nohand' is not a file.*did you mean"),
    "a hand that is near": (["alegro_right_hand", "can.stl"], r"did you mean 'allegro_right_hand'"),
    "no such mesh": ([HAND, "none.stl"], r"no mesh file 'none\.stl'; correct the path"),
    "no mesh": ([HAND, "text.stl"], r"mesh 'text\.stl' has no faces"),
    "a mesh of nothing": ([HAND, "empty.obj"], r"empty\.obj"),
    "a mesh in millimetres": ([HAND, "mm.stl"], r"0\.001"),
    "a mesh too large": ([HAND, "crate.stl"], r"no posture .* could hold 'crate\.stl'.*check that its size fits"),
    "too many fingers": ([HAND, "can.stl", "--fingers", "9"], r"9 fingertips .* it has 4 with a pad; name more links"),
    "one finger": ([HAND, "can.stl", "--fingers", "1"], r"takes two fingertips at least.*ask for more fingers"),
    "no number of fingers": ([HAND, "can.stl", "--fingers", "two"], r"invalid int value: 'two'"),
    "no such link": ([HAND, "can.stl", "--links", "nolink"], r"frame 'nolink' is not in hand"),
    "one link": ([HAND, "can.stl", "--links", "link_3.0_tip"], r"takes two fingertips at least"),
    "no such index": ([HAND, "can.stl", "--quality", "nice"], r"quality index 'nice' is unknown; known:"),
    "no such requirement": ([HAND, "can.stl", "--require", "nice"], r"requirement 'nice' is unknown; known:"),
    "a requirement of letters": ([HAND, "can.stl", "--require", "force_closure:a"], r"force_closure"),
    "negative friction": ([HAND, "can.stl", "--require", "force_closure:-1"], r"friction"),
    "none to propose": ([HAND, "can.stl", "--top", "0"], r"top must be a whole number of at least 1, got 0"),
    "no time": ([HAND, "can.stl", "--max-seconds", "0"], r"max_seconds must be a positive number"),
    "no end of time": ([HAND, "can.stl", "--max-seconds", "nan"], r"max_seconds must be a positive number"),
    "no scale": ([HAND, "can.stl", "--scale", "0"], r"scale must be a positive number, got 0"),
    "a negative seed": ([HAND, "can.stl", "--seed", "-3"], r"seed must be a whole number of at least 0, got -3"),
    "no file of obstacles": ([HAND, "can.stl", "--obstacles", "no.yaml"], r"cannot read file of obstacles 'no\.yaml'"),
    "a file without obstacles": ([HAND, "can.stl", "--obstacles", "bare.yaml"], r"bare\.yaml:1: obstacles: is missing"),
    "a wrong obstacle": ([HAND, "can.stl", "--obstacles", "round.yaml"], r"round\.yaml:3: .*radius"),
    "a list of nothing": ([HAND, "can.stl", "--obstacles", "list.yaml"], r"list\.yaml"),
    "two tables": ([HAND, "can.stl", "--obstacles", "table.yaml", "--on-table"], r"two obstacles are called 'table'"),
    "obstacles that nothing sees": (
        [HAND, "can.stl", "--on-table", "--require", "force_closure"],
        r"require collision_free too",
    ),
    "no workers": ([HAND, "can.stl", "--workers", "0"], r"workers must be a whole number from 1 to"),
    "both": ([HAND, "can.stl", "--workers", "2", "--scheduler", "tcp://127.0.0.1:9"], r"not both"),
    "an empty address": ([HAND, "can.stl", "--scheduler", ""], r"scheduler must be an address such as"),
    "a file for a folder": ([HAND, "can.stl", "--output", "text.stl"], r"cannot write to folder 'text\.stl'.*another"),
    "no folder": ([HAND, "can.stl", "--output", ""], r"the path is empty; name a place"),
}


@pytest.fixture(scope="module")
def meshes(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("meshes")
    trimesh.creation.cylinder(0.03, 0.1).export(folder / "can.stl")
    trimesh.creation.cylinder(30.0, 100.0).export(folder / "mm.stl")
    trimesh.creation.box((0.9, 0.8, 0.9)).export(folder / "crate.stl")
    (folder / "text.stl").write_text("hello\n")
    (folder / "bare.yaml").write_text("name: nothing\n")
    (folder / "list.yaml").write_text("- 1\n")
    (folder / "round.yaml").write_text("obstacles:\n  - name: ball\n    sphere: {radius: -1}\n")
    (folder / "table.yaml").write_text("obstacles:\n  - {name: table, plane: {}, xyz: [0, 0, -0.05]}\n")
    (folder / "empty.obj").write_text("v 0 0 0\n")
    return folder


@pytest.mark.parametrize("name", WRONG)
def test_one_line_says_what_to_do(
    name: str, meshes: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(meshes)
    words, expected = WRONG[name]
    try:
        status = main(["propose", "--output", "out", *words])
    except SystemExit as stop:
        status = stop.code
    error = capsys.readouterr().err
    assert status == 2
    assert len(error.strip().splitlines()) == 1, error
    assert re.search(expected, error), error
