"""Names from files do not steer the terminal."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

import graspatlas as ga
from graspatlas.cli import main
from graspatlas.support.terminal import printable

#: Modules of the standard library, and others, that the viewer or a worker imports.
PLANTED = ("html", "secrets", "pickle", "socket", "multiprocessing", "tornado", "zmq", "numpy", "base64", "selectors")


EVIL = "can\x1b]0;owned\x07\x1b[31m\u202e\x9b31m\r"


def test_control_codes_in_names_do_not_reach_the_terminal(
    small_result: ga.Result, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    named = replace(small_result, problem=replace(small_result.problem, name=EVIL))
    named.save(tmp_path / "result.npz")
    hand = json.loads(json.dumps(ga.load_problem("planar_hand").to_dict()))
    hand["contacts"][0]["frame"] = EVIL
    (tmp_path / "frame.json").write_text(json.dumps(hand))
    (tmp_path / "name.json").write_text(json.dumps({**ga.load_problem("planar_hand").to_dict(), "name": EVIL}))
    (tmp_path / "field.json").write_text(json.dumps({EVIL: 1}))
    ways = [
        ["check-result", tmp_path],
        ["export", tmp_path, "--grasps", tmp_path / "g.csv"],
        ["pareto", tmp_path, "smallest_semi_axis", "inverse_condition_number"],
        ["path", tmp_path],
        ["densify", tmp_path, "0.2"],
        ["view", tmp_path, "--html", tmp_path / f"{EVIL}.html"],
        ["optimize", tmp_path / "frame.json"],
        ["optimize", tmp_path / "field.json"],
        ["check", tmp_path / "frame.json"],
        ["optimize", tmp_path / "name.json", "--radius", "0.4"],
        ["optimize", EVIL],
        ["optimize", "planar_hand", "--quality", EVIL],
    ]
    for words in ways:
        main([str(word) for word in words])
        said = capsys.readouterr()
        for text in (said.out, said.err):
            assert not [letter for letter in text if not letter.isprintable() and letter != "\n"], (words, text)


def test_printable() -> None:
    assert printable("plain é 手 2 mm") == "plain é 手 2 mm"
    assert printable("a\x1b[0m\nb\x9b\u202e\ud800\t") == "a\\x1b[0m\\nb\\x9b\\u202e\\ud800\\t"
